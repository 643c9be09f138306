#!/usr/bin/env python3
"""Writes a small capture in the format palpate-capture/1 from plain arrays.

    python3 examples/write_capture.py OUT

Only numpy and the standard library are needed. Replace the made-up arrays below by your own recordings: what matters is
`write_capture` and the three helpers above it. The scene is one box of 0.5 kg on a table, seen by two views, pushed once
and lifted once; the format is explained in docs/capture-format.md.
"""

import json
import struct
import sys
import zlib
from pathlib import Path

import numpy as np

# --- helpers to copy into your own recorder -------------------------------------------------------------------------


def write_png(path, image):
    """Writes uint16 (height, width) as 16-bit greyscale, uint8 (height, width, 3) as 8-bit RGB."""
    image = np.asarray(image)
    if image.dtype == np.uint16 and image.ndim == 2:
        bits, colour_type = 16, 0
        rows = image.astype(">u2").view(np.uint8).reshape(image.shape[0], -1)
    elif image.dtype == np.uint8 and image.ndim == 3 and image.shape[2] == 3:
        bits, colour_type = 8, 2
        rows = image.reshape(image.shape[0], -1)
    else:
        raise ValueError(f"cannot write {image.dtype} of shape {image.shape}")
    height, width = image.shape[:2]
    filtered = np.hstack([np.zeros((height, 1), np.uint8), rows])  # every row begins with its filter, 0 = none

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, bits, colour_type, 0, 0, 0)
    body = zlib.compress(filtered.tobytes(), 6)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", body) + chunk(b"IEND", b""))


def write_csv(path, header, columns):
    """Writes columns side by side; NaN becomes an empty field, which is how a missing reading is written."""
    table = np.column_stack(columns)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w") as file:
        file.write(header + "\n")
        for row in table:
            file.write(",".join("" if np.isnan(x) else f"{x:.9g}" for x in row) + "\n")


FORCE = "time,fx,fy,fz,tx,ty,tz"  # what the tool exerts ON the body, at the tool's origin, world axes
POSE = "time,x,y,z,qx,qy,qz,qw"  # world-from-child, unit quaternion, scalar last


def write_capture(folder, capture, images, tables):
    """`images` and `tables` go under the paths by which `capture` names them; capture.json is written last."""
    for path, image in images.items():
        write_png(folder / path, image)
    for path, (header, columns) in tables.items():
        write_csv(folder / path, header, columns)
    (folder / "capture.json").write_text(json.dumps(capture, indent=1) + "\n")


# --- a made-up scene, in place of your robot ------------------------------------------------------------------------

HALF = np.array([0.05, 0.04, 0.03])  # half extents of the box, m
CENTRE = np.array([0.0, 0.0, 0.03])  # it stands on the plane z = 0
MASS, FRICTION, GRAVITY = 0.5, 0.35, 9.80665
WIDTH, HEIGHT, FOCAL = 160, 120, 150.0
DEPTH_UNIT = 0.001  # metres per count


def look_at(eye, target):
    """Rotation and quaternion (x y z w) of a camera at `eye`: z forward, x right, y down."""
    z = (target - eye) / np.linalg.norm(target - eye)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    rotation = np.column_stack([x, np.cross(z, x), z])
    # The eigenvector of Bar-Itzhack's matrix is the quaternion, whatever the rotation.
    r = rotation
    k = np.array([
        [r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
        [r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
        [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1], r[1, 0] - r[0, 1]],
        [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], r[0, 0] + r[1, 1] + r[2, 2]],
    ])
    _, vectors = np.linalg.eigh(k)
    return rotation, vectors[:, -1]


def render(eye, rotation):
    """Depth (m along the optical axis, 0 = nothing) and colour of box and table, ray by ray."""
    u, v = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    rays = np.stack([(u - (WIDTH - 1) / 2) / FOCAL, (v - (HEIGHT - 1) / 2) / FOCAL, np.ones_like(u, float)], axis=-1)
    rays = rays @ rotation.T  # scaled so that the ray's parameter is the depth
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (CENTRE - HALF - eye) / rays, (CENTRE + HALF - eye) / rays
        near, far = np.minimum(a, b).max(axis=-1), np.maximum(a, b).min(axis=-1)
        table = -eye[2] / rays[..., 2]
    on_box = (near <= far) & (near > 0)
    on_table = (table > 0) & (table < 2.0)
    depth = np.where(on_box, near, np.where(on_table, table, 0.0))
    colour = np.where(on_box[..., None], [200, 60, 40], np.where(on_table[..., None], [150, 120, 90], [0, 0, 0]))
    return np.round(depth / DEPTH_UNIT).astype(np.uint16), colour.astype(np.uint8)


