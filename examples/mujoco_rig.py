#!/usr/bin/env python3
"""A rig for `palpate explore` with MuJoCo as the world: what is touched stays where it was pushed.

    pip install mujoco numpy
    palpate explore --rig 'exec:python3 examples/mujoco_rig.py' --out explored

A weighted box and a can on a table; a range camera that casts rays; a finger on springs that feels what it pushes, and a
gripper that feels force and torque. It answers `describe`, `look` and `touch` of docs/rig-protocol.md, one JSON object a
line. Nothing but answers may go to standard output.
"""

import base64
import json
import struct
import sys
import zlib

import mujoco
import numpy as np

WIDTH, HEIGHT, FOCAL, UNIT = 160, 120, 150.0, 0.0005
STEP, EVERY = 0.0005, 10  # s of a step, steps of a reading
TIP = 0.008  # m
NOISE = {"force": 0.03, "torque": 0.002, "position": 2e-4, "rotation": 2e-3}
DICE = np.random.default_rng(3)
THINGS = ("box", "can")
SCENE = f"""<mujoco>
<option timestep="{STEP}" gravity="0 0 -9.80665" cone="elliptic" impratio="20" integrator="implicitfast"/>
<default><geom solref="0.004 1" condim="4" friction="0.3 0.0001 0"/></default>
<worldbody>
 <geom name="table" type="plane" size="2 2 0.1" rgba="0.74 0.59 0.42 1" friction="0.05 0.0001 0"/>
 <body name="box" pos="-0.07 0 0.03"><freejoint/>
  <geom type="box" size="0.04 0.03 0.03" mass="0.25" rgba="0.8 0.35 0.28 1"/>
  <geom type="sphere" size="0.004" pos="0.015 -0.008 0" mass="0.10" contype="0" conaffinity="0" group="4"/></body>
 <body name="can" pos="0.09 0.02 0.035"><freejoint/>
  <geom type="cylinder" size="0.028 0.035" mass="0.4" rgba="0.28 0.48 0.75 1" friction="0.25 0.0001 0"/></body>
 <body name="tip" gravcomp="1">
  <joint type="slide" axis="1 0 0" stiffness="3000" damping="12"/><joint type="slide" axis="0 1 0" stiffness="3000"
  damping="12"/><joint type="slide" axis="0 0 1" stiffness="3000" damping="12"/>
  <geom name="tip" type="sphere" size="{TIP}" mass="0.02" friction="0.1 0.0001 0" group="4"/></body>
</worldbody></mujoco>"""
MODEL = mujoco.MjModel.from_xml_string(SCENE)
DATA = mujoco.MjData(MODEL)
# The finger hangs on springs whose rest follows its way; what moves as a mocap body has no velocity in contacts.
MODEL.qpos_spring[-3:] = DATA.qpos[-3:] = [0, 0, 1]
TIP_GEOM, TIP_BODY = MODEL.geom("tip").id, MODEL.body("tip").id
SEEN = np.array([1, 1, 1, 1, 0, 0], np.uint8)  # groups that the camera sees


def matrix(quat):
    """Rotation matrix of a quaternion, scalar first."""
    out = np.zeros(9)
    mujoco.mju_quat2Mat(out, np.asarray(quat, float))
    return out.reshape(3, 3)


def png(image):
    deep = image.ndim == 2
    rows = image.astype(">u2").view(np.uint8) if deep else image
    rows = rows.reshape(image.shape[0], -1)
    lines = np.hstack([np.zeros((len(rows), 1), np.uint8), rows]).tobytes()

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", image.shape[1], image.shape[0], 16 if deep else 8, 0 if deep else 2, 0, 0, 0)
    png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b"")
    return base64.b64encode(png).decode()


