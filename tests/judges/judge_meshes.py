#!/usr/bin/env python3
"""Has trimesh judge the meshes of twins.   judge_meshes.py TWIN_FOLDER...

Every link's mesh must be closed (watertight), wound the same way round, without repeated faces, without an edge of
other than two faces and without a vertex whose faces form more than one fan; it must hold volume. Every convex part
must be all that and convex, with at most 64 vertices. Prints a row a link, with the overlap (volume in both over
volume in either) of the parts with the mesh. Exit code 1 where a mesh fails, 3 where trimesh is missing.
"""
import json
import os
import sys

try:
    import numpy as np
    import trimesh
except ImportError as missing:
    print(f"not judged: {missing}")
    sys.exit(3)


def load(path):
    """Vertices and triangles as they stand in the file: nothing welded, nothing mended."""
    vertices, faces = [], []
    for line in open(path):
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(w) for w in words[1:4]])
        elif words[:1] == ["f"]:
            faces.append([int(w.split("/")[0]) - 1 for w in words[1:]])
    return trimesh.Trimesh(np.array(vertices), np.array(faces), process=False)


def faults(mesh):
    found = []
    if not mesh.is_watertight:
        found.append("not watertight")
    if not mesh.is_winding_consistent:
        found.append("winding differs")
    if mesh.volume <= 0:
        found.append("no volume")
    if len(np.unique(np.sort(mesh.faces, axis=1), axis=0)) != len(mesh.faces):
        found.append("repeated faces")
    _, count = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    if (count != 2).any():
        found.append(f"{(count != 2).sum()} edges without two faces")
    pinched = pinched_vertices(mesh)
    if pinched:
        found.append(f"{pinched} pinched vertices")
    return found


def pinched_vertices(mesh):
    """Vertices around which the faces form more than one fan."""
    onward = [{} for _ in mesh.vertices]
    for a, b, c in mesh.faces:
        onward[a][b], onward[b][c], onward[c][a] = c, a, b
    pinched = 0
    for fan in onward:
        if not fan:
            continue
        start = at = next(iter(fan))
        steps = 0
        while steps <= len(fan):
            at, steps = fan.get(at), steps + 1
            if at == start or at is None:
                break
        pinched += steps != len(fan)
    return pinched


def overlap(mesh, parts):
    points = np.random.default_rng(0).uniform(mesh.bounds[0], mesh.bounds[1], (20000, 3))
    whole = mesh.contains(points)
    covered = np.zeros(len(points), bool)
    for part in parts:
        normals, corners = part.face_normals, part.triangles[:, 0]
        covered |= (points @ normals.T <= (normals * corners).sum(axis=1) + 1e-12).all(axis=1)
    return (whole & covered).sum() / max((whole | covered).sum(), 1)


def main(folders):
    bad = 0
    for folder in folders:
        twin = json.load(open(os.path.join(folder, "twin.json")))
        for link in (l for b in twin["bodies"] for l in b["links"] if l.get("mesh")):
            mesh = load(os.path.join(folder, link["mesh"]))
            parts = [load(os.path.join(folder, p)) for p in link.get("collision", [])]
            found = faults(mesh)
            for path, part in zip(link.get("collision", []), parts):
                wrong = faults(part)
                if not trimesh.convex.is_convex(part) and part.volume < 0.999 * part.convex_hull.volume:
                    wrong.append("not convex")
                if len(part.vertices) > 64:
                    wrong.append(f"{len(part.vertices)} vertices")
                found += [f"{os.path.basename(path)}: {w}" for w in wrong]
            try:
                share = f"{overlap(mesh, parts):.3f}"
            except Exception as reason:  # rays need an optional package
                share = f"not measured ({reason})"
            print(f"{os.path.basename(folder.rstrip('/'))} {link['name']}: {len(mesh.faces)} triangles, "
                  f"{len(parts)} parts, overlap {share}: {'; '.join(found) or 'closed and manifold'}")
            bad += bool(found)
    return 1 if bad else 0


if __name__ == "__main__":
    if len(sys.argv) < 2:
        print(__doc__)
        sys.exit(2)
    sys.exit(main(sys.argv[1:]))
