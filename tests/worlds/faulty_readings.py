#!/usr/bin/env python3
"""A blind test of the diagnosis on recordings of MuJoCo worlds whose readings are spoilt afterwards, as a faulty sensor would.

    python faulty_readings.py PALPATE FOLDER [--first-seed N] [--each N] [--kinds tin pad hinge drawer] [--beside]

Nothing of the world changes, only what was read of it: that is what parts a sensor from physics. Each fault has a strength
drawn over a factor of four. With `--beside` the world hides an effect of its own as well. Makes the captures in FOLDER
(those that are there already are kept), reconstructs each without its truth, and prints what was spoilt beside what was
named, and counts. Needs `mujoco` and `numpy`.
"""
import argparse
import collections
import json
import pathlib
import random
import shutil
import subprocess
import sys

import numpy as np
from blind_diagnosis import HERE, named

LASTING = ["quantisation", "outliers", "force-saturation", "sensor-lag", "outside-hum"]
# A pad hardly moves: its tracking tells nothing. A hinge turns about one axis: no scale or turn of the room shows. No hand that
# holds throughout reads a drift while it touches nothing.
FAULTS = dict(
    tin=[*LASTING, "force-bias", "force-drift", "time-delay", "clock-drift", "length-scale", "tracking-error"],
    pad=[*LASTING, "force-bias", "force-drift"],
    hinge=["quantisation", "force-saturation", "sensor-lag", "force-bias", "time-delay", "clock-drift"],
    drawer=["quantisation", "force-saturation", "sensor-lag", "force-bias", "time-delay", "clock-drift", "length-scale", "tracking-error"],
)
# What these worlds show of themselves at their usual strength.
SHOWN = dict(
    tin=["viscous-friction", "anisotropic-friction", "support-tilt", "bump", "magnet", "tether", "contact-point-offset", "loose-mass"],
    pad=["hardening-stiffness", "power-law-stiffness", "stress-relaxation", "elastic-hysteresis", "snap-through"],
    hinge=["joint-damping", "joint-spring", "detent", "latch", "joint-loose-mass"],
    drawer=["joint-damping", "joint-spring", "detent", "latch", "limit-compliance"],
)


def read(path):
    """The header and the rows of a stream."""
    return path.open().readline(), np.atleast_2d(np.genfromtxt(path, delimiter=",", skip_header=1))


def write(path, header, rows):
    with path.open("w") as out:
        out.write(header)
        np.savetxt(out, rows, delimiter=",", fmt="%.10g")


def rotations(quaternions):
    """Matrices of unit quaternions, scalar last."""
    x, y, z, w = quaternions.T
    rows = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    return np.array(rows).transpose(2, 0, 1)


class Fault:
    """One fault, with numbers drawn once for a capture."""

    def __init__(self, cause, rng, usual, start):
        self.cause, self.usual, self.start, self.rng = cause, usual, start, rng
        self.size = float(np.exp(rng.uniform(-0.7, 0.7)))
        self.strength = self.size * rng.choice([-1, 1])
        way = rng.normal(size=3)
        self.way, self.rate = way / np.linalg.norm(way), rng.uniform(5, 25)

    def forces(self, time, force):
        """What the sensor makes of forces in its own frame, N."""
        size, usual = self.size, self.usual
        if self.cause == "force-bias":
            return force + 0.08 * usual * size * self.way
        if self.cause == "force-drift":
            return force + np.outer((time - self.start) / 60, self.way) * 0.1 * usual * size
        if self.cause == "force-saturation":
            limit = usual * (1 - 0.15 * size)
            return np.clip(force, -limit, limit)
        if self.cause == "sensor-lag":
            share, out, now = 1 - np.exp(-np.median(np.diff(time)) / (0.04 * size)), [], force[0]
            for row in np.nan_to_num(force):
                now = now + share * (row - now)
                out.append(now)
            return np.array(out)
        if self.cause == "quantisation":
            step = 0.08 * usual * size
            return np.round(force / step) * step
        if self.cause == "outliers":
            struck = self.rng.random(len(force)) < 0.01
            return force + struck[:, None] * self.rng.standard_t(2.5, size=force.shape) * 0.15 * usual * size
        if self.cause == "outside-hum":
            return force + np.outer(np.sin(2 * np.pi * self.rate * time), self.way) * 0.08 * usual * size
        return force

    def track(self, rows):
        """What the tracking makes of poses `time,x,y,z,qx,qy,qz,qw`."""
        if self.cause == "time-delay":
            rows[:, 0] += 0.03 * self.strength
        if self.cause == "clock-drift":
            rows[:, 0] += 1e-3 * self.strength * (rows[:, 0] - self.start)
        if self.cause == "length-scale":
            rows[:, 1:4] *= 1 + 0.03 * self.strength
        if self.cause == "tracking-error":
            half = np.radians(self.strength)
            turn = np.array([[np.cos(2 * half), -np.sin(2 * half), 0], [np.sin(2 * half), np.cos(2 * half), 0], [0, 0, 1]])
            rows[:, 1:4] = rows[:, 1:4] @ turn.T
            x, y, z, w = rows[:, 4:8].T.copy()
            s, c = np.sin(half), np.cos(half)
            rows[:, 4:8] = np.array([c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z]).T
        return rows


