#!/usr/bin/env python3
"""Errors and coverage of what tosses tell, on clean worlds made with MuJoCo.

    python judge_tosses.py PALPATE FOLDER [--first-seed N] [--count N]

Makes captures of ten tosses each in FOLDER (those that are there are kept), reconstructs each without its truth, and prints
restitution, friction and the ratio of inertia beside the truth, how many intervals hold it, the error on held-out tosses, and
false names. Needs `mujoco` and `numpy`.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import time

import numpy as np

HERE = pathlib.Path(__file__).parent


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("palpate")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--first-seed", type=int, default=2000)
    parser.add_argument("--count", type=int, default=24)
    arguments = parser.parse_args()
    errors, held, seconds, names, ahead, flight, bounced = {}, {}, [], 0, [], [], []
    for seed in range(arguments.first_seed, arguments.first_seed + arguments.count):
        capture = arguments.folder / f"none-toss-{seed}"
        if not (capture / "truth.json").exists():
            make = [sys.executable, str(HERE / "mujoco_world.py"), str(capture), "--kind", "toss", "--seed", str(seed)]
            subprocess.run(make, check=True, stdout=subprocess.DEVNULL)
        out = arguments.folder / f"{capture.name}.twin"
        began = time.perf_counter()
        subprocess.run([arguments.palpate, "-q", "reconstruct", str(capture), "--out", str(out)], check=True)
        seconds.append(time.perf_counter() - began)
        truth = json.loads((capture / "truth.json").read_text())["bodies"]["box"]
        link = json.loads((out / "twin.json").read_text())["bodies"][0]["links"][0]
        diagnosis = json.loads((out / "diagnosis.json").read_text())
        names += bool(diagnosis["findings"])
        rmse = diagnosis["base"]["rmse"]
        ahead.append(rmse.get("position", np.nan))
        flight.append(rmse.get("position-in-flight", np.nan))
        bounced.append(rmse.get("position-after-bounce", np.nan))
        tossed = link.get("tossed", {})
        rows = [("restitution", link.get("restitution"), truth["restitution"]),
                ("friction", link.get("friction", {}).get("kinetic"), truth["friction_kinetic"]),
                ("inertia ratio", tossed.get("inertia_ratio"), 1.0), ("gravity", tossed.get("gravity"), 9.80665)]
        words = []
        for name, found, true in rows:
            if not found or found["status"] != "measured":
                continue
            low, high = found["ci95"]
            errors.setdefault(name, []).append(found["value"] / true - 1)
            held.setdefault(name, []).append(low <= true <= high)
            words.append(f"{name} {found['value']:.3f} [{low:.3f}, {high:.3f}] {true:.3f}{'' if held[name][-1] else ' !'}")
        print(f"{capture.name} {diagnosis['verdict']:9} {'; '.join(words)} {[f['cause'] for f in diagnosis['findings']]}", flush=True)
    print()
    for name, values in errors.items():
        size = np.abs(values)
        print(f"{name}: {len(values)} measured, median error {100 * np.median(size):.1f} %, 95th percentile "
              f"{100 * np.quantile(size, 0.95):.1f} %, mean {100 * np.mean(values):+.1f} %, intervals hold {sum(held[name])} of {len(values)}")
    print(f"false names: {names} of {arguments.count}; seconds, median {np.median(seconds):.1f}, worst {max(seconds):.1f}")
    print(f"held-out tosses, median of captures: {1e3 * np.nanmedian(flight):.2f} mm over the rest of the flight, "
          f"{1e3 * np.nanmedian(ahead):.2f} mm 0.07 s ahead about contacts, {1e3 * np.nanmedian(bounced):.1f} mm after the first bounce in one go")


if __name__ == "__main__":
    main()
