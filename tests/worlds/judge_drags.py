#!/usr/bin/env python3
"""Errors and coverage of what hands tell that drag a box over the table, on clean worlds made with MuJoCo.

    python judge_drags.py PALPATE FOLDER [--first-seed N] [--count N] [--without-torque]

Makes captures of eight drags each in FOLDER (those that are there are kept): a box of random size, mass and friction, held at the
middle of its top by springs that lead it along; no mass is stated and nothing is lifted. Reconstructs each without its truth, and
prints mass and kinetic friction beside the truth, whether the intervals hold it, and false names. With --without-torque the files of
forces have no torques. Needs `mujoco` and `numpy`.
"""
import argparse
import json
import pathlib
import subprocess

import mujoco
import numpy as np

G = 9.80665
STEP = 0.00025  # s
FORCE_EVERY, TOOL_EVERY, TRACK_EVERY = 8, 20, 33  # 500, 200 and 121 Hz
FACES = [[1, 2, 4], [1, 4, 3], [5, 7, 8], [5, 8, 6], [1, 5, 6], [1, 6, 2], [3, 4, 8], [3, 8, 7], [1, 3, 7], [1, 7, 5], [2, 6, 8], [2, 8, 4]]


def product(a, b):
    """Product of two quaternions, scalar first."""
    out = np.zeros(4)
    mujoco.mju_mulQuat(out, a, b)
    return out


def world(mass, friction, half):
    """A box at rest on a plane."""
    contact = f'friction="{friction} 0.001 0.0001"'
    size = " ".join(str(x) for x in half)
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
<option timestep="{STEP}" gravity="0 0 -{G}" cone="elliptic" impratio="20" integrator="implicitfast" iterations="60" tolerance="1e-12"/>
<default><geom solref="0.003 1" solimp="0.95 0.99 0.0005" condim="4"/></default>
<worldbody><geom type="plane" size="3 3 .1" {contact}/>
<body pos="0 0 {half[2]}"><freejoint/><geom type="box" size="{size}" mass="{mass}" {contact}/></body></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    settle(model, data, 0.5)
    return model, data


def settle(model, data, seconds):
    data.xfrc_applied[:] = 0
    data.qvel[:] = 0
    for _ in range(int(seconds / STEP)):
        mujoco.mj_step(model, data)


def drag(model, data, rng, half, hand, noise):
    """One drag: forces, path of the hand and track, rows that begin with seconds since it began."""
    stiff, damp = hand
    heading, way, lasts = rng.uniform(0, 2 * np.pi), rng.uniform(0.12, 0.3), rng.uniform(0.35, 1.5)
    along, grip = np.array([np.cos(heading), np.sin(heading), 0.0]), np.array([0.0, 0.0, half[2]])
    start, upright = data.qpos[:3].copy(), data.qpos[3:7].copy()
    forces, path, track, turn = [], [], [], np.zeros(9)
    for i in range(int((lasts + 0.8) / STEP)):
        t = i * STEP
        u = np.clip((t - 0.3) / lasts, 0, 1)
        gone, speed = u**3 * (10 - 15 * u + 6 * u * u), 30 * u * u * (1 - u) ** 2 / lasts
        mujoco.mju_quat2Mat(turn, data.qpos[3:7])
        rotation = turn.reshape(3, 3)
        arm, spin = rotation @ grip, rotation @ data.qvel[3:6]
        held = data.qpos[:3] + arm
        force = stiff * (start + grip + along * way * gone - held)
        force += damp * (along * way * speed - data.qvel[:3] - np.cross(spin, arm))
        back, lean = np.zeros(4), np.zeros(3)
        mujoco.mju_negQuat(back, data.qpos[3:7])
        mujoco.mju_quat2Vel(lean, product(upright, back), 1.0)
        torque = 40 * lean - 0.5 * spin
        data.xfrc_applied[1, :3], data.xfrc_applied[1, 3:] = force, torque + np.cross(arm, force)
        if i % FORCE_EVERY == 0:
            forces.append([t, *(force + rng.normal(0, noise["force"], 3)), *(torque + rng.normal(0, noise["torque"], 3))])
        if i % TOOL_EVERY == 0:
            path.append([t, *(held + rng.normal(0, 5e-5, 3)), *data.qpos[4:7], data.qpos[3]])
        if i % TRACK_EVERY == 0:
            off = np.r_[1.0, rng.normal(0, noise["rotation"], 3) / 2]
            seen = product(off / np.linalg.norm(off), data.qpos[3:7])
            track.append([t, *(data.qpos[:3] + rng.normal(0, noise["position"], 3)), *seen[1:], seen[0]])
        mujoco.mj_step(model, data)
    settle(model, data, 0.25)
    return forces, path, track


