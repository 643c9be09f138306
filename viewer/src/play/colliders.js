// Colliders for the convex parts of a twin, in the frame of their body; the same shapes as in src/export/colliders.rs.
// The engine knows a face by four of its corners at most, so that a thing on a face of many corners would stand on a sliver of
// it. Feet and seats are therefore also given as tetrahedra, whose faces have three.
import { Vector3 } from 'three';

/** Faces within this cosine of level count as feet and seats. */
const LEVEL = 0.9;
/** So far from the lowest or the highest point of a part, m, a face is foot or seat; faces between are left out, for speed. */
const MARGIN = 1e-3;
/** Tetrahedra smaller than this are slivers, m³. */
const SLIVER = 1e-12;

function levelFaces(mesh, points, up, [low, high]) {
  const middle = points.reduce((sum, p) => sum.add(p), new Vector3()).divideScalar(points.length);
  const found = [];
  for (let i = 0; i < mesh.indices.length; i += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => points[mesh.indices[i + k]]);
    const heights = [a, b, c].map((p) => p.dot(up));
    if (Math.max(...heights) > low + MARGIN && Math.min(...heights) < high - MARGIN) continue;
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
  const all = meshes.map((mesh) => {
    const points = [];
    for (let i = 0; i < mesh.positions.length; i += 3) {
      points.push(new Vector3().fromArray(mesh.positions, i).add(origin).applyQuaternion(turn));
    }
    return points;
  });
  const heights = all.flat().map((p) => p.dot(up));
  const ends = [Math.min(...heights), Math.max(...heights)];
  const shapes = meshes.flatMap((mesh, i) => [hull(all[i]), ...levelFaces(mesh, all[i], up, ends).map(hull)]);
  return shapes.filter(Boolean).map((shape) => shape.setDensity(0).setFriction(part.friction)
    .setFrictionCombineRule(CoefficientCombineRule.Max).setRestitution(0));
}
