#!/usr/bin/env python3
"""Mass and friction of a box from one driven motion, beside mujoco.sysid on the same data.

    python beside_sysid.py PALPATE FOLDER [RUNS]

Needs `mujoco[sysid]` (the extra, without which `mujoco.sysid` is an empty shell) and numpy. MuJoCo drives a box of 0.3 kg and friction 0.4 along a table by a force that changes its
sign; both are given the force and the noisy motion (1 mm, 1 sd). mujoco.sysid starts from masses of 0.3 to 2 kg and
frictions of 0.1 to 0.9 drawn at random, palpate starts by itself. Prints how often each comes within 5 % of both truths,
how often the stated 95 % intervals hold them, and the CPU seconds of each, the start of the process counted.
"""
import contextlib
import io
import json
import logging
import pathlib
import resource
import subprocess
import sys
import time

import mujoco
import numpy as np

MASS, FRICTION, SECONDS, NOISE, STEP = 0.3, 0.4, 2.0, 1e-3, 0.002
BOX = f"""<mujoco><option timestep="{STEP}" cone="elliptic" integrator="implicitfast"/><worldbody>
<geom type="plane" size="5 5 .1" friction="1 .005 .0001"/><body name="box" pos="0 0 .03"><joint name="x" type="slide"
axis="1 0 0"/><joint name="z" type="slide" axis="0 0 1"/><geom name="g" type="box" size=".05 .04 .03" mass="{MASS}"
priority="1" friction="{FRICTION} .005 .0001"/></body></worldbody><actuator><motor name="u" joint="x"/></actuator>
<sensor><jointpos name="q" joint="x"/><jointvel name="v" joint="x"/></sensor></mujoco>"""


def drive(t):
    return 3.0 * np.sign(np.sin(2 * np.pi * 0.9 * t)) * (0.4 + 0.6 * (t % 1.7) / 1.7)


def record(folder, time_, force, place, dice):
    """A pull of the box at its middle, in the capture format: rest, the motion, rest."""
    (folder / "interactions").mkdir(parents=True, exist_ok=True)
    rest = np.arange(-0.4, 0.0, STEP)
    t = np.r_[rest, time_] - rest[0]
    f = np.r_[np.zeros(len(rest)), force]
    x = np.r_[np.full(len(rest), place[0]), place]
    rows = lambda *columns: "\n".join(",".join(f"{v:.9g}" for v in row) for row in zip(*columns))  # noqa: E731
    zero, one, seen = np.zeros(len(t)), np.ones(len(t)), slice(None, None, 4)
    noisy, aside, up = x + dice.normal(0, NOISE, len(x)), *dice.normal(0, NOISE, (2, len(x)))
    (folder / "interactions/force.csv").write_text("time,fx,fy,fz\n" + rows(t + STEP / 2, f, zero, zero) + "\n")
    (folder / "interactions/tool.csv").write_text(
        "time,x,y,z,qx,qy,qz,qw\n" + rows(t, x, zero, 0.03 * one, zero, zero, zero, one) + "\n")
    (folder / "interactions/box.csv").write_text(
        "time,x,y,z,qx,qy,qz,qw\n" + rows(t[seen], noisy[seen], aside[seen], 0.03 + up[seen], zero[seen], zero[seen],
                                          zero[seen], one[seen]) + "\n")
    corners = [(sx * 0.05, sy * 0.04, sz * 0.03) for sz in (-1, 1) for sy in (-1, 1) for sx in (-1, 1)]
    faces = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)]
    text = "".join("v %g %g %g\n" % c for c in corners)
    text += "".join(f"f {a} {b} {c}\nf {a} {c} {d}\n" for a, b, c, d in faces)
    (folder / "box.obj").write_text(text)
    pull = {"name": "drive", "kind": "pull", "target": "box", "tool": {"shape": "sphere", "size": [0.005], "pin": True},
            "force": "interactions/force.csv", "tool_path": "interactions/tool.csv",
            "tracks": {"box": "interactions/box.csv"}}
    capture = {"format": "palpate-capture/1", "name": "driven-box", "support": {"point": [0, 0, 0], "normal": [0, 0, 1]},
               "bodies": [{"name": "box", "mesh": "box.obj", "pose": [0, 0, 0.03, 0, 0, 0, 1]}],
               "interactions": [pull]}
    (folder / "capture.json").write_text(json.dumps(capture, indent=1))


