#!/usr/bin/env python3
"""judge_effects.py FOLDER: what MuJoCo feels of the effects that scene.xml holds, of the twins `tethered`, `leashed`, `grained` and
`stopped` that tests/exports.rs leaves there.

Cables and stops: the passive force a little and far beyond where they come taut, against the law. Friction along two directions:
the pull at which the block begins to slide along x and along y, against mass, gravity and the stated share."""
import json
import math
import os
import sys

import mujoco
import numpy as np


def load(folder, name):
    model = mujoco.MjModel.from_xml_path(os.path.join(folder, name, "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    twin = json.load(open(os.path.join(folder, name, "twin.json")))
    effect = {k: v["value"] for k, v in twin["effects"][0]["parameters"].items()}
    return model, data, effect


def pull(model, data, at):
    """What the cable does to the block at a place of the table, N."""
    data.qpos[:2] = at
    data.qvel[:] = 0
    mujoco.mj_forward(model, data)
    return data.qfrc_passive[:3].copy()


def cables(folder):
    off = []
    for name in ("tethered", "leashed"):
        model, data, e = load(folder, name)
        for at in ([0.05, 0.03], [0.2, -0.1], [-0.1, 0.15], [-0.3, 0.2]):
            if name == "tethered":
                want = -e["k"] * (np.array(at) - [e["px"], e["py"]])
            else:
                way = np.array([math.cos(e["direction"]), math.sin(e["direction"])])
                want = -e["k"] * max(way @ at - e["slack"], 0.0) * way
            off.append(np.linalg.norm(pull(model, data, at)[:2] - want))
    return max(off)


def stop(folder):
    model, data, e = load(folder, "stopped")
    dof = model.jnt_dofadr[[j for j in range(model.njnt) if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE][0]]
    place = model.jnt_qposadr[[j for j in range(model.njnt) if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE][0]]
    off = []
    for q in (0.0, 0.7, 0.85, 1.1):
        data.qpos[place] = q
        mujoco.mj_forward(model, data)
        off.append(abs(data.qfrc_passive[dof] + e["k"] * max(q - e["q_limit"], 0.0)))
    return max(off)


def begins(model, axis):
    """The pull at which the block begins to slide, N, by halving."""
    low, high = 0.0, 10.0
    while high - low > 0.01:
        force = 0.5 * (low + high)
        data = mujoco.MjData(model)
        block = model.body("block").id
        while data.time < 0.5:
            mujoco.mj_step(model, data)
        start = data.xpos[block].copy()
        while data.time < 1.5:
            # Through the table's plane, so that the pull does not tip the block.
            data.xfrc_applied[block, :3] = force * axis
            arm = np.array([0, 0, 0.0]) - [0, 0, data.xipos[block][2]]
            data.xfrc_applied[block, 3:] = np.cross(arm, force * axis)
            mujoco.mj_step(model, data)
        low, high = (low, force) if np.linalg.norm(data.xpos[block] - start) > 0.02 else (force, high)
    return 0.5 * (low + high)


def grain(folder):
    model, data, e = load(folder, "grained")
    mean = 0.4 * model.body_mass[model.body("block").id] * 9.80665
    want = [mean * (1 + e["ac"]), mean * (1 - e["ac"])]
    got = [begins(model, np.eye(3)[k]) for k in range(2)]
    print(f"friction along x and y: {got[0]:.2f} and {got[1]:.2f} N, stated {want[0]:.2f} and {want[1]:.2f} N")
    return max(abs(g / w - 1) for g, w in zip(got, want))


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = sys.argv[1]
    by_cable, by_stop, by_grain = cables(folder), stop(folder), grain(folder)
    print(f"cables off by {by_cable:.1e} N at most, the stop by {by_stop:.1e} N m, friction by {100 * by_grain:.1f} %")
    # A cable from far away turns a little as the block goes across.
    if by_cable > 0.03 or by_stop > 1e-9 or by_grain > 0.05:
        sys.exit("MuJoCo feels something else than the twin says")


main()
