"""Plays trials in an engine: one JSON object on standard input, one on standard output (its last line).

In: folder, scene (gravity, point, normal, trees, welds), trials, seconds, settling, step. Poses are x y z qx qy qz qw.
Out: version; rest {part: [settling m, drift m, turn rad]}; trials [{settled, ended: {part: pose}, force: [[s, fx, fy, fz]]}].
An engine defines `class Engine`: `Engine(job, trial or None)`, `step()`, `poses()` -> {part: pose}, `bring(pose)`,
`move(pose, velocity)`, `force()`, and `version()`.
"""
import json
import math
import os
import sys

MEAN = 5  # steps over which a force is averaged


def multiply(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]


def rotate(q, v):
    x, y, z, w = q
    turned = multiply(multiply(q, [v[0], v[1], v[2], 0.0]), [-x, -y, -z, w])
    return turned[:3]


def inverse(pose):
    q = [-pose[3], -pose[4], -pose[5], pose[6]]
    return [-v for v in rotate(q, pose[:3])] + q


def compose(a, b):
    moved = rotate(a[3:], b[:3])
    return [a[i] + moved[i] for i in range(3)] + multiply(a[3:], b[3:])


def angle(p, q):
    dot = abs(sum(a * b for a, b in zip(p, q)))
    return 2.0 * math.acos(min(1.0, dot))


def interpolate(trial, t):
    """World-from-tool at a time: linear in the position and (normalised) in the quaternion."""
    time, path = trial["time"], trial["path"]
    if t <= time[0]:
        return path[0]
    if t >= time[-1]:
        return path[-1]
    low, high = 0, len(time) - 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if time[middle] <= t else (low, middle)
    share = (t - time[low]) / max(time[high] - time[low], 1e-12)
    a, b = path[low], path[high]
    sign = 1.0 if sum(x * y for x, y in zip(a[3:], b[3:])) >= 0.0 else -1.0
    out = [x + share * (y - x) for x, y in zip(a[:3], b[:3])]
    q = [x + share * (sign * y - x) for x, y in zip(a[3:], b[3:])]
    size = math.sqrt(sum(v * v for v in q))
    return out + [v / size for v in q]


def velocity(before, after, dt):
    """Linear velocity and spin, world, between two poses."""
    linear = [(b - a) / dt for a, b in zip(before[:3], after[:3])]
    x, y, z, w = multiply(after[3:], [-before[3], -before[4], -before[5], before[6]])
    if w < 0.0:
        x, y, z, w = -x, -y, -z, -w
    return linear, [2.0 * v / dt for v in (x, y, z)]


def parts(job):
    return [p for tree in job["scene"]["trees"] for p in tree["parts"]]


def present(job, trial):
    """The trees that take part, each with its number."""
    trees = enumerate(job["scene"]["trees"])
    return [(i, tree) for i, tree in trees if trial is None or trial["present"][i]]


def welds(job, trial):
    """The bonds between parts that take part."""
    here = {p["name"] for _, tree in present(job, trial) for p in tree["parts"]}
    return [(a, b) for a, b in job["scene"]["welds"] if a in here and b in here]


def part_named(job, name):
    return next(p for p in parts(job) if p["name"] == name)


def rest(job):
    engine = Engine(job, None)
    centre = lambda pose, part: compose(pose, list(part["com"]) + [0.0, 0.0, 0.0, 1.0])[:3]
    start = engine.poses()
    late, steps = start, int(job["seconds"] / job["step"])
    for k in range(steps):
        engine.step()
        if k + 1 == int(job["settling"] / job["step"]):
            late = engine.poses()
    end, out = engine.poses(), {}
    for part in parts(job):
        name = part["name"]
        a, b, c = (centre(pose[name], part) for pose in (start, late, end))
        out[name] = [math.dist(a, b), math.dist(b, c), angle(late[name][3:], end[name][3:])]
    return out


def play(job, trial):
    engine, dt = Engine(job, trial), job["step"]
    for _ in range(int(job["settling"] / dt)):
        engine.step()
    settled = engine.poses()
    before = interpolate(trial, 0.0)
    engine.bring(before)
    force, total = [], [0.0, 0.0, 0.0]
    for k in range(1, int(trial["time"][-1] / dt) + 1):
        now = interpolate(trial, k * dt)
        engine.move(before, velocity(before, now, dt))
        engine.step()
        before = now
        total = [a + b for a, b in zip(total, engine.force())]
        if k % MEAN == 0:
            force.append([k * dt] + [v / MEAN for v in total])
            total = [0.0, 0.0, 0.0]
    return {"settled": settled, "ended": engine.poses(), "force": force}


def main():
    job = json.load(sys.stdin)
    os.chdir(job["folder"])
    out = {"version": version(), "rest": rest(job) if job["seconds"] > 0.0 else {}, "trials": []}
    for trial in job["trials"]:
        try:
            out["trials"].append(play(job, trial))
        except Exception as fault:  # one trial that cannot be played is told, the others count
            out["trials"].append({"why": f"{type(fault).__name__}: {fault}"})
    sys.stdout.write("\n" + json.dumps(out) + "\n")
