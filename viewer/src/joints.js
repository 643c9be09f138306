// Joints: how a link moves with its slider, and the marks of axis and range. Axes are in the world at the first view.
import {
  Box3, BufferGeometry, ConeGeometry, CylinderGeometry, DoubleSide, Group, Line, LineBasicMaterial, Matrix4, Mesh,
  MeshBasicMaterial, Quaternion, RingGeometry, SphereGeometry, Vector3,
} from 'three';

const COLOR = 0x0072b2;
const COLOR_DARK = 0x56b4e9;

/** The freedoms of a joint, each turning ('r') or sliding ('t') along an axis, with its range. */
export function freedoms(joint) {
  const axis = new Vector3(...joint.axis).normalize();
  const aside = Math.abs(axis.x) < 0.8 ? new Vector3(1, 0, 0) : new Vector3(0, 1, 0);
  aside.addScaledVector(axis, -aside.dot(axis)).normalize();
  const third = new Vector3().crossVectors(axis, aside);
  const range = joint.limits || joint.travelled;
  const turn = (about, r) => ({ kind: 'r', axis: about, range: r || [-0.6, 0.6] });
  const slide = (along, r) => ({ kind: 't', axis: along, range: r || [-0.03, 0.03] });
  switch (joint.kind) {
    case 'revolute': return [turn(axis, range)];
    case 'screw': return [{ ...turn(axis, range), pitch: joint.pitch || 0 }];
    case 'prismatic': return [slide(axis, range)];
    case 'cylindrical': return [turn(axis, null), slide(axis, null)];
    case 'planar': return [turn(axis, null), slide(aside, null), slide(third, null)];
    case 'spherical': return [turn(axis, null), turn(aside, null), turn(third, null)];
    default: return [];
  }
}

function step(freedom, origin, amount) {
  if (freedom.kind === 't') return new Matrix4().makeTranslation(...freedom.axis.clone().multiplyScalar(amount).toArray());
  const about = new Matrix4().makeRotationAxis(freedom.axis, amount);
  const back = new Matrix4().makeTranslation(-origin.x, -origin.y, -origin.z);
  const there = new Matrix4().makeTranslation(...origin.clone().addScaledVector(freedom.axis, amount * (freedom.pitch || 0)).toArray());
  return there.multiply(about).multiply(back);
}

function overlay(extra = {}) {
  return new MeshBasicMaterial({ color: COLOR, transparent: true, depthTest: false, depthWrite: false, side: DoubleSide, ...extra });
}

function along(mesh, from, direction) {
  mesh.quaternion.copy(new Quaternion().setFromUnitVectors(new Vector3(0, 1, 0), direction));
  mesh.position.copy(from);
  mesh.renderOrder = 5;
  return mesh;
}

function rod(from, to, thickness) {
  const length = from.distanceTo(to);
  const mesh = new Mesh(new CylinderGeometry(thickness, thickness, length, 12), overlay({ opacity: 0.9 }));
  return along(mesh, from.clone().add(to).multiplyScalar(0.5), to.clone().sub(from).normalize());
}

function tip(at, direction, size) {
  return along(new Mesh(new ConeGeometry(size, 2.6 * size, 16), overlay({ opacity: 0.95 })), at, direction);
}

/** A fan over the range of a turning joint, its zero towards the child. */
function fan(freedom, origin, towards, radius) {
  const flat = towards.clone().sub(origin);
  flat.addScaledVector(freedom.axis, -flat.dot(freedom.axis));
  if (flat.length() < 1e-6) flat.set(1, 0, 0).cross(freedom.axis);
  const x = flat.normalize();
  const y = new Vector3().crossVectors(freedom.axis, x);
  const [low, high] = freedom.range;
  const span = Math.min(high - low, 2 * Math.PI);
  const ring = new Mesh(new RingGeometry(0.15 * radius, radius, 48, 1, low, span), overlay({ opacity: 0.2 }));
  const group = new Group();
  const rim = [];
  for (let i = 0; i <= 48; i++) {
    const a = low + (span * i) / 48;
    rim.push(new Vector3(radius * Math.cos(a), radius * Math.sin(a), 0));
  }
  rim.unshift(new Vector3());
  rim.push(new Vector3());
  const line = new Line(new BufferGeometry().setFromPoints(rim), new LineBasicMaterial({ color: COLOR, depthTest: false, transparent: true, opacity: 0.9 }));
  line.renderOrder = 5;
  ring.renderOrder = 4;
  group.add(ring, line);
  group.matrixAutoUpdate = false;
  group.matrix.makeBasis(x, y, freedom.axis).setPosition(origin);
  return group;
}

