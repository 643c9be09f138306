#!/usr/bin/env python3
"""A blind test of the diagnosis on worlds made with MuJoCo that hide an effect, or none.

    python blind_diagnosis.py PALPATE FOLDER [--first-seed N] [--clean N] [--each N] [--pairs N] [--kinds tin pad hinge drawer toss ball] [--views] [--quick]

Makes the captures in FOLDER (those that are there already are kept), reconstructs each without its truth, and prints
what was hidden beside what was named, and counts: false names on clean captures, effects found, first name right,
truth among the names given. Needs `mujoco` and `numpy`.
"""
import argparse
import json
import pathlib
import random
import subprocess
import sys

HERE = pathlib.Path(__file__).parent
TIN = ["velocity-weakening-friction", "viscous-friction", "anisotropic-friction", "friction-patch", "support-tilt", "bump", "magnet",
       "com-offset", "wear-or-heating", "force-bias", "force-bias-world", "force-drift", "static-ageing", "breakaway-bond", "tether",
       "tool-friction", "time-delay", "hidden-body", "contact-point-offset", "yaw-inertia", "added-inertia", "loose-mass",
       "outside-texture", "outside-ratchet"]
PAD = ["hardening-stiffness", "second-stage", "power-law-stiffness", "elastic-damping", "stress-relaxation", "plastic-set",
       "elastic-hysteresis", "softening-by-use", "adhesion", "preload", "snap-through", "force-saturation"]
DRAWER = ["joint-damping", "joint-spring", "joint-stiction", "detent", "latch", "soft-close", "limit-compliance", "backlash",
          "joint-loose-mass", "outside-joint-texture"]
TOSS = ["length-scale", "gravity-error", "support-tilt", "com-offset", "nonuniform-density", "tracking-error",
        "velocity-weakening-friction", "outside-wind", "outside-patch"]
KINDS = dict(ball=["rolling-resistance"], toss=TOSS, tin=TIN, pad=PAD, hinge=["joint-gravity", *DRAWER], drawer=DRAWER)


QUICK = [("tin", "support-tilt"), ("pad", "hardening-stiffness"), ("hinge", "joint-spring"), ("drawer", "detent"), ("toss", "com-offset")]


def cases(arguments):
    """(kind, cause, seed) of every capture: a quarter or more of them clean."""
    seed = arguments.first_seed
    if arguments.quick:
        yield from ((kind, cause, seed + i) for i, (kind, hidden) in enumerate(QUICK) if kind in arguments.kinds for cause in (hidden, "none"))
        return
    for kind in arguments.kinds:
        causes = KINDS[kind]
        for cause in causes * arguments.each + ["none"] * arguments.clean:
            seed += 1
            yield kind, cause, seed
        rng = random.Random(arguments.first_seed)
        known = [cause for cause in causes if not cause.startswith("outside")]
        for _ in range(arguments.pairs):
            seed += 1
            yield kind, ",".join(rng.sample(known, 2)), seed


def named(palpate, capture, out):
    """The verdict, the causes that are named, each with its rivals, and the odds of the first."""
    subprocess.run([palpate, "-q", "reconstruct", str(capture), "--out", str(out)], check=True, stderr=subprocess.DEVNULL)
    diagnosis = json.loads((out / "diagnosis.json").read_text())
    names = [[f["cause"]] + [a["cause"] for a in f["alternatives"]] for f in diagnosis["findings"]]
    odds = diagnosis["findings"][0]["probability"] if names else None
    return diagnosis["verdict"], names, odds


def told_both(palpate, capture, causes):
    """Whether a diagnosis that is told both causes names both: then both can be seen."""
    command = [palpate, "-q", "diagnose", str(capture), "--causes", ",".join(causes), "--json"]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    return {f["cause"] for f in json.loads(done.stdout)["findings"]} == set(causes)


def calibration_error(told):
    """Mean distance of the odds from how often they were right, over six ranges; what is outside the catalogue counts as wrong."""
    edges = [0, 0.3, 0.5, 0.7, 0.85, 0.95, 1.01]
    ranges = [[t for t in told if low <= t[0] < high] for low, high in zip(edges, edges[1:])]
    return sum(abs(sum(odds for odds, _ in r) - sum(right for _, right in r)) for r in ranges) / len(told)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("palpate")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--first-seed", type=int, default=1000)
    parser.add_argument("--clean", type=int, default=8)
    parser.add_argument("--each", type=int, default=1)
    parser.add_argument("--pairs", type=int, default=0, help="captures of each kind with two effects")
    parser.add_argument("--quick", action="store_true", help="five effects and five clean captures; exit code 1 where one is not named or falsely so")
    parser.add_argument("--firm-finger", action="store_true", help="the finger's tip on ten times stiffer springs")
    parser.add_argument("--views", action="store_true", help="shapes are seen by a camera, not known (tin, pad, hinge, drawer)")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    arguments = parser.parse_args()
    if arguments.views:
        arguments.kinds = [kind for kind in arguments.kinds if kind not in ("toss", "ball")]
    told = []
    count = dict(clean=0, false=0, outside=0, passed=0, hidden=0, found=0, first=0, among=0, pairs=0, both=0, one=0, seen=0, named=0)
    for kind, cause, seed in cases(arguments):
        capture = arguments.folder / f"{cause}-{kind}-{seed}".replace(",", "+")
        if not (capture / "truth.json").exists():
            make = [sys.executable, str(HERE / "mujoco_world.py"), str(capture), "--kind", kind, "--seed", str(seed), "--hide", cause]
            make += ["--firm-finger"] * arguments.firm_finger + ["--views"] * arguments.views
            subprocess.run(make, check=True, stdout=subprocess.DEVNULL)
        verdict, names, odds = named(arguments.palpate, capture, arguments.folder / f"{capture.name}.twin")
        print(f"{capture.name:45} {verdict:10} {'; '.join(' or '.join(n) for n in names)}", flush=True)
        if "," in cause:
            right = [any(c in n for n in names) for c in cause.split(",")]
            count["pairs"] += 1
            count["both"] += all(right)
            if told_both(arguments.palpate, capture, cause.split(",")):
                count["seen"] += 1
                count["named"] += all(right)
            count["one"] += any(right)
            continue
        if names:
            told.append((odds, names[0][0] == cause))
        if cause == "none":
            count["clean"] += 1
            count["false"] += bool(names)
        elif cause.startswith("outside"):
            count["outside"] += 1
            # Seen for what it is: no name, or one that is said not to be the whole or not to stand alone.
            count["passed"] += not names or verdict in ("unknown", "ambiguous")
        else:
            count["hidden"] += 1
            count["found"] += bool(names)
            count["first"] += bool(names) and names[0][0] == cause
            count["among"] += any(cause in n for n in names)
    print(f"\nfalse names on clean captures: {count['false']} of {count['clean']}")
    print(f"hidden effects: {count['found']} of {count['hidden']} seen; first name right {count['first']}; among the names {count['among']}")
    print(f"effects outside the catalogue that got no name, or one told as not the whole: {count['passed']} of {count['outside']}")
    print(f"two effects: {count['pairs']}; both among the names {count['both']}; one at least {count['one']}")
    print(f"of those of which a diagnosis told both names both, {count['seen']}: both among the names {count['named']}")
    if told:
        print(f"calibration error of the odds of first names: {calibration_error(told):.3f} of {len(told)}")
    if arguments.quick and (count["false"] or count["among"] < count["hidden"]):
        sys.exit(1)


if __name__ == "__main__":
    main()