def write(file, names, rows, since):
    lines = [",".join([f"{row[0] + since:.6f}"] + [f"{x:.8g}" for x in row[1:]]) for row in rows]
    file.write_text("\n".join([names, *lines]) + "\n")


def make(folder, seed, with_torque):
    """A capture folder with its answers beside it."""
    rng = np.random.default_rng(seed)
    mass, friction, half = rng.uniform(0.3, 1.5), rng.uniform(0.2, 0.5), rng.uniform(0.03, 0.06, 3)
    stiff = rng.uniform(1000, 4000)
    noise = dict(position=rng.uniform(5e-5, 3e-4), rotation=rng.uniform(5e-4, 3e-3), force=rng.uniform(0.02, 0.08))
    noise["torque"] = 0.05 * noise["force"]
    model, data = world(mass, friction, half)
    streams = folder / "streams"
    streams.mkdir(parents=True, exist_ok=True)
    corners = [(x, y, z) for x in (-half[0], half[0]) for y in (-half[1], half[1]) for z in (-half[2], half[2])]
    mesh = ["v %.6f %.6f %.6f" % c for c in corners] + ["f %d %d %d" % tuple(f) for f in FACES]
    (folder / "box.obj").write_text("\n".join(mesh) + "\n")
    interactions, since, pose = [], 0.0, "time,x,y,z,qx,qy,qz,qw"
    for k in range(8):
        hand = (stiff, 1.4 * np.sqrt(stiff * mass))
        forces, path, track = drag(model, data, rng, half, hand, noise)
        wrench = "time,fx,fy,fz,tx,ty,tz" if with_torque else "time,fx,fy,fz"
        write(streams / f"force-{k}.csv", wrench, forces if with_torque else [row[:4] for row in forces], since)
        write(streams / f"tool-{k}.csv", pose, path, since)
        write(streams / f"box-{k}.csv", pose, track, since)
        interactions.append(dict(name=f"pull-{k}", kind="pull", target="box", held_out=k == 7,
                                 tool=dict(shape="sphere", size=[0.01], grip=True),
                                 force=f"streams/force-{k}.csv", tool_path=f"streams/tool-{k}.csv",
                                 tracks={"box": f"streams/box-{k}.csv"}))
        since += forces[-1][0] + rng.uniform(1, 4)
    if not with_torque:
        del noise["torque"]
    capture = dict(format="palpate-capture/1", name=folder.name, support=dict(point=[0, 0, 0], normal=[0, 0, 1]),
                   bodies=[dict(name="box", mesh="box.obj")], noise=noise, interactions=interactions)
    (folder / "capture.json").write_text(json.dumps(capture, indent=1))
    (folder / "truth.json").write_text(json.dumps({"bodies": {"box": {"mass": mass, "friction_kinetic": friction}}}))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("palpate")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=12)
    parser.add_argument("--without-torque", action="store_true")
    arguments = parser.parse_args()
    held, told, names, errors = [0, 0], [0, 0], 0, []
    for seed in range(arguments.first_seed, arguments.first_seed + arguments.count):
        capture = arguments.folder / f"{'bare-' if arguments.without_torque else ''}drag-{seed}"
        if not (capture / "truth.json").exists():
            make(capture, seed, not arguments.without_torque)
        out = arguments.folder / f"{capture.name}.twin"
        subprocess.run([arguments.palpate, "-q", "reconstruct", str(capture), "--out", str(out)], check=True)
        truth = json.loads((capture / "truth.json").read_text())["bodies"]["box"]
        link = json.loads((out / "twin.json").read_text())["bodies"][0]["links"][0]
        diagnosis = json.loads((out / "diagnosis.json").read_text())
        words = []
        for k, (what, number) in enumerate([("mass", link.get("mass")), ("friction_kinetic", link["friction"].get("kinetic"))]):
            if number and number["status"] == "measured":
                low, high = number["ci95"]
                told[k] += 1
                held[k] += low <= truth[what] <= high
                if what == "mass":
                    errors.append(abs(number["value"] / truth[what] - 1))
                words.append(f"{what} {number['value']:.3f} [{low:.3f}, {high:.3f}] of {truth[what]:.3f}")
        causes = [finding["cause"] for finding in diagnosis["findings"]]
        names += bool(causes)
        print(capture.name, "; ".join(words), diagnosis["verdict"], causes, flush=True)
    print(f"masses told {told[0]} of {arguments.count}, held {held[0]}, error {100 * np.median(errors or [np.nan]):.1f} % at the median; "
          f"friction told {told[1]}, held {held[1]}; false names {names}")


if __name__ == "__main__":
    main()