def describe(_):
    camera = {"name": "wrist", "width": WIDTH, "height": HEIGHT, "fx": FOCAL, "fy": FOCAL, "cx": (WIDTH - 1) / 2,
              "cy": (HEIGHT - 1) / 2, "depth_unit": UNIT, "depth_min": 0.1, "depth_max": 1.5, "depth_sd": 0.001}
    return {
        "protocol": "palpate-rig/1",
        "name": "mujoco-table",
        "support": {"point": [0, 0, 0], "normal": [0, 0, 1]},
        "cameras": [camera],
        "reach": {"dome": {"target": [0, 0, 0.03], "radius": [0.32, 0.42], "elevation": [15, 80]}},
        "workspace": {"low": [-0.16, -0.1, -0.01], "high": [0.16, 0.12, 0.12]},
        "touches": ["lift", "push"],
        "bodies": [{"name": name, "pose": pose_of(name, 0.0)} for name in THINGS],
        "noise": NOISE,
    }


def look(ask):
    x, y, z, *turn = ask["pose"]
    world = matrix([turn[3], *turn[:3]])
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
    rays = np.stack([(u - (WIDTH - 1) / 2) / FOCAL, (v - (HEIGHT - 1) / 2) / FOCAL, np.ones(u.shape)], -1).reshape(-1, 3)
    eye, hit = np.array([x, y, z]), np.zeros(1, np.int32)
    depth, color = np.zeros(len(rays)), np.zeros((len(rays), 3), np.uint8)
    for i, ray in enumerate(rays @ world.T):
        length = np.linalg.norm(ray)
        far = mujoco.mj_ray(MODEL, DATA, eye, ray / length, SEEN, 1, -1, hit)
        if far > 0:
            depth[i] = far / length
            color[i] = 255 * MODEL.geom_rgba[hit[0], :3]
    depth += np.where(depth > 0, DICE.normal(size=len(depth)) * 0.001 * depth**2, 0.0)
    counts = np.where(depth < 1.5, depth / UNIT, 0).round().astype(np.uint16).reshape(HEIGHT, WIDTH)
    return {"time": DATA.time, "pose": ask["pose"], "depth_png": png(counts),
            "color_png": png(color.reshape(HEIGHT, WIDTH, 3))}


def pose_of(name, noise=1.0):
    """A reading of a body's pose, `x y z qx qy qz qw`."""
    body = DATA.body(name)
    wobble = DICE.normal(0, NOISE["rotation"] * noise, 3)
    small, quat = np.r_[1.0, wobble / 2], np.zeros(4)
    mujoco.mju_mulQuat(quat, small / np.linalg.norm(small), body.xquat)
    place = body.xpos + DICE.normal(0, NOISE["position"] * noise, 3)
    return [*place.tolist(), *quat[1:].tolist(), float(quat[0])]


def felt():
    """What the finger exerts on whatever it touches, world axes."""
    total, wrench = np.zeros(3), np.zeros(6)
    for i in range(DATA.ncon):
        contact = DATA.contact[i]
        if TIP_GEOM in (contact.geom1, contact.geom2):
            mujoco.mj_contactForce(MODEL, DATA, i, wrench)
            force = contact.frame.reshape(3, 3).T @ wrench[:3]
            total += force if contact.geom1 == TIP_GEOM else -force
    return total


def run(seconds, drive, sense):
    """Steps the world under `drive(t)`; `sense()` gives the wrench on the body and where the tool is."""
    rows = {"force": [], "tool_path": [], "tracks": {name: [] for name in THINGS}}
    start, held = DATA.time, []
    for i in range(round(seconds / STEP)):
        drive(DATA.time - start)
        mujoco.mj_step(MODEL, DATA)
        held.append(sense()[0])
        if i % EVERY:
            continue
        noise = np.r_[DICE.normal(0, NOISE["force"], 3), DICE.normal(0, NOISE["torque"], 3)]
        rows["force"].append([DATA.time, *(np.mean(held, 0) + noise).tolist()])
        rows["tool_path"].append([DATA.time, *sense()[1].tolist(), 0, 0, 0, 1])
        for name in THINGS:
            rows["tracks"][name].append([DATA.time, *pose_of(name)])
        held = []
    return rows


