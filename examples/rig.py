#!/usr/bin/env python3
"""A rig for `palpate explore`: a simulated arm with a range camera and a finger, before a box and a cylinder.

    palpate explore --rig 'exec:python3 examples/rig.py' --out explored

It reads one JSON object a line and answers with one (docs/rig-protocol.md). Put your robot behind `describe`, `look` and
`touch`; the rest can stay. Only numpy and the standard library are needed. Nothing but answers may go to standard output.
"""

import base64
import json
import struct
import sys
import zlib

import numpy as np

GRAVITY = 9.80665
WIDTH, HEIGHT, FOCAL, UNIT = 160, 120, 150.0, 0.0005
# name, half size or (radius, half height), middle, kg, friction static and kinetic
BOX = {"name": "box", "half": np.array([0.035, 0.025, 0.03]), "at": np.array([-0.05, 0.0, 0.03]), "mass": 0.25}
CYLINDER = {"name": "can", "radius": 0.025, "half": 0.04, "at": np.array([0.055, 0.01, 0.04]), "mass": 0.4}
STATIC, KINETIC = 0.35, 0.30
NOISE = np.random.default_rng(1)
CLOCK = [0.0]


# --- the scene, as the camera sees it ----------------------------------------------------------------------------------


def meet_box(eye, rays):
    with np.errstate(divide="ignore", invalid="ignore"):
        a = (BOX["at"] - BOX["half"] - eye) / rays
        b = (BOX["at"] + BOX["half"] - eye) / rays
    near = np.nanmax(np.minimum(a, b), axis=-1)
    far = np.nanmin(np.maximum(a, b), axis=-1)
    return np.where((near < far) & (near > 0), near, np.inf)


def meet_cylinder(eye, rays):
    off = eye - CYLINDER["at"]
    a = rays[..., 0] ** 2 + rays[..., 1] ** 2
    b = off[0] * rays[..., 0] + off[1] * rays[..., 1]
    c = off[0] ** 2 + off[1] ** 2 - CYLINDER["radius"] ** 2
    root = b * b - a * c
    with np.errstate(divide="ignore", invalid="ignore"):
        side = (-b - np.sqrt(np.where(root > 0, root, np.nan))) / a
        side = np.where(np.abs(off[2] + side * rays[..., 2]) <= CYLINDER["half"], side, np.inf)
        top = (CYLINDER["half"] - off[2]) / rays[..., 2]
    x, y = off[0] + top * rays[..., 0], off[1] + top * rays[..., 1]
    top = np.where((top > 0) & (x * x + y * y <= CYLINDER["radius"] ** 2), top, np.inf)
    return np.minimum(np.where(np.isfinite(side) & (side > 0), side, np.inf), top)


def render(pose):
    """Depth in counts and colours, seen from the world-from-camera pose x y z qx qy qz qw."""
    x, y, z, w = pose[3:]
    turn = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
    rays = np.stack([(u - (WIDTH - 1) / 2) / FOCAL, (v - (HEIGHT - 1) / 2) / FOCAL, np.ones(u.shape)], -1) @ turn.T
    eye = np.array(pose[:3])
    with np.errstate(divide="ignore"):
        table = np.where(rays[..., 2] < 0, -eye[2] / rays[..., 2], np.inf)
    hits = np.stack([table, meet_box(eye, rays), meet_cylinder(eye, rays)])
    depth, who = hits.min(0), hits.argmin(0)
    depth = depth + NOISE.normal(size=depth.shape) * 0.001 * np.minimum(depth, 2.0) ** 2
    counts = np.where(np.isfinite(depth) & (depth < 1.5), depth / UNIT, 0).round().astype(np.uint16)
    colors = np.array([[188, 150, 108], [200, 90, 70], [70, 120, 190]], np.uint8)[who]
    return counts, colors


def png(image):
    grey = image.ndim == 2
    rows = image.astype(">u2").view(np.uint8).reshape(image.shape[0], -1) if grey else image.reshape(image.shape[0], -1)
    filtered = np.hstack([np.zeros((image.shape[0], 1), np.uint8), rows])

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", image.shape[1], image.shape[0], 16 if grey else 8, 0 if grey else 2, 0, 0, 0)
    body = zlib.compress(filtered.tobytes(), 6)
    data = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", body) + chunk(b"IEND", b"")
    return base64.b64encode(data).decode()


# --- the answers -------------------------------------------------------------------------------------------------------


