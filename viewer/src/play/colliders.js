// Colliders for the convex parts of a twin, in the frame of their body; the same shapes as in src/export/colliders.rs.
// The engine knows a face by four of its corners at most, so that a thing on a face of many corners would stand on a sliver of
// it. Level faces are therefore also given as tetrahedra, whose faces have three.
import { Vector3 } from 'three';

/** Faces within this cosine of level count as feet and seats. */
const LEVEL = 0.9;
/** Tetrahedra smaller than this are slivers, m³. */
const SLIVER = 1e-12;

function levelFaces(mesh, points, up) {
  const middle = points.reduce((sum, p) => sum.add(p), new Vector3()).divideScalar(points.length);
  const found = [];
  for (let i = 0; i < mesh.indices.length; i += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => points[mesh.indices[i + k]]);
    const normal = b.clone().sub(a).cross(c.clone().sub(a));
    const volume = Math.abs(normal.dot(middle.clone().sub(a))) / 6;
    if (volume > SLIVER && Math.abs(normal.normalize().dot(up)) > LEVEL) found.push([a, b, c, middle]);
  }
  return found;
}

export function colliders(rapier, part, turn, up, meshes) {
  const { ColliderDesc, CoefficientCombineRule } = rapier;
  const origin = new Vector3(...part.origin);
  const hull = (points) => ColliderDesc.convexHull(Float32Array.from(points.flatMap((p) => [p.x, p.y, p.z])));
  const shapes = [];
  for (const mesh of meshes) {
    const points = [];
    for (let i = 0; i < mesh.positions.length; i += 3) {
      points.push(new Vector3().fromArray(mesh.positions, i).add(origin).applyQuaternion(turn));
    }
    shapes.push(hull(points), ...levelFaces(mesh, points, up).map(hull));
  }
  return shapes.filter(Boolean).map((shape) => shape.setDensity(0).setFriction(part.friction)
    .setFrictionCombineRule(CoefficientCombineRule.Max).setRestitution(0));
}