def by_palpate(palpate, folder):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    out = folder / "twin"
    # The estimation alone, as the other does: no diagnosis, no exports, no report.
    passes = ["--pass", "shape", "--pass", "physics"]
    subprocess.run([palpate, "reconstruct", str(folder), "--out", str(out), "-q", *passes], check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    link = json.loads((out / "twin.json").read_text())["bodies"][0]["links"][0]
    found = []
    for estimate in (link.get("mass"), link.get("friction", {}).get("kinetic")):
        measured = estimate is not None and estimate["status"] == "measured"
        found.append((estimate["value"], estimate["ci95"]) if measured else (np.nan, [np.nan, np.nan]))
    return found, cpu


def by_sysid(spec, model, x0, sequence, start):
    from mujoco import sysid
    parameters = sysid.ParameterDict()
    mass = sysid.Parameter("mass", nominal=MASS, min_value=0.02, max_value=3.0,
                           modifier=lambda s, p: setattr(s.geom("g"), "mass", float(p.value[0])))
    friction = sysid.Parameter("friction", nominal=FRICTION, min_value=0.01, max_value=2.0,
                               modifier=lambda s, p: s.geom("g").friction.__setitem__(0, float(p.value[0])))
    parameters.add(mass)
    parameters.add(friction)
    parameters["mass"].value[:], parameters["friction"].value[:] = start
    began = time.process_time()
    residual = sysid.build_residual_fn(models_sequences=[sysid.ModelSequences("box", spec, "meas", x0, *sequence)])
    with contextlib.redirect_stdout(io.StringIO()):
        best, _ = sysid.optimize(initial_params=parameters, residual_fn=residual, optimizer="mujoco", verbose=False)
    return [float(best[name].value[0]) for name in ("mass", "friction")], time.process_time() - began


def whole_sysid():
    """Ends with what is missing where `mujoco.sysid` was installed without its extra: it swallows the import that failed and
    comes up empty."""
    try:
        from mujoco import sysid
        from mujoco.sysid._src import trajectory  # noqa: F401
    except ImportError as missing:
        sys.exit(f"mujoco {mujoco.__version__} has no working sysid ({missing}): pip install 'mujoco[sysid]'")
    wanted = ("ModelSequences", "Parameter", "ParameterDict", "TimeSeries", "build_residual_fn", "optimize")
    absent = [name for name in wanted if not hasattr(sysid, name)]
    if absent:
        sys.exit(f"mujoco {mujoco.__version__}: mujoco.sysid lacks {absent}; `pip install 'mujoco[sysid]'`, or its interface "
                 "has changed")


def state_of(model, data):
    """The whole state as a vector, by MuJoCo's own call: what sysid offered for it has not been there in every version."""
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS.value
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    return state


def main():
    whole_sysid()
    from mujoco import rollout, sysid
    logging.disable(logging.CRITICAL)
    palpate, folder, runs = sys.argv[1], pathlib.Path(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 30
    spec = mujoco.MjSpec.from_string(BOX)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    t = np.arange(int(SECONDS / STEP)) * STEP
    control = drive(t)[:, None]
    x0 = state_of(model, data)
    states, sensed = (v[0] for v in rollout.rollout(model, data, x0, control[:-1]))
    truth, close = (MASS, FRICTION), lambda found: all(abs(a / b - 1) < 0.05 for a, b in zip(found, (MASS, FRICTION)))
    ours, theirs, held, cpu = 0, 0, 0, np.zeros(2)
    for run in range(runs):
        dice = np.random.default_rng(run)
        place = folder / f"run-{run}"
        # A state is that after its step, a force acts over its step.
        record(place, t[:-1], control[:-1, 0], np.r_[0.0, states[:-1, 1]], dice)
        found, seconds = by_palpate(palpate, place)
        ours += close([f[0] for f in found])
        held += sum(f[1][0] <= v <= f[1][1] for f, v in zip(found, truth))
        cpu[0] += seconds
        noisy = sensed + dice.normal(0, NOISE, sensed.shape)
        sequence = (sysid.TimeSeries(t, control), sysid.TimeSeries.from_names(states[:, 0], noisy, model))
        start = (dice.uniform(0.3, 2.0), dice.uniform(0.1, 0.9))
        best, seconds = by_sysid(spec, model, x0, sequence, start)
        theirs += close(best)
        cpu[1] += seconds
        print(f"run {run}: palpate {[round(float(f[0]), 4) for f in found]}, sysid from {np.round(start, 2)}: "
              f"{np.round(best, 4)}", flush=True)
    print(f"within 5 % of both truths: palpate {ours} of {runs}, mujoco.sysid {theirs} of {runs}")
    print(f"stated intervals that hold: palpate {held} of {2 * runs}")
    print(f"CPU s a run: palpate {cpu[0] / runs:.3f}, mujoco.sysid {cpu[1] / runs:.3f}, ratio {cpu[0] / cpu[1]:.2f}")


if __name__ == "__main__":
    main()