/** The middle of a link's mesh at the first view, world. */
function middle(link) {
  if (!link.mesh) return new Vector3().setFromMatrixPosition(link.start);
  const box = new Box3().setFromBufferAttribute(link.mesh.geometry.getAttribute('position'));
  return box.getCenter(new Vector3()).applyMatrix4(link.start);
}

function marks(joint, list, stage, child) {
  const group = new Group();
  const origin = new Vector3(...joint.origin);
  const size = 0.012 * stage.radius;
  const centre = child ? middle(child) : origin;
  for (const freedom of list) {
    const reach = 0.24 * stage.radius;
    if (freedom.kind === 't') {
      const from = origin.clone().addScaledVector(freedom.axis, freedom.range[0] - 0.05 * stage.radius);
      const to = origin.clone().addScaledVector(freedom.axis, freedom.range[1] + 0.1 * stage.radius);
      group.add(rod(from, to, 0.35 * size), tip(to, freedom.axis, 1.3 * size));
      freedom.range.forEach((end) => {
        const stop = new Mesh(new CylinderGeometry(1.6 * size, 1.6 * size, 0.3 * size, 24), overlay({ opacity: 0.75 }));
        group.add(along(stop, origin.clone().addScaledVector(freedom.axis, end), freedom.axis));
      });
    } else {
      const from = origin.clone().addScaledVector(freedom.axis, -0.6 * reach);
      const to = origin.clone().addScaledVector(freedom.axis, reach);
      group.add(rod(from, to, 0.35 * size), tip(to, freedom.axis, 1.3 * size));
      group.add(fan(freedom, origin, centre, 0.8 * reach));
    }
  }
  const ball = new Mesh(new SphereGeometry(0.8 * size, 16, 12), overlay());
  ball.position.copy(origin);
  ball.renderOrder = 5;
  group.add(ball);
  return group;
}

export function buildJoints(stage, data, links) {
  const byName = (name) => links.find((l) => l.data.name === name);
  const joints = data.joints.map((joint) => {
    const list = freedoms(joint).map((f) => ({ ...f, value: 0 }));
    const group = new Group();
    group.matrixAutoUpdate = false;
    const shown = marks(joint, list, stage, byName(joint.child));
    group.add(shown);
    if (list.length) stage.scene.add(group);
    return { data: joint, freedoms: list, marks: group };
  });
  stage.onTheme((dark) => joints.forEach((j) => j.marks.traverse((o) => o.material?.color.set(dark ? COLOR_DARK : COLOR))));

  // Motion since the first view, down the tree: a child moves as its parent does and by its own joint.
  function motion(name, depth = 0) {
    const joint = joints.find((j) => j.data.child === name);
    if (!joint || depth > links.length) return new Matrix4();
    const out = motion(joint.data.parent, depth + 1);
    joint.marks.matrix.copy(out);
    const origin = new Vector3(...joint.data.origin);
    for (const freedom of joint.freedoms) out.multiply(step(freedom, origin, freedom.value));
    return out;
  }

  function move() {
    for (const link of links) {
      link.group.matrix.copy(motion(link.data.name)).multiply(link.start);
      link.group.matrixWorldNeedsUpdate = true;
    }
    joints.forEach((j) => { j.marks.matrixWorldNeedsUpdate = true; });
    stage.draw();
  }
  /** Every joint where it was at the first view. */
  function home() {
    joints.forEach((j) => {
      j.freedoms.forEach((f) => { f.value = 0; });
      j.shown?.();
    });
    move();
  }

  /** Marks and sliders after links that something else moved; `valueOf` tells a joint's position where it has one. */
  function follow(valueOf) {
    for (const joint of joints) {
      const parent = byName(joint.data.parent);
      if (parent) joint.marks.matrix.copy(parent.group.matrix).multiply(parent.start.clone().invert());
      joint.marks.matrixWorldNeedsUpdate = true;
      const value = joint.freedoms.length === 1 ? valueOf(joint.data.name) : null;
      if (value === null) continue;
      joint.freedoms[0].value = value;
      joint.shown?.();
    }
  }
  return { list: joints, move, home, follow };
}
