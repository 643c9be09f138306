#!/usr/bin/env python3
"""How well textures come out.   judge_textures.py PALPATE [FOLDER]

Makes a capture of a box, a cylinder and a ball on a table, each printed through and through with coloured cells of 12 mm
(12 views of 320 x 240, noise of 1 mm at 1 m in depth and of 2 counts in colour, one thing partly before another), has it
reconstructed, and compares the colour of 20000 spots of each surface with the print, in the texture and at the mesh's
vertices. Counted are spots that a view sees at 70 degrees or less from straight on, and that are 1.5 mm or more from the
border of a cell, where a pixel shows both. A thing whose median is off by more than 6 of 255, or of whose spots more than
5 in 100 are off by more than 40, fails. Exit code 1 where one fails, 3 where numpy, trimesh or Pillow is missing.
"""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import numpy as np
    import trimesh
    from PIL import Image
except ImportError as missing:
    print(f"not judged: {missing}")
    sys.exit(3)

CELL = 0.012
# So that no face of a thing lies near the border of a cell.
SHIFT = np.array([0.5, 0.0, 0.8])
PALETTE = np.array([[210, 60, 50], [240, 220, 80], [40, 110, 190], [235, 235, 230], [60, 150, 80]], float)
CAMERA = dict(name="eye", width=320, height=240, fx=300.0, fy=300.0, cx=159.5, cy=119.5,
              depth_unit=0.0005, depth_min=0.1, depth_max=3.0, depth_sd=0.001)
#         kind        middle                  half size or radius, half height
THINGS = [("box", [0.0, 0.0, 0.04], [0.05, 0.03, 0.04]),
          ("cylinder", [0.09, 0.035, 0.045], [0.03, 0.045]),
          ("ball", [-0.03, 0.09, 0.035], [0.035])]


def cells(points):
    return np.floor(points / CELL + SHIFT).astype(int)


def printed(points):
    """The print at points of things: a colour for every cell of space."""
    i = cells(points)
    return PALETTE[(i[:, 0] * 7 + i[:, 1] * 3 + i[:, 2] * 11) % len(PALETTE)]


def to_border(points):
    """How far the nearest border of a cell is, m."""
    inside = (points / CELL + SHIFT) % 1.0
    return CELL * np.minimum(inside, 1 - inside).min(axis=1)


def hits(kind, middle, size, eye, rays):
    """Distance along each ray (of length 1 in depth) to a thing; infinity where it misses."""
    o = eye - np.array(middle)
    with np.errstate(divide="ignore", invalid="ignore"):
        if kind == "box":
            a, b = (-np.array(size) - o) / rays, (np.array(size) - o) / rays
            near, far = np.minimum(a, b).max(1), np.maximum(a, b).min(1)
            return np.where((near < far) & (near > 0), near, np.inf)
        if kind == "ball":
            a, b, c = (rays**2).sum(1), rays @ o, o @ o - size[0] ** 2
            root = b**2 - a * c
            return np.where(root > 0, (-b - np.sqrt(np.maximum(root, 0))) / a, np.inf)
        radius, half = size
        a, b, c = (rays[:, :2] ** 2).sum(1), rays[:, :2] @ o[:2], o[:2] @ o[:2] - radius**2
        root = b**2 - a * c
        side = np.where(root > 0, (-b - np.sqrt(np.maximum(root, 0))) / a, np.inf)
        side = np.where(np.abs(o[2] + side * rays[:, 2]) < half, side, np.inf)
        top = (half - o[2]) / rays[:, 2]
        at = o[:2] + top[:, None] * rays[:, :2]
        return np.minimum(side, np.where((top > 0) & ((at**2).sum(1) < radius**2), top, np.inf))


def shoot(eye, rotation, du=0.0, dv=0.0):
    c = CAMERA
    u, v = np.meshgrid(np.arange(c["width"]) + du, np.arange(c["height"]) + dv)
    rays = np.stack([(u - c["cx"]) / c["fx"], (v - c["cy"]) / c["fy"], np.ones_like(u)], -1).reshape(-1, 3) @ rotation.T
    with np.errstate(divide="ignore"):
        depth = np.where(rays[:, 2] < 0, -eye[2] / rays[:, 2], np.inf)
    thing = np.full(len(rays), -1)
    for k, (kind, middle, size) in enumerate(THINGS):
        t = hits(kind, middle, size, eye, rays)
        depth, thing = np.where(t < depth, t, depth), np.where(t < depth, k, thing)
    points = eye + np.where(thing >= 0, depth, 1.0)[:, None] * rays
    color = np.where((thing >= 0)[:, None], printed(points), [150.0, 130, 110])
    return depth, color


