#!/usr/bin/env python3
"""cut_in_two.py PALPATE SOURCE OUT: tins cut across into two glued bodies, diagnosed.

SOURCE is a folder that `blind_diagnosis.py` filled with tins of MuJoCo, known by their shapes. Of each one OUT gets a capture in
which two halves of its mesh, `low` and `top`, are tracked apart (the upper with 0.1 mm of noise of its own) and go as one; what
was pushed is then `low`, what was lifted `top`. Prints verdict and names of each, and the counts.
"""
import argparse
import csv
import json
import pathlib
import random
import shutil

from blind_diagnosis import named


def halve(mesh, name, folder):
    """The lower or upper half of an upright box or cylinder."""
    lines = mesh.read_text().splitlines()
    heights = [float(line.split()[3]) for line in lines if line.startswith("v ")]
    low, middle = min(heights), 0.5 * (min(heights) + max(heights))

    def moved(line):
        if not line.startswith("v "):
            return line
        x, y, z = map(float, line.split()[1:4])
        return f"v {x:.10f} {y:.10f} {(low if name == 'low' else middle) + 0.5 * (z - low):.10f}"

    (folder / f"{name}.obj").write_text("\n".join(map(moved, lines)) + "\n")


def cut(source, out):
    """The capture with two bodies for its one; the causes that it hides."""
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(source, out)
    causes = json.loads((out / "truth.json").read_text())["causes"]
    (out / "truth.json").unlink()
    capture = json.loads((out / "capture.json").read_text())
    dice = random.Random(source.name)
    [body] = capture["bodies"]
    for name in ("low", "top"):
        halve(out / body["mesh"], name, out / "meshes")
    capture["bodies"] = [dict(body, name=name, mesh=f"meshes/{name}.obj") for name in ("low", "top")]
    for done in capture["interactions"]:
        done["target"] = "top" if done["kind"] == "lift" else "low"
        track = done["tracks"].pop(body["name"])
        done["tracks"] = {name: track.replace(f"track.{body['name']}", f"track.{name}") for name in ("low", "top")}
        with open(out / track, newline="") as file:
            head, *rows = list(csv.reader(file))
        for name, path in done["tracks"].items():
            spread = 1e-4 if name == "top" else 0.0
            with open(out / path, "w", newline="") as file:
                writer = csv.writer(file)
                writer.writerow(head)
                for time, *pose in rows:
                    at = [f"{float(x) + dice.gauss(0, spread):.9g}" if x else x for x in pose[:3]]
                    writer.writerow([time, *at, *pose[3:]])
    (out / "capture.json").write_text(json.dumps(capture, indent=1))
    return causes


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("palpate")
    parser.add_argument("source", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    arguments = parser.parse_args()
    count = dict(clean=0, adequate=0, false=0, hidden=0, found=0, first=0)
    for source in sorted(arguments.source.glob("*tin-*")):
        if source.suffix == ".twin":
            continue
        causes = cut(source, arguments.out / source.name)
        verdict, names, _ = named(arguments.palpate, arguments.out / source.name, arguments.out / f"{source.name}.twin")
        print(f"{source.name:45} {verdict:10} {'; '.join(' or '.join(n) for n in names)}", flush=True)
        if not causes:
            count["clean"] += 1
            count["adequate"] += verdict == "adequate"
            count["false"] += bool(names)
        elif len(causes) == 1 and not causes[0].startswith("outside"):
            count["hidden"] += 1
            count["found"] += bool(names)
            count["first"] += bool(names) and names[0][0] == causes[0]
    print(f"\nclean: {count['adequate']} of {count['clean']} adequate, {count['false']} named")
    print(f"one effect: {count['found']} of {count['hidden']} seen; first name right {count['first']}")


if __name__ == "__main__":
    main()
