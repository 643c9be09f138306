// One interaction in the scene at a time: things as they were measured, ghosts as the twin has them go, the tool and its force.
import {
  ConeGeometry, CylinderGeometry, Group, Matrix4, Mesh, MeshBasicMaterial, Quaternion, SphereGeometry, Vector3,
} from 'three';

const GHOST = 0xd55e00;
const FORCE = 0xa0517d;
const FORCE_DARK = 0xdd9abf;
const ONE = new Vector3(1, 1, 1);

/** The row before a time, and how far on to the next; a path stands still before its first and after its last row. */
function between(times, t) {
  if (t <= times[0]) return [0, 0];
  let [low, high] = [0, times.length - 1];
  if (t >= times[high]) return [high, 0];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle;
    else high = middle;
  }
  return [low, (t - times[low]) / Math.max(1e-9, times[high] - times[low])];
}

function placeAt(path, t) {
  const [i, share] = between(path.times, t);
  const from = new Vector3(...path.places[i]);
  return share ? from.lerp(new Vector3(...path.places[i + 1]), share) : from;
}

function poseAt(path, t, turn) {
  const q = turn.clone();
  if (path.turns) {
    const [i, share] = between(path.times, t);
    q.set(...path.turns[i]);
    if (share) q.slerp(new Quaternion(...path.turns[i + 1]), share);
  }
  return new Matrix4().compose(placeAt(path, t), q.normalize(), ONE);
}

export class Film {
  constructor(stage, links, joints) {
    Object.assign(this, { stage, links, joints });
    this.group = new Group();
    this.group.visible = false;
    this.tool = new Mesh(new SphereGeometry(1, 24, 16), new MeshBasicMaterial({ color: FORCE, transparent: true, opacity: 0.55 }));
    // Along y, from 0 to 1: scaled to its length.
    const paint = new MeshBasicMaterial({ color: FORCE, transparent: true, depthTest: false });
    this.shaft = new Mesh(new CylinderGeometry(1, 1, 1, 14).translate(0, 0.5, 0), paint);
    this.head = new Mesh(new ConeGeometry(1, 1, 18).translate(0, -0.5, 0), paint);
    this.arrow = new Group();
    this.arrow.add(this.shaft, this.head);
    this.arrow.children.forEach((o) => { o.renderOrder = 7; });
    this.group.add(this.tool, this.arrow);
    stage.scene.add(this.group);
    stage.onTheme((dark) => {
      paint.color.set(dark ? FORCE_DARK : FORCE);
      this.tool.material.color.set(dark ? FORCE_DARK : FORCE);
    });
    this.ghosts = [];
  }

  /** First and last time at which anything is known, s. */
  static span(replay) {
    const all = [...Object.values(replay.measured), ...Object.values(replay.predicted), replay.tool].filter(Boolean);
    return [Math.min(...all.map((p) => p.times[0])), Math.max(...all.map((p) => p.times[p.times.length - 1]))];
  }

  start(replay) {
    this.stop();
    this.replay = replay;
    this.group.visible = true;
    const forces = replay.force ? replay.force.places.map((f) => Math.hypot(...f)) : [];
    this.peak = Math.max(0, ...forces);
    this.tool.visible = Boolean(replay.tool);
    this.tool.scale.setScalar(replay.tool_radius || 0.008);
    // A ghost lies a hair behind what was measured: it shows where the two differ.
    for (const [name, path] of Object.entries(replay.predicted)) {
      const link = this.links.find((l) => l.data.name === name);
      if (!link?.mesh) continue;
      const material = new MeshBasicMaterial({ color: GHOST, transparent: true, opacity: 0.6, depthWrite: false, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 4 });
      const ghost = new Mesh(link.mesh.geometry, material);
      ghost.matrixAutoUpdate = false;
      ghost.renderOrder = 3;
      this.group.add(ghost);
      this.ghosts.push({ ghost, link, path });
    }
  }

  /** Shows time `t`, s; tells the force then, N, where it is known. */
  show(t) {
    const turnOf = (link) => new Quaternion().setFromRotationMatrix(link.start);
    for (const [name, path] of Object.entries(this.replay.measured)) {
      const link = this.links.find((l) => l.data.name === name);
      if (!link) continue;
      link.group.matrix.copy(poseAt(path, t, turnOf(link)));
      link.group.matrixWorldNeedsUpdate = true;
    }
    for (const { ghost, link, path } of this.ghosts) {
      ghost.matrix.copy(poseAt(path, t, turnOf(link)));
      ghost.matrixWorldNeedsUpdate = true;
    }
    this.joints.follow(() => null);
    const force = this.force(t);
    this.stage.draw();
    return force;
  }

  force(t) {
    const { tool, force } = this.replay;
    if (tool) this.tool.position.copy(placeAt(tool, t));
    this.arrow.visible = Boolean(tool && force);
    if (!this.arrow.visible) return null;
    const now = placeAt(force, t);
    const size = now.length();
    const longest = 0.55 * this.stage.radius;
    const length = Math.max(1e-4, (longest * size) / Math.max(this.peak, 1e-6));
    this.arrow.visible = length > 0.02 * longest;
    // The arrow ends where the tool is: it shows what the tool does to the thing.
    if (this.arrow.visible) {
      const way = now.clone().divideScalar(size);
      this.arrow.position.copy(this.tool.position).addScaledVector(way, -length);
      this.arrow.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), way);
      const head = Math.min(0.4 * length, 0.07 * this.stage.radius);
      const thick = 0.006 * this.stage.radius;
      this.shaft.scale.set(thick, length - head, thick);
      this.head.scale.set(Math.max(0.38 * head, 1.2 * thick), head, Math.max(0.38 * head, 1.2 * thick));
      this.head.position.y = length;
    }
    return size;
  }

  stop() {
    this.ghosts.forEach(({ ghost }) => {
      this.group.remove(ghost);
      ghost.material.dispose();
    });
    this.ghosts = [];
    this.group.visible = false;
    this.replay = null;
  }
}
