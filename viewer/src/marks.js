// What is drawn over the links: centres of mass, planes of symmetry, names.
import {
  Box3, DoubleSide, Group, Line, BufferGeometry, LineBasicMaterial, Mesh, MeshBasicMaterial, PlaneGeometry, Quaternion,
  SphereGeometry, Vector3,
} from 'three';

// More planes than this hide the thing that they mirror.
const SHOWN = 3;

function centreOfMass(stage, link) {
  const group = new Group();
  const size = 0.014 * stage.radius;
  const over = { transparent: true, depthTest: false, depthWrite: false };
  const known = link.data.com_status !== 'assumed';
  const color = known ? 0xe69f00 : 0x999999;
  const ball = new Mesh(new SphereGeometry(size, 24, 16), new MeshBasicMaterial({ color, ...over }));
  const rim = new Mesh(new SphereGeometry(1.35 * size, 24, 16), new MeshBasicMaterial({ color: 0x1b1b1b, ...over }));
  rim.renderOrder = 6;
  ball.renderOrder = 7;
  group.add(rim, ball);
  if (link.data.com_sd) {
    const doubt = new Mesh(new SphereGeometry(1, 32, 20), new MeshBasicMaterial({ color, opacity: 0.28, ...over }));
    doubt.scale.set(...link.data.com_sd.map((s) => Math.max(1.96 * s, 0.2 * size)));
    doubt.renderOrder = 5;
    group.add(doubt);
  }
  group.position.set(...link.data.com);
  return group;
}

function symmetryPlane(stage, link, plane) {
  const box = new Box3().setFromBufferAttribute(link.mesh.geometry.getAttribute('position'));
  const centre = box.getCenter(new Vector3());
  const normal = new Vector3(...plane.normal).normalize();
  const size = box.getSize(new Vector3());
  // Sides of the sheet along the edges of the box where the normal allows it, and a little longer than the box.
  const side = [0, 1, 2].map((i) => new Vector3().setComponent(i, 1)).sort((a, b) => Math.abs(a.dot(normal)) - Math.abs(b.dot(normal)))[0];
  const x = side.clone().addScaledVector(normal, -side.dot(normal)).normalize();
  const y = new Vector3().crossVectors(normal, x);
  const half = (d) => 0.58 * (Math.abs(d.x) * size.x + Math.abs(d.y) * size.y + Math.abs(d.z) * size.z) + 0.012 * stage.radius;
  const [wide, high] = [half(x), half(y)];
  const color = 0xcc79a7;
  const sheet = new Mesh(new PlaneGeometry(2 * wide, 2 * high), new MeshBasicMaterial({ color, transparent: true, opacity: 0.2, side: DoubleSide, depthWrite: false }));
  const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]].map(([a, b]) => new Vector3(wide * a, high * b, 0));
  const rim = new Line(new BufferGeometry().setFromPoints(corners), new LineBasicMaterial({ color }));
  const group = new Group();
  group.add(sheet, rim);
  group.matrixAutoUpdate = false;
  const at = centre.clone().addScaledVector(normal, plane.offset - centre.dot(normal));
  group.matrix.makeBasis(x, y, normal).setPosition(at);
  return group;
}

function label(stage, link) {
  const tag = document.createElement('span');
  tag.className = 'scene-label';
  tag.textContent = link.data.name;
  stage.view.append(tag);
  const top = new Vector3();
  if (link.mesh) {
    const box = new Box3().setFromBufferAttribute(link.mesh.geometry.getAttribute('position'));
    box.getCenter(top);
    const up = stage.up.clone().applyQuaternion(new Quaternion().setFromRotationMatrix(link.start).invert());
    const size = box.getSize(new Vector3()).multiplyScalar(0.5);
    top.addScaledVector(up, Math.abs(up.x) * size.x + Math.abs(up.y) * size.y + Math.abs(up.z) * size.z);
  }
  return { tag, top };
}

export function buildMarks(stage, data, links) {
  const coms = [];
  const planes = [];
  const labels = [];
  for (const link of links) {
    if (link.data.com) {
      const mark = centreOfMass(stage, link);
      link.group.add(mark);
      coms.push(mark);
    }
    if (link.mesh) {
      for (const plane of link.data.symmetry.slice(0, SHOWN)) {
        const mark = symmetryPlane(stage, link, plane);
        mark.visible = false;
        link.group.add(mark);
        planes.push(mark);
      }
    }
    labels.push({ link, ...label(stage, link) });
  }
  const at = new Vector3();
  stage.afterDraw = () => {
    const placed = [];
    for (const { link, tag, top } of labels) {
      at.copy(top).applyMatrix4(link.group.matrixWorld).project(stage.camera);
      const x = (0.5 + 0.5 * at.x) * stage.view.clientWidth;
      let y = (0.5 - 0.5 * at.y) * stage.view.clientHeight;
      // Names that would cover one another move up.
      const wide = tag.offsetWidth || 60;
      for (let i = 0; i < 6 && placed.some((p) => Math.abs(p.x - x) < (p.wide + wide) / 2 + 2 && Math.abs(p.y - y) < 19); i++) y -= 19;
      placed.push({ x, y, wide });
      tag.style.transform = `translate(-50%, -130%) translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
      tag.style.visibility = at.z < 1 ? 'visible' : 'hidden';
    }
  };
  return { coms, planes, labels };
}
