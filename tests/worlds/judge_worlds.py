#!/usr/bin/env python3
"""judge_worlds.py PALPATE OUT: makes captures with MuJoCo as the world, reconstructs them and prints the errors.

Fails where a relation or a joint type is wrong, or mass, friction or stiffness is off by more than 10 % while
its interval does not hold the truth."""
import json, os, subprocess, sys

CASES = [("tin", 201), ("tin", 202), ("pad", 203), ("stack", 204), ("glued", 205), ("hinge", 206)]


def run(*words):
    return subprocess.run(words, capture_output=True, text=True)


def main():
    palpate, out = sys.argv[1], sys.argv[2]
    maker = os.path.join(os.path.dirname(os.path.abspath(__file__)), "mujoco_world.py")
    bad = 0
    for kind, seed in CASES:
        capture, twin = f"{out}/{kind}-{seed}", f"{out}/{kind}-{seed}-twin"
        made = run(sys.executable, maker, capture, "--kind", kind, "--seed", str(seed), "--views")
        if made.returncode:
            print(f"{kind}-{seed}: the world could not be made: {made.stderr.strip().splitlines()[-1:]}")
            bad += 1
            continue
        built = run(palpate, "reconstruct", capture, "--out", twin, "-q")
        scored = run(palpate, "score", twin, "--truth", f"{capture}/truth.json", "--json")
        if built.returncode or scored.returncode:
            print(f"{kind}-{seed}: {built.stderr.strip()} {scored.stderr.strip()}")
            bad += 1
            continue
        score = json.loads(scored.stdout)
        s = score["summary"]
        wrong = s["relations"]["all"] - s["relations"]["good"] + s["joints"]["all"] - s["joints"]["good"]
        worst = {k: round(v, 4) for k, v in s["worst_relative"].items()}
        held = f'{s["intervals"]["good"]}/{s["intervals"]["all"]}'
        far = any(v > 0.10 for v in worst.values()) and s["intervals"]["good"] < s["intervals"]["all"]
        print(f"{kind}-{seed}: relative errors {worst}, intervals {held}, wrong relations or joints {wrong}")
        bad += bool(wrong or far)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