def views():
    entries, images = [], {}
    for i, eye in enumerate(np.array([[0.35, -0.25, 0.3], [-0.3, 0.3, 0.35]])):
        rotation, quaternion = look_at(eye, CENTRE)
        depth, colour = render(eye, rotation)
        names = {"depth": f"views/{i:06d}.depth.png", "color": f"views/{i:06d}.color.png"}
        images[names["depth"]], images[names["color"]] = depth, colour
        entries.append({"camera": "wrist", "time": float(i), "pose": [*eye.tolist(), *quaternion.tolist()], **names})
    return entries, images


def poses(time, x, z, rng, noise):
    """Columns of a body or tool that moves along x and z without turning, with noise on the position."""
    zero = np.zeros_like(time)
    position = np.column_stack([x, zero, z]) + noise * rng.standard_normal((len(time), 3))
    return [time, *position.T, zero, zero, zero, np.ones_like(time)]


def push(rng):
    """Rest 0.5 s, approach, slide at 30 mm/s, back off, rest: force at 500 Hz, track at 100 Hz."""
    radius = 0.008
    rest = CENTRE[0] - HALF[0] - radius  # the tool's centre as it touches

    def tool(t):
        return rest - 0.015 + 0.03 * np.clip(t - 0.5, 0.0, 2.0) - 0.03 * np.clip(t - 2.7, 0.0, 0.3)

    def body(t):
        return np.clip(0.03 * (np.clip(t, 0.0, 2.5) - 1.0), 0.0, None)

    t, s = np.arange(0.0, 3.5, 0.002), np.arange(0.0, 3.5, 0.01)
    sliding = (t > 1.0) & (t < 2.5)
    force = 0.03 * rng.standard_normal((len(t), 3))
    force[:, 0] += np.where(sliding, FRICTION * MASS * GRAVITY, 0.0)
    torque = 0.001 * rng.standard_normal((len(t), 3))
    return {
        "interactions/push-00/force.csv": (FORCE, [t, *force.T, *torque.T]),
        "interactions/push-00/tool.csv": (POSE, poses(t, tool(t), CENTRE[2] + 0 * t, rng, 0.00005)),
        "interactions/push-00/track.box.csv": (POSE, poses(s, body(s), CENTRE[2] + 0 * s, rng, 0.0003)),
    }


def lift(rng):
    """Held from the first reading, raised by 60 mm, held: the force ends at the weight of the box."""
    t, s = np.arange(0.0, 3.0, 0.002), np.arange(0.0, 3.0, 0.01)

    def height(t):
        u = np.clip((t - 0.8) / 1.0, 0.0, 1.0)
        return 0.06 * u * u * (3 - 2 * u)

    force = 0.03 * rng.standard_normal((len(t), 3))
    force[:, 2] += MASS * GRAVITY * np.clip((t - 0.5) / 0.3, 0.0, 1.0)
    torque = 0.001 * rng.standard_normal((len(t), 3))
    top = CENTRE[2] + HALF[2]
    return {
        "interactions/lift-00/force.csv": (FORCE, [t, *force.T, *torque.T]),
        "interactions/lift-00/tool.csv": (POSE, poses(t, 0 * t, top + height(t), rng, 0.00005)),
        "interactions/lift-00/track.box.csv": (POSE, poses(s, 0 * s, CENTRE[2] + height(s), rng, 0.0003)),
    }


def interaction(name, kind, tool):
    base = f"interactions/{name}"
    return {
        "name": name,
        "kind": kind,
        "target": "box",
        "tool": tool,
        "force": f"{base}/force.csv",
        "tool_path": f"{base}/tool.csv",
        "tracks": {"box": f"{base}/track.box.csv"},
    }


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: write_capture.py OUT")
    folder = Path(sys.argv[1])
    if folder.exists():
        sys.exit(f"{folder}: there is something of that name already")
    rng = np.random.default_rng(0)
    entries, images = views()
    capture = {
        "format": "palpate-capture/1",
        "name": "python-box",
        "gravity": [0.0, 0.0, -GRAVITY],
        "support": {"point": [0.0, 0.0, 0.0], "normal": [0.0, 0.0, 1.0], "material": "wood"},
        "cameras": [{
            "name": "wrist", "width": WIDTH, "height": HEIGHT, "fx": FOCAL, "fy": FOCAL,
            "cx": (WIDTH - 1) / 2, "cy": (HEIGHT - 1) / 2,
            "depth_unit": DEPTH_UNIT, "depth_min": 0.1, "depth_max": 3.0,
        }],
        "views": entries,
        "interactions": [
            interaction("push-00", "push", {"shape": "sphere", "size": [0.008]}),
            interaction("lift-00", "lift", {"shape": "sphere", "size": [0.008], "grip": True}),
        ],
    }
    write_capture(folder, capture, images, {**push(rng), **lift(rng)})
    print(f"wrote {folder}")


if __name__ == "__main__":
    main()