def describe(_):
    camera = {"name": "wrist", "width": WIDTH, "height": HEIGHT, "fx": FOCAL, "fy": FOCAL, "cx": (WIDTH - 1) / 2,
              "cy": (HEIGHT - 1) / 2, "depth_unit": UNIT, "depth_min": 0.1, "depth_max": 1.5, "depth_sd": 0.001}
    return {
        "protocol": "palpate-rig/1",
        "name": "box-and-can",
        "support": {"point": [0, 0, 0], "normal": [0, 0, 1]},
        "cameras": [camera],
        "reach": {"dome": {"target": [0, 0, 0.04], "radius": [0.32, 0.42], "elevation": [15, 80]}},
        "workspace": {"low": [-0.15, -0.1, -0.01], "high": [0.15, 0.1, 0.13]},
        "touches": ["lift", "push"],
        "restores": True,
        "bodies": [{"name": b["name"], "pose": [*b["at"].tolist(), 0, 0, 0, 1]} for b in (BOX, CYLINDER)],
    }


def look(ask):
    counts, colors = render(ask["pose"])
    CLOCK[0] += 0.5
    return {"time": CLOCK[0], "pose": ask["pose"], "depth_png": png(counts), "color_png": png(colors)}


def course(ask, body):
    """Times, travel of the tool and force on the body: rest, a smooth way, rest. Quasi-static, with Coulomb friction."""
    time = np.arange(0.0, 1.0 + ask["travel"] / ask["speed"] + ask["duration"], 0.01)
    way = np.clip((time - 0.5) * ask["speed"], 0.0, ask["travel"])
    weight = body["mass"] * GRAVITY
    if ask["kind"] == "lift":
        force = np.where(way > 0, weight, 0.0)
        back = time[-1] + np.arange(1, len(time) + 1) * 0.01
        time, way, force = np.r_[time, back], np.r_[way, way[::-1]], np.r_[force, force[::-1]]
        return time, way, force, way
    gap = 0.005  # the finger starts so far off
    moved = np.maximum(way - gap, 0.0)
    first = np.flatnonzero(moved > 0)
    force = np.where((moved > 0) & (way < ask["travel"]), KINETIC * weight, 0.0)
    if len(first) > 3:
        force[first[0] - 3:first[0] + 1] = STATIC * weight * np.array([0.25, 0.5, 0.75, 1.0])
    return time, way - gap, force, moved


def touch(ask):
    body = next((b for b in (BOX, CYLINDER) if b["name"] == ask["target"]), None)
    if body is None or ask["kind"] not in ("lift", "push"):
        return {"refused": f"no {ask['kind']} of {ask['target']} here"}
    time, way, force, moved = course(ask, body)
    direction, start, radius = np.array(ask["direction"]), np.array(ask["start"]), 0.008
    lift = ask["kind"] == "lift"
    if not lift:  # the finger's centre is one radius behind the true face, level with the height that was asked for
        edge = abs(direction[:2]) @ body["half"][:2] if body is BOX else body["radius"]
        if body is BOX and max(abs(direction[:2])) < 0.99:
            return {"refused": "the finger pushes square to a face only"}
        start = np.array([*body["at"][:2], start[2]]) - direction * (edge + radius)
    begin = CLOCK[0] + 0.5
    stamp = (begin + time)[:, None]
    CLOCK[0] = float(stamp[-1, 0])
    level = np.tile([0.0, 0.0, 0.0, 1.0], (len(time), 1))
    tool = start + way[:, None] * direction
    forces = force[:, None] * direction + NOISE.normal(size=(len(time), 3)) * 0.02
    torque = np.zeros((len(time), 3))
    track = body["at"] + moved[:, None] * direction + NOISE.normal(size=(len(time), 3)) * 2e-4
    rows = lambda *columns: np.hstack([stamp, *columns]).round(9).tolist()
    return {
        "tool": {"shape": "sphere", "size": [radius], "grip": lift},
        "force": rows(forces, torque),
        "tool_path": rows(tool, level),
        "tracks": {body["name"]: rows(track, level)},
    }


def main():
    answers = {"describe": describe, "look": look, "touch": touch, "done": lambda _: {"done": True}}
    for line in sys.stdin:
        ask = json.loads(line)
        print(json.dumps(answers[ask["ask"]](ask)), flush=True)
        if ask["ask"] == "done":
            break


if __name__ == "__main__":
    main()
