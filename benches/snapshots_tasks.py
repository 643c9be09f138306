#!/usr/bin/env python3
"""Tasks that MuJoCo answers, for benches/snapshots.rs: prints one JSON object.

    python snapshots_tasks.py N SEED     N tasks of 24 trials: shape, tool, path, coefficients, and where MuJoCo has the thing end
    python snapshots_tasks.py itself K SEED  how MuJoCo answers task K of SEED with finer steps and harder contacts: what it does not agree
                                         on with itself, nobody can foretell
    python snapshots_tasks.py peer DIR   one evaluation of 500 trials of 2 s by the peer's own library in DIR, with PyBullet
"""
import json
import pathlib
import sys
import time

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "tests" / "worlds"))


def task(number, first, **world):
    """Task `number` as MuJoCo answers it."""
    import snapshot_world as w

    rng = np.random.default_rng(first + number)
    thing = ["box", "tall", "can", "ball", "puck"][number % 5]
    points, half, reach = w.corners(thing, rng)
    mu, tool_mu = float(np.exp(rng.uniform(np.log(0.15), np.log(0.7)))), float(rng.uniform(0.15, 0.5))
    rolling = float(10 ** rng.uniform(-4.5, -3))
    name = list(w.TOOLS)[number % 3]
    tool, action = w.TOOLS[name], list(w.ACTIONS)[(number // 3) % 4]
    world = w.World(thing, points, tool, mu, tool_mu, rolling, 0.1, **world)
    trials = []
    for _ in range(24):
        yaw = rng.uniform(0, 2 * np.pi)
        start = np.array([0, 0, half, np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)])
        times, path = w.tool_path(tool, action, start[:2], reach, 2 * half, rng)
        end, _, _ = world.run(start, times, path, 2.0)
        trials.append(dict(yaw=yaw, times=times.tolist(), path=path.tolist(), end=end.tolist()))
    return dict(thing=thing, tool=name, action=action, shape=tool["shape"], size=tool["size"], points=points.tolist(), half=half,
                coefficients=[mu, rolling, tool_mu], trials=trials)


def tasks(count, first):
    print(json.dumps(dict(tasks=[task(number, first) for number in range(count)])))


def itself(number, first):
    for step, yields in ((0.001, 0.004), (0.00025, 0.004), (0.00025, 0.001)):
        found = task(number, first, step=step, yields=yields)
        ends = np.array([t["end"] for t in found["trials"]])
        travel = np.linalg.norm(ends[:, :2], axis=1).mean()
        fell = int((ends[:, 2] < 0.9 * found["half"]).sum())
        print(f"{found['thing']} {found['tool']} {found['action']}, step {1e3 * step} ms, contacts of {1e3 * yields:.0f} ms: mean "
              f"{np.round(1e3 * ends[:, :2].mean(0), 1)} mm, spread {np.round(1e3 * ends[:, :2].std(0, ddof=1), 1)} mm, "
              f"travel {1e3 * travel:.1f} mm, {fell} of {len(ends)} fell")


def peer(folder):
    sys.path.insert(0, folder)
    import push_lib

    engine = push_lib.Bullet()
    _, mesh = push_lib.hull()
    starts = push_lib.disturbances(500, 1)
    engine.run(push_lib.TRUE, starts[:20])
    begin = time.process_time()
    real = engine.run(push_lib.TRUE, push_lib.disturbances(500, 1000))
    spent = time.process_time() - begin
    print(json.dumps(dict(cpu=spent, real=real.tolist(), starts=starts.tolist(), points=mesh.vertices.tolist())))


if __name__ == "__main__":
    if sys.argv[1] == "peer":
        peer(sys.argv[2])
    elif sys.argv[1] == "itself":
        itself(int(sys.argv[2]), int(sys.argv[3]))
    else:
        tasks(int(sys.argv[1]), int(sys.argv[2]))