def take(folder):
    """Writes the capture."""
    rng = np.random.default_rng(1)
    (folder / "views").mkdir(parents=True)
    views, shape = [], (CAMERA["height"], CAMERA["width"])
    for i in range(12):
        around = 2 * np.pi * i / 12 + 0.2
        out, up = [(0.36, 0.18), (0.3, 0.33), (0.14, 0.42)][i % 3]
        eye = np.array([out * np.cos(around), out * np.sin(around), up])
        ahead = np.array([0.02, 0.03, 0.03]) - eye
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, [0, 0, 1.0])
        right /= np.linalg.norm(right)
        rotation = np.column_stack([right, np.cross(ahead, right), ahead])
        depth, _ = shoot(eye, rotation)
        shift = [-1 / 3, 0, 1 / 3]
        color = np.mean([shoot(eye, rotation, du, dv)[1] for du in shift for dv in shift], axis=0)
        far = np.where(depth < 3.0, depth, 0.0)
        noisy = far + rng.normal(0, 1, far.shape) * CAMERA["depth_sd"] * far**2
        counts = np.where(noisy > 0.1, np.round(noisy / CAMERA["depth_unit"]), 0).astype(np.uint16)
        Image.fromarray(counts.reshape(shape)).save(folder / f"views/{i:06d}.depth.png")
        seen = np.clip(color + rng.normal(0, 2, color.shape), 0, 255).round().astype(np.uint8)
        Image.fromarray(seen.reshape(*shape, 3)).save(folder / f"views/{i:06d}.color.png")
        quat = trimesh.transformations.quaternion_from_matrix(np.block([[rotation, np.zeros((3, 1))], [0, 0, 0, 1]]))
        views.append(dict(camera="eye", time=round(0.1 * i, 3), pose=[*eye, *quat[1:], quat[0]],
                          depth=f"views/{i:06d}.depth.png", color=f"views/{i:06d}.color.png"))
    document = dict(format="palpate-capture/1", name="printed", gravity=[0, 0, -9.81], cameras=[CAMERA], views=views,
                    support=dict(point=[0, 0, 0], normal=[0, 0, 1]), interactions=[])
    (folder / "capture.json").write_text(json.dumps(document))
    return [np.array(v["pose"][:3]) for v in views]


def in_view(points, normals, eyes):
    """Which spots some view sees, by the true things."""
    seen = np.zeros(len(points), bool)
    for eye in eyes:
        rays = points - eye
        facing = -(rays * normals).sum(1) / np.linalg.norm(rays, axis=1)
        first = np.min([hits(*thing, eye, rays) for thing in THINGS], axis=0)
        seen |= (facing > np.cos(np.radians(70))) & (np.abs(first - 1) < 0.01)
    return seen


def judge(folder, eyes):
    """Rows of what was found; the number of things that fail."""
    twin, bad = json.loads((folder / "twin.json").read_text()), 0
    for link in (l for b in twin["bodies"] for l in b["links"]):
        path = folder / link["mesh"]
        at, faces, places, corners, colors = [], [], [], [], []
        for line in path.read_text().splitlines():
            words = line.split()
            if words[0] == "v":
                at.append([float(w) for w in words[1:4]])
                colors.append([255 * float(w) for w in words[4:7]])
            elif words[0] == "vt":
                places.append([float(w) for w in words[1:3]])
            elif words[0] == "f":
                faces.append([int(w.split("/")[0]) - 1 for w in words[1:]])
                corners.append([int(w.split("/")[1]) - 1 for w in words[1:]])
        at, faces, places, corners, colors = map(np.array, (at, faces, places, corners, colors))
        image = np.array(Image.open(path.with_suffix(".png")).convert("RGB"), float)
        mesh = trimesh.Trimesh(at, faces, process=False)
        spots, which = trimesh.sample.sample_surface(mesh, 20000, seed=0)
        weights = trimesh.triangles.points_to_barycentric(mesh.triangles[which], spots)
        world = spots + np.array(link["pose"][:3])
        keep = in_view(world, mesh.face_normals[which], eyes) & (to_border(world) > 0.0015)
        x, y = ((places[corners[which]] * weights[..., None]).sum(1) * [1, -1] + [0, 1]).T
        height, width = image.shape[:2]
        px, py = x * width - 0.5, y * height - 0.5
        ix, iy = np.clip(np.floor(px), 0, width - 2).astype(int), np.clip(np.floor(py), 0, height - 2).astype(int)
        fx, fy = (px - ix)[:, None], (py - iy)[:, None]
        texture = ((image[iy, ix] * (1 - fx) + image[iy, ix + 1] * fx) * (1 - fy)
                   + (image[iy + 1, ix] * (1 - fx) + image[iy + 1, ix + 1] * fx) * fy)
        vertex = (colors[faces[which]] * weights[..., None]).sum(1)
        row = []
        for found in (texture, vertex):
            off = np.abs(found - printed(world)).max(axis=1)[keep]
            row += [np.median(off), (off > 40).mean()]
        fails = row[0] > 6 or row[1] > 0.05
        bad += fails
        size = path.with_suffix(".png").stat().st_size / 1e3
        print(f"{link['name']}: {len(faces)} triangles, texture {width} x {height}, {size:.0f} kB; {keep.sum()} seen spots: "
              f"median off by {row[0]:.1f} of 255, {100 * row[1]:.1f} % off by more than 40 (at vertices {row[2]:.1f}, "
              f"{100 * row[3]:.1f} %){': FAILS' if fails else ''}")
    return bad


def main(palpate, folder):
    eyes = take(folder / "capture")
    subprocess.run([palpate, "reconstruct", str(folder / "capture"), "--out", str(folder / "twin")], check=True,
                   stdout=subprocess.DEVNULL)
    return 1 if judge(folder / "twin", eyes) else 0


if __name__ == "__main__":
    if len(sys.argv) < 2:
        print(__doc__)
        sys.exit(2)
    if len(sys.argv) > 2:
        sys.exit(main(sys.argv[1], Path(sys.argv[2])))
    with tempfile.TemporaryDirectory() as place:
        sys.exit(main(sys.argv[1], Path(place)))
