#!/usr/bin/env python3
"""Turns the table of real effects (a humanoid's three tools on seven things) into captures of snapshot pairs.

    PALPATE_DATA=/path python tool_effects.py OUT [--hold-out hook:tap_from_right] [--thing NAME]

Reads tool-effects/effects.csv (tool, object, action, x0, y0, x1, y1) below PALPATE_DATA and shapes below ycb/. The table
holds no tool, no path, no speed, no time: what is written here are the nominal ones, the same for every thing, set
beforehand and never fitted. OUT/THING becomes one capture each. Nothing of the table is kept in the repository. A thing that no
scan fits, a tool or an action that is not known here and a row without numbers are left out, and said to be. `--shape NAME=FILE`
gives a thing a mesh of its own (m, z up).
"""
import argparse
import csv
import json
import math
import os
import pathlib

import numpy as np
import trimesh

# What the table's names most likely are; sizes are those of the scans.
SHAPES = {"bball": "057_racquetball", "yball": "056_tennis_ball", "orange": "017_orange", "plego": "073-a_lego_duplo",
          "ocup": "065-j_cups", "ycup": "065-f_cups", "sycup": "065-a_cups"}
# Words in other names, by the scan that they most likely mean.
WORDS = {"ball": "056_tennis_ball", "lego": "073-a_lego_duplo", "cup": "065-f_cups"}
TOOLS = {"stick": dict(shape="cylinder", size=[0.01, 0.06]), "rake": dict(shape="box", size=[0.01, 0.05, 0.015]),
         "hook": dict(shape="box", size=[0.01, 0.03, 0.015])}
# The robot stands at +x: it pushes away from itself and draws towards itself. Way, stroke after contact (m), speed (m/s).
ACTIONS = {"push": ((-1, 0), 0.10, 0.25), "draw": ((1, 0), 0.08, 0.20), "tap_from_left": ((0, 1), 0.05, 0.40),
           "tap_from_right": ((0, -1), 0.05, 0.40)}
PLACE_SD = 0.012  # m: doubt of where the tool met the thing


def scan(thing, folder, given):
    """The file of a thing's shape: as given, as its name says, or the only scan that bears its name; else nothing."""
    if thing in given:
        return pathlib.Path(given[thing])
    named = SHAPES.get(thing)
    if named is None:
        bare = thing.lower().strip("0123456789_-")
        alike = [f for f in sorted(folder.glob("*.stl")) if bare in f.stem.lower().split("_", 1)[-1].split("_")]
        worded = [scan for word, scan in WORDS.items() if word in bare]
        named = alike[0].stem if len(alike) == 1 else worded[0] if worded else None
    file = folder / f"{named}.stl"
    return file if named and file.exists() else None


def numbers(row):
    """The four places of a row; nothing where one of them is missing."""
    try:
        found = [float(row[k]) for k in ("x0", "y0", "x1", "y1")]
    except (KeyError, TypeError, ValueError):
        return None
    return found if all(map(math.isfinite, found)) else None


def path(tool_name, action, centre, reach, height):
    (way, stroke, speed), tool = ACTIONS[action], TOOLS[tool_name]
    way = np.array([*way, 0.0])
    size = tool["size"]
    thick = size[0] if tool["shape"] == "cylinder" else abs(way[:2]) @ np.array(size[:2])
    start = np.array([*centre, max(size[-1] + 0.003, 0.4 * height)]) - way * (reach + thick + 0.04)
    if tool_name == "stick" and action == "draw":
        start[1] += reach + 0.03  # a stick has nothing to draw with: it passes by
    length = 0.04 + stroke
    times = np.r_[np.linspace(0, length / speed, 40), length / speed + np.linspace(0.01, 0.1, 10)]
    late = (times - length / speed).clip(0)
    along = speed * (times.clip(0, length / speed) + late - late**2 / 0.2)
    return times, start + np.outer(along, way)


def main():
    p = argparse.ArgumentParser()
    p.add_argument("out", type=pathlib.Path)
    p.add_argument("--hold-out", default="hook:tap_from_right")
    p.add_argument("--thing")
    p.add_argument("--shape", action="append", default=[], help="NAME=FILE: the mesh of a thing (may be given more than once)")
    a = p.parse_args()
    data = pathlib.Path(os.environ["PALPATE_DATA"])
    rows = list(csv.DictReader(open(data / "tool-effects" / "effects.csv")))
    given = dict(s.split("=", 1) for s in a.shape)
    tool_held, action_held = a.hold_out.split(":")
    for thing in sorted({r["object"] for r in rows}):
        if a.thing not in (None, thing):
            continue
        file = scan(thing, data / "ycb" / "vhacd_stl", given)
        if file is None:
            print(f"{thing}: no scan bears its name; --shape {thing}=FILE gives it one")
            continue
        out = a.out / thing
        (out / "tracks").mkdir(parents=True, exist_ok=True)
        mesh = trimesh.load(file, force="mesh").convex_hull
        mesh.apply_translation(-mesh.bounds.mean(0))
        mesh.export(out / "thing.obj")
        half, reach = mesh.bounds[1, 2], np.linalg.norm(mesh.vertices[:, :2], axis=1).max()
        interactions, count, odd = [], {}, 0
        mine = [r for r in rows if r["object"] == thing]
        # Where the two were never put together, either of them is foretold.
        whole = any(r["tool"] == tool_held and r["action"] == action_held for r in mine)
        for r in mine:
            tool, action, places = r["tool"], r["action"], numbers(r)
            if tool not in TOOLS or action not in ACTIONS or places is None:
                odd += 1
                continue
            both, either = tool == tool_held and action == action_held, tool == tool_held or action == action_held
            if either and not both and whole:
                continue  # neither that tool nor that action is ever fitted
            k = count[(tool, action)] = count.get((tool, action), 0) + 1
            name = f"{tool}-{action}-{k:02d}"
            before, after = places[:2], places[2:]
            text = "time,x,y,z,qx,qy,qz,qw\n"
            for t, place in ((0.0, before), (4.0, after)):
                text += "%.1f,%.6f,%.6f,%.6f,nan,nan,nan,nan\n" % (t, *place, half)
            (out / "tracks" / f"{name}.csv").write_text(text)
            times, way = path(tool, action, np.array(before), reach, 2 * half)
            text = "time,x,y,z,qx,qy,qz,qw\n" + "".join("%.4f,%.6f,%.6f,%.6f,0,0,0,1\n" % (t, *x) for t, x in zip(times, way))
            (out / "tracks" / f"{name}.tool.csv").write_text(text)
            entry = dict(name=name, kind="push", action=action, tool_name=tool, tool=TOOLS[tool], target=thing,
                         tool_path=f"tracks/{name}.tool.csv", tracks={thing: f"tracks/{name}.csv"})
            if both or either and not whole:
                entry["held_out"] = True
            interactions.append(entry)
        if not interactions:
            print(f"{thing}: nothing that can be used")
            continue
        capture = dict(format="palpate-capture/1", name=f"effects-{thing}", support=dict(point=[0, 0, 0], normal=[0, 0, 1]),
                       bodies=[dict(name=thing, mesh="thing.obj")], noise=dict(position=PLACE_SD), interactions=interactions)
        (out / "capture.json").write_text(json.dumps(capture, indent=1))
        if odd:
            print(f"{thing}: {odd} row(s) left out: a tool or an action that is not known here, or a place that is no number")
    print(f"captures below {a.out}")


if __name__ == "__main__":
    main()
