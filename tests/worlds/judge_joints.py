#!/usr/bin/env python3
"""judge_joints.py PALPATE OUT [SEEDS [FIRST [KIND...]]]: worlds of MuJoCo with joints and stacks, reconstructed and scored.

Five seeds from 500 on by default: 20 worlds that are seen by a camera (a hinge and a drawer on the table, a stack, a glued
pair) and 30 of known shapes off the table (doors, lids, rails, chutes, chains, things that merely touch).

Prints, over all of them, how many kinds and relations are right, errors of axis, origin and friction, and how often the
intervals hold. Fails where a kind or relation is wrong, or where fewer than nine in ten intervals hold."""
import json, math, os, subprocess, sys

SEEN = ["hinge", "drawer", "stack", "glued"]
KNOWN = ["door", "lid", "rail", "chute", "chain", "loose"]
PASSES = [word for name in ["shape", "articulation", "physics", "relations"] for word in ("--pass", name)]


def run(*words):
    return subprocess.run(words, capture_output=True, text=True)


def rows_of(palpate, out, kind, seed):
    here = os.path.dirname(os.path.abspath(__file__))
    capture, twin = f"{out}/{kind}-{seed}", f"{out}/{kind}-{seed}-twin"
    if not os.path.exists(f"{capture}/truth.json"):
        maker = os.path.join(here, "mujoco_world.py" if kind in SEEN else "joint_world.py")
        made = run(sys.executable, maker, capture, "--kind", kind, "--seed", str(seed), *["--views"] * (kind in SEEN))
        if made.returncode:
            return None, made.stderr.strip().splitlines()[-1:]
    built = run(palpate, "reconstruct", capture, "--out", twin, "-q", *PASSES)
    scored = run(palpate, "score", twin, "--truth", f"{capture}/truth.json", "--json")
    if built.returncode or scored.returncode:
        return None, (built.stderr + scored.stderr).strip()
    return json.loads(scored.stdout)["rows"], None


def main():
    palpate, out = sys.argv[1], sys.argv[2]
    seeds = int(sys.argv[3]) if len(sys.argv) > 3 else 5
    first = int(sys.argv[4]) if len(sys.argv) > 4 else 500
    os.makedirs(out, exist_ok=True)
    right, words, held, intervals, made, failed = 0, 0, 0, 0, 0, 0
    errors = {}
    for seed in range(first, first + seeds):
        for kind in sys.argv[5:] or SEEN + KNOWN:
            rows, fault = rows_of(palpate, out, kind, seed)
            if rows is None:
                print(f"{kind}-{seed}: {fault}")
                failed += 1
                continue
            made += 1
            for row in rows:
                between = "|" in row["about"]
                if not between:
                    continue
                if row.get("right") is not None:
                    words += 1
                    right += row["right"]
                    if not row["right"]:
                        print(f"{kind}-{seed}: {row}")
                if row.get("holds") is not None:
                    intervals += 1
                    held += row["holds"]
                    if not row["holds"]:
                        print(f"{kind}-{seed}: {row}")
                size = row.get("relative") if row.get("relative") is not None else row.get("error")
                if size is not None:
                    errors.setdefault((kind, row["quantity"]), []).append((size, row.get("status")))
    print(f"{made} worlds, {failed} not made; kinds and relations right {right} of {words}; intervals hold {held} of {intervals}")
    for (kind, quantity), sizes in sorted(errors.items()):
        values = sorted(s for s, _ in sizes)
        measured = sum(status == "measured" for _, status in sizes)
        print(f"  {kind} {quantity}: median {values[len(values) // 2]:.5f} worst {values[-1]:.5f} of {len(values)}, measured {measured}")
    return 1 if right < words or held < 0.9 * intervals or failed else 0


if __name__ == "__main__":
    sys.exit(main())
