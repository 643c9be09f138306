#!/usr/bin/env python3
"""judge_worlds.py PALPATE OUT [FIRST_SEED COUNT [views]]: makes captures with MuJoCo as the world, reconstructs them and prints the errors.

Then three tins that are lifted and twisted (an offset centre, a yaw inertia that is not the shape's, nothing): their yaw inertia
has to be measured to 3 % and the first cause that is named has to be the one that is hidden.

Fails where a relation or a joint type is wrong, where a cause is named (nothing is hidden; a joint's damping may be told
as one) or a verdict is not as it should be, or where mass, friction or stiffness is off by more than 10 % while
its interval does not hold the truth. With FIRST_SEED and COUNT, known shapes of those seeds (tins, pads and hinges in turn)
in place of the usual six with views, or with `views` all seven kinds in turn as a camera sees them; prints for each quantity
how often its interval holds the truth, and fails where those called measured hold it in fewer than 90 % of all."""
import collections, json, os, statistics, subprocess, sys

CASES = [("tin", 201), ("tin", 202), ("pad", 203), ("stack", 204), ("glued", 205), ("hinge", 206)]
TWISTED = [("none", 29101), ("com-offset", 29102), ("yaw-inertia", 29103)]
TURNS = ("tin", "pad", "tin", "pad", "hinge")
SEEN = ("tin", "pad", "stack", "glued", "hinge", "drawer", "bars")
OWN = ("joint-damping", "elastic-damping")  # what the truth itself tells of a joint or a pad


def run(*words):
    return subprocess.run(words, capture_output=True, text=True)


def summed(rows):
    """How often intervals hold the truth, by quantity and status; the share of those that are measured."""
    told = collections.defaultdict(list)
    for name, row in rows:
        if row.get("holds") is not None and row.get("estimate") is not None:
            told[row["quantity"], row["status"]].append((name, row))
    for (quantity, status), found in sorted(told.items()):
        held = sum(row["holds"] for _, row in found)
        errors = [row["relative"] for _, row in found if row.get("relative") is not None]
        off = f", relative error median {statistics.median(errors):.4f}, worst {max(errors):.4f}" if errors else ""
        missed = [name for name, row in found if not row["holds"]]
        print(f"{quantity} ({status}): intervals hold {held} of {len(found)}{off}{', not ' + ', '.join(missed) if missed else ''}")
    measured = [row["holds"] for (_, status), found in told.items() if status == "measured" for _, row in found]
    share = sum(measured) / max(len(measured), 1)
    print(f"all that is measured: {sum(measured)} of {len(measured)} ({share:.3f}; bar 0.9)")
    return share


def judged(twin):
    """What the diagnosis says, and whether that is wrong where nothing is hidden."""
    with open(f"{twin}/diagnosis.json") as file:
        diagnosis = json.load(file)
    named = [f["cause"] for f in diagnosis["findings"] if f["cause"] not in OWN]
    return diagnosis["verdict"], named


def twisted(palpate, maker, out):
    """How many of the twisted tins are told wrong."""
    bad = 0
    for hidden, seed in TWISTED:
        capture, twin = f"{out}/twisted-{seed}", f"{out}/twisted-{seed}-twin"
        made = run(sys.executable, maker, capture, "--kind", "tin", "--seed", str(seed), "--hide", hidden, "--twist")
        built = run(palpate, "reconstruct", capture, "--out", twin, "-q")
        if made.returncode or built.returncode:
            print(f"twisted-{seed}: {made.stderr.strip()} {built.stderr.strip()}")
            bad += 1
            continue
        with open(f"{twin}/twin.json") as file, open(f"{capture}/truth.json") as truth:
            inertia = json.load(file)["bodies"][0]["links"][0]["inertia"]
            true = json.load(truth)["bodies"]["tin"]["inertia"][2]
        verdict, named = judged(twin)
        off = inertia["value"][2] / true - 1
        bad += inertia["status"] != "measured" or abs(off) > 0.03 or (named[:1] or ["none"]) != [hidden]
        print(f"twisted-{seed}: yaw inertia {inertia['status']}, off by {off:+.4f} of {true:.3e} kg m2; hidden {hidden}, "
              f"named {' '.join(named) or 'none'}, {verdict}", flush=True)
    return bad


def main():
    palpate, out = sys.argv[1], sys.argv[2]
    maker = os.path.join(os.path.dirname(os.path.abspath(__file__)), "mujoco_world.py")
    many = len(sys.argv) > 4
    cases, told = CASES, ["--views"]
    seen = sys.argv[5:] == ["views"]
    if many:
        first, count = int(sys.argv[3]), int(sys.argv[4])
        turns = SEEN if seen else TURNS
        cases = [(turns[k % len(turns)], first + k) for k in range(count)]
        told = told if seen else ["--hide", "none"]
    bad, rows, verdicts = 0, [], collections.Counter()
    for kind, seed in cases:
        capture, twin = f"{out}/{kind}-{seed}", f"{out}/{kind}-{seed}-twin"
        made = run(sys.executable, maker, capture, "--kind", kind, "--seed", str(seed), *told)
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
        rows += [(f"{kind}-{seed}", row) for row in score["rows"]]
        s = score["summary"]
        wrong = s["relations"]["all"] - s["relations"]["good"] + s["joints"]["all"] - s["joints"]["good"]
        worst = {k: round(v, 4) for k, v in s["worst_relative"].items()}
        held = f'{s["intervals"]["good"]}/{s["intervals"]["all"]}'
        far = any(v > 0.10 for v in worst.values()) and s["intervals"]["good"] < s["intervals"]["all"]
        verdict, named = judged(twin)
        verdicts[kind, verdict] += 1
        print(f"{kind}-{seed}: relative errors {worst}, intervals {held}, wrong relations or joints {wrong}, "
              f"{verdict}{' FALSELY ' + ' '.join(named) if named else ''}", flush=True)
        bad += bool(wrong or named) if many else bool(wrong or far or named or verdict == "unknown")
    for (kind, verdict), n in sorted(verdicts.items()):
        print(f"{kind}: {verdict} {n}")
    bad += summed(rows) < 0.9 if many else twisted(palpate, maker, out)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