def spoil(source, target, cause, seed):
    """A copy of a capture as a faulty sensor would have read it; its strength."""
    shutil.rmtree(target, ignore_errors=True)
    shutil.copytree(source, target)
    touches = json.loads((target / "capture.json").read_text())["interactions"]
    forces = {t["force"]: read(target / t["force"]) for t in touches if t.get("force")}
    usual = float(np.nanquantile(np.concatenate([np.linalg.norm(f[:, 1:4], axis=1) for _, f in forces.values()]), 0.9))
    fault = Fault(cause, np.random.default_rng(seed), usual, min(f[0, 0] for _, f in forces.values()))
    for touch in touches:
        if touch.get("force"):
            header, rows = forces[touch["force"]]
            turns = None
            if touch.get("tool_path"):
                _, path = read(target / touch["tool_path"])
                at = np.clip(np.searchsorted(path[:, 0], rows[:, 0]), 0, len(path) - 1)
                turns = rotations(path[at, 4:8])
            own = rows[:, 1:4] if turns is None else np.einsum("nji,nj->ni", turns, rows[:, 1:4])
            own = fault.forces(rows[:, 0], own)
            rows[:, 1:4] = own if turns is None else np.einsum("nij,nj->ni", turns, own)
            write(target / touch["force"], header, rows)
        for name in touch.get("tracks", {}).values():
            header, rows = read(target / name)
            if len(rows) > 2:
                write(target / name, header, fault.track(rows))
    truth = json.loads((target / "truth.json").read_text())
    truth["causes"] = [*truth.get("causes", []), *([] if cause.startswith("outside") else [cause])]
    (target / "truth.json").write_text(json.dumps(truth, indent=1))
    return fault.strength


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("palpate")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--first-seed", type=int, default=40000)
    parser.add_argument("--each", type=int, default=1)
    parser.add_argument("--beside", action="store_true", help="each world hides an effect of its own as well")
    parser.add_argument("--kinds", nargs="+", choices=FAULTS, default=list(FAULTS))
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    seed, by_cause, count = arguments.first_seed, collections.defaultdict(lambda: [0, 0]), collections.Counter()
    for kind in arguments.kinds:
        for cause in FAULTS[kind] * arguments.each:
            seed += 1
            own = random.Random(seed).choice(SHOWN[kind]) if arguments.beside else "none"
            world = arguments.folder / f"{own}-{kind}-{seed}"
            if not (world / "truth.json").exists():
                make = [sys.executable, str(HERE / "mujoco_world.py"), str(world), "--kind", kind, "--seed", str(seed), "--hide", own]
                subprocess.run(make, check=True, stdout=subprocess.DEVNULL)
            capture = arguments.folder / f"{world.name}-{cause}"
            strength = spoil(world, capture, cause, seed)
            verdict, names, _ = named(arguments.palpate, capture, arguments.folder / f"{capture.name}.twin")
            if cause.startswith("outside"):
                right = not names or verdict in ("unknown", "ambiguous")
                right = right and verdict != "adequate"
            else:
                right = any(cause in n for n in names)
            hidden = {cause, own}
            first = bool(names) and names[0][0] in hidden
            spurious = any(not hidden & set(n) for n in names) and not cause.startswith("outside")
            by_cause[f"{kind} {cause}"][0] += right
            by_cause[f"{kind} {cause}"][1] += 1
            count.update(all=1, right=right, named=bool(names), first=first, spurious=spurious)
            count["both"] += right and any(own in n for n in names)
            print(f"{capture.name:55} {strength:5.2f} {verdict:10} {'; '.join(' or '.join(n) for n in names)}", flush=True)
    print()
    for cause, (right, of) in by_cause.items():
        print(f"{cause:30} {right} of {of}")
    print(f"\nthe fault among the names, or told as of no name: {count['right']} of {count['all']}")
    print(f"first names that are hidden there: {count['first']} of {count['named']}; captures with a name that is not: {count['spurious']}")
    if arguments.beside:
        print(f"both fault and effect among the names: {count['both']}")


if __name__ == "__main__":
    main()
