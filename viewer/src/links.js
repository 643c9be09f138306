// One group per link, with its mesh and its collision parts.
import {
  BufferAttribute, BufferGeometry, Color, EdgesGeometry, Group, LineBasicMaterial, LineSegments, Matrix4, Mesh,
  MeshStandardMaterial, Quaternion, Vector3,
} from 'three';
import { toCreasedNormals } from 'three/examples/jsm/utils/BufferGeometryUtils.js';

const CREASE = (38 * Math.PI) / 180;
const PARTS = [0x56b4e9, 0xe69f00, 0x009e73, 0xcc79a7, 0xf0e442, 0xd55e00, 0x0072b2];
const CLOSED = new Color(0xd55e00);
const MIRRORED = new Color(0x0072b2);

function surface(mesh, colored) {
  const plain = new BufferGeometry();
  plain.setAttribute('position', new BufferAttribute(mesh.positions, 3));
  plain.setIndex(new BufferAttribute(mesh.indices, 1));
  if (colored) {
    plain.setAttribute('color', new BufferAttribute(vertexColors(mesh, false), 3));
    plain.setAttribute('marked', new BufferAttribute(vertexColors(mesh, true), 3));
  }
  return toCreasedNormals(plain, CREASE);
}

function vertexColors(mesh, marked) {
  const out = new Float32Array(mesh.positions.length);
  const color = new Color();
  for (let i = 0; i < out.length / 3; i++) {
    if (mesh.colors) color.setRGB(mesh.colors[3 * i] / 255, mesh.colors[3 * i + 1] / 255, mesh.colors[3 * i + 2] / 255, 'srgb');
    else color.set(0xb9b4aa);
    if (marked && mesh.seen && !mesh.seen[i]) color.copy(mesh.mirrored?.[i] ? MIRRORED : CLOSED);
    else if (marked) color.lerp(new Color(0xbdbab3), 0.75);
    color.toArray(out, 3 * i);
  }
  return out;
}

function visual(link) {
  const geometry = surface(link.mesh, true);
  const material = new MeshStandardMaterial({ vertexColors: true, roughness: 0.82, metalness: 0 });
  const mesh = new Mesh(geometry, material);
  mesh.castShadow = true;
  mesh.receiveShadow = true;
  mesh.userData.colors = [geometry.getAttribute('color'), geometry.getAttribute('marked')];
  return mesh;
}

/** The convex parts, built when they are first shown. */
export function showParts(link, on) {
  if (on && !link.parts.children.length) fill(link.parts, link.data);
  link.parts.visible = on;
}

function fill(group, link) {
  link.parts.forEach((part, i) => {
    const geometry = surface(part, false);
    const color = PARTS[i % PARTS.length];
    const body = new Mesh(geometry, new MeshStandardMaterial({ color, roughness: 0.9, transparent: true, opacity: 0.55, depthWrite: false }));
    const edges = new LineSegments(new EdgesGeometry(geometry, 25), new LineBasicMaterial({ color, transparent: true, opacity: 0.9 }));
    group.add(body, edges);
  });
}

export function poseMatrix(p) {
  return new Matrix4().compose(new Vector3(p[0], p[1], p[2]), new Quaternion(p[3], p[4], p[5], p[6]), new Vector3(1, 1, 1));
}

export function buildLinks(stage, data) {
  return data.links.map((link) => {
    const group = new Group();
    group.matrixAutoUpdate = false;
    group.matrix.copy(poseMatrix(link.pose));
    const out = { data: link, group, mesh: null, parts: new Group(), start: group.matrix.clone() };
    if (link.mesh) {
      out.mesh = visual(link);
      group.add(out.mesh);
    }
    out.parts.visible = false;
    group.add(out.parts);
    stage.scene.add(group);
    return out;
  });
}