def push(ask):
    way, start = np.array(ask["direction"]), np.array(ask["start"])
    back = start - way * (TIP + 0.006)
    end = start + way * (ask["travel"] - TIP)
    go = 0.4 + np.linalg.norm(end - back) / ask["speed"]
    times = [0.0, 0.4, go, go + 0.1, go + 0.3, go + 0.8]
    places = np.array([back, back, end, end, end - 0.02 * way, end - 0.02 * way])

    def drive(t):
        MODEL.qpos_spring[-3:] = [np.interp(t, times, places[:, k]) for k in range(3)]

    # The finger comes down from above, clear of everything.
    MODEL.qpos_spring[-3:], DATA.qpos[-3:], DATA.qvel[-3:] = back, back, 0.0
    mujoco.mj_forward(MODEL, DATA)
    rows = run(times[-1], drive, lambda: (np.r_[felt(), 0, 0, 0], DATA.xpos[TIP_BODY].copy()))
    MODEL.qpos_spring[-3:], DATA.qpos[-3:], DATA.qvel[-3:] = [0, 0, 1], [0, 0, 1], 0.0
    rows["force"] = [row[:4] for row in rows["force"]]
    return {"tool": {"shape": "sphere", "size": [TIP]}, **rows}


def lift(ask):
    body = MODEL.body(ask["target"]).id
    point = matrix(DATA.xquat[body]).T @ (np.array(ask["start"]) - DATA.xpos[body])
    start, upright = np.array(ask["start"]), DATA.xquat[body].copy()
    up = ask["travel"] / ask["speed"]
    times = [0.4, 0.4 + up, 0.4 + up + ask["duration"], 0.6 + 2 * up + ask["duration"]]
    mass, wrench = MODEL.body_subtreemass[body], np.zeros(6)

    def place():
        return DATA.xpos[body] + matrix(DATA.xquat[body]) @ point

    def drive(t):
        wrench[:] = 0
        if times[0] <= t <= times[-1]:
            goal = start + np.array([0, 0, np.interp(t, times, [0, ask["travel"], ask["travel"], 0])])
            spin, turn, off = np.zeros(6), np.zeros(4), np.zeros(3)
            mujoco.mj_objectVelocity(MODEL, DATA, mujoco.mjtObj.mjOBJ_XBODY, body, spin, 0)
            speed = spin[3:] + np.cross(spin[:3], place() - DATA.xpos[body])
            wrench[:3] = 4000 * (goal - place()) - 2 * np.sqrt(4000 * mass) * speed
            mujoco.mju_negQuat(turn, DATA.xquat[body])
            whole = np.zeros(4)
            mujoco.mju_mulQuat(whole, upright, turn)
            mujoco.mju_quat2Vel(off, whole, 1.0)
            wrench[3:] = 4 * off - 0.1 * spin[:3]
        DATA.xfrc_applied[body, :3] = wrench[:3]
        DATA.xfrc_applied[body, 3:] = wrench[3:] + np.cross(place() - DATA.xipos[body], wrench[:3])

    rows = run(times[-1] + 0.5, drive, lambda: (wrench.copy(), place()))
    DATA.xfrc_applied[body] = 0
    return {"tool": {"shape": "sphere", "size": [TIP], "grip": True}, **rows}


def touch(ask):
    if ask["target"] not in THINGS or ask["kind"] not in ("lift", "push"):
        return {"refused": f"no {ask['kind']} of {ask['target']} here"}
    return lift(ask) if ask["kind"] == "lift" else push(ask)


def main():
    mujoco.mj_forward(MODEL, DATA)
    for _ in range(800):
        mujoco.mj_step(MODEL, DATA)
    answers = {"describe": describe, "look": look, "touch": touch, "done": lambda _: {"done": True}}
    for line in sys.stdin:
        ask = json.loads(line)
        print(json.dumps(answers[ask["ask"]](ask)), flush=True)
        if ask["ask"] == "done":
            break


if __name__ == "__main__":
    main()
