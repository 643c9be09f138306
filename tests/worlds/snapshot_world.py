#!/usr/bin/env python3
"""Makes captures that hold snapshots only, with MuJoCo as the world: where a thing was before and after a tool moved.

    python snapshot_world.py OUT --seed N [--thing box|tall|can|ball|puck] [--trials 10] [--orientation known|none]
                             [--force] [--hold-out TOOL:ACTION] [--friction MU | --material NAME]

Three tools (stick, rake, hook), four actions (push, draw, tap_from_left, tap_from_right). The tool follows its recorded
path exactly (its joints' positions and speeds are set at every step), the thing's start orientation is drawn afresh,
start and end are measured with noise. Sizes, friction, mass, rolling resistance are drawn from the seed; the right
answers are in truth.json. Needs `mujoco` and `numpy`.
"""
import argparse
import json
import pathlib

import numpy as np
import mujoco

G = 9.80665
STEP = 0.001
NOISE = 0.001  # m, 1 sd of a measured position
TOOLS = {
    "stick": dict(shape="cylinder", size=[0.01, 0.08]),
    "rake": dict(shape="box", size=[0.01, 0.04, 0.03]),
    "hook": dict(shape="sphere", size=[0.015]),
}
MATERIALS = {"felt": (0.20, 0.25), "wood": (0.30, 0.30), "rubber": (0.60, 0.45), "card": (0.42, 0.35)}
ACTIONS = {"push": (1, 0), "draw": (-1, 0), "tap_from_left": (0, 1), "tap_from_right": (0, -1)}


def corners(thing, rng):
    """Corners of the thing about its centre, its half height, and how far it reaches to the side."""
    if thing == "box":
        h = rng.uniform([0.02, 0.02, 0.02], [0.05, 0.04, 0.035])
    elif thing == "tall":
        h = rng.uniform([0.02, 0.02, 0.06], [0.03, 0.03, 0.08])
    if thing in ("box", "tall"):
        p = np.array([[x * h[0], y * h[1], z * h[2]] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        return p, h[2], np.hypot(h[0], h[1])
    if thing in ("can", "puck"):
        r, half = rng.uniform(0.025, 0.04), rng.uniform(0.04, 0.06) if thing == "can" else rng.uniform(0.012, 0.02)
        a = np.arange(32) * 2 * np.pi / 32
        return np.array([[r * np.cos(t), r * np.sin(t), z] for t in a for z in (-half, half)]), half, r
    r = rng.uniform(0.025, 0.04)
    i = np.arange(200) + 0.5
    polar, turn = np.arccos(1 - 2 * i / 200), np.pi * (1 + 5**0.5) * i
    p = r * np.c_[np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)]
    return p, r, r


def write_obj(path, points):
    from scipy.spatial import ConvexHull

    hull = ConvexHull(points)
    middle = points.mean(0)
    lines = ["v %.6f %.6f %.6f" % tuple(p) for p in points]
    for s in hull.simplices:
        a, b, c = points[s]
        s = s if np.dot(np.cross(b - a, c - a), a - middle) > 0 else s[::-1]
        lines.append("f %d %d %d" % tuple(s + 1))
    path.write_text("\n".join(lines) + "\n")


class World:
    def __init__(self, thing, points, tool, mu, tool_mu, rolling, mass, step=STEP, yields=0.004):
        self.step = step
        shape = {"sphere": "sphere", "box": "box", "cylinder": "cylinder"}[tool["shape"]]
        asset, geom = "", f'<geom name="o" type="sphere" size="{np.linalg.norm(points[0])}" mass="{mass}"/>'
        if thing != "ball":
            asset = '<asset><mesh name="o" vertex="%s"/></asset>' % " ".join("%.6f" % x for x in points.ravel())
            geom = f'<geom name="o" type="mesh" mesh="o" mass="{mass}"/>'
        self.model = mujoco.MjModel.from_xml_string(f"""<mujoco>
<option timestep="{step}" gravity="0 0 -{G}" cone="elliptic" impratio="10" integrator="implicitfast"/>
<default><geom contype="0" conaffinity="0"/><pair solref="{yields} 1" solimp="0.95 0.99 0.0005"/></default>{asset}
<worldbody><geom name="t" type="plane" size="5 5 .1"/><body name="obj"><freejoint/>{geom}</body>
<body name="tool" gravcomp="1"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
<joint type="slide" axis="0 0 1"/><geom name="p" type="{shape}" size="{' '.join(map(str, tool['size']))}" mass="10000"/>
</body></worldbody><contact>
<pair geom1="t" geom2="o" condim="6" friction="{mu} {mu} {rolling} {rolling} {rolling}"/>
<pair geom1="p" geom2="o" condim="3" friction="{tool_mu} {tool_mu} .0001 .0001 .0001"/></contact></mujoco>""")
        self.data = mujoco.MjData(self.model)

    def run(self, start, times, path, seconds):
        m, d = self.model, self.data
        mujoco.mj_resetData(m, d)
        d.qpos[:7] = start
        at = lambda t: np.array([np.interp(t, times, path[:, k]) for k in range(3)])
        forces, wrench, still = [], np.zeros(6), 0
        for k in range(int(round(seconds / self.step))):
            # What rests while the tool rests goes on resting.
            resting = k * self.step > times[-1] and abs(d.qvel[:3]).max() < 1e-4 and abs(d.qvel[3:6]).max() < 1e-3
            still = still + 1 if resting else 0
            if still > 50 and len(forces) % 5 == 0:
                break
            a, b = at(k * self.step), at((k + 1) * self.step)
            d.qpos[7:10], d.qvel[6:9] = a, (b - a) / self.step
            mujoco.mj_step(m, d)
            push = np.zeros(3)
            for i in range(d.ncon):
                c = d.contact[i]
                if m.geom("p").id in c.geom:
                    mujoco.mj_contactForce(m, d, i, wrench)
                    f = c.frame.reshape(3, 3).T @ wrench[:3]
                    push += f if c.geom[0] == m.geom("p").id else -f
            forces.append(push)
        q = d.qpos[:7]
        return q[:3].copy(), q[3:].copy(), np.array(forces)


def tool_path(tool, action, centre, reach, height, rng):
    """A smooth stroke through the thing's place; taps are quick and short, pushes longer and slower."""
    way = np.array([*ACTIONS[action], 0.0])
    side = np.array([-way[1], way[0], 0.0])
    quick = action.startswith("tap")
    thick = tool["size"][0] if tool["shape"] != "box" else abs(way[:2]) @ tool["size"][:2]
    low = {"sphere": tool["size"][0], "box": tool["size"][-1], "cylinder": tool["size"][-1]}[tool["shape"]]
    z = max(low + 0.003, 0.4 * height)
    off = rng.normal(0, 0.15 * reach)
    start = np.array([centre[0], centre[1], 0]) - way * (reach + thick + 0.04) + side * off
    start[2] = z
    length = 0.04 + reach + (0.02 if quick else 0.08)
    speed = rng.uniform(0.35, 0.6) if quick else rng.uniform(0.2, 0.35)
    # Even speed, then a stop within a few hundredths of a second: the thing goes on by itself.
    stop = 0.03
    times = np.r_[np.linspace(0, length / speed, 40), length / speed + np.linspace(0.002, stop, 15)]
    late = (times - length / speed).clip(0)
    along = speed * (times.clip(0, length / speed) + late - late**2 / (2 * stop))
    return times, start + np.outer(along, way)


def main():
    p = argparse.ArgumentParser()
    p.add_argument("out", type=pathlib.Path)
    p.add_argument("--seed", type=int, default=0)
    p.add_argument("--thing", choices=["box", "tall", "can", "ball", "puck"])
    p.add_argument("--trials", type=int, default=10)
    p.add_argument("--held-trials", type=int, help="trials of each held-out tool and action, where not --trials")
    p.add_argument("--orientation", choices=["known", "none"], default="none")
    p.add_argument("--force", action="store_true")
    p.add_argument("--hold-out", default="hook:tap_from_right")
    p.add_argument("--friction", type=float)
    p.add_argument("--material", choices=MATERIALS, help="friction of this material, within 8 %%; the capture names it")
    p.add_argument("--train", help="TOOL:ACTION[,...]: only these and the held-out ones are done")
    a = p.parse_args()
    rng = np.random.default_rng(a.seed)
    thing = a.thing or ["box", "tall", "can", "ball", "puck"][rng.integers(5)]
    points, half, reach = corners(thing, rng)
    mu = a.friction or float(np.exp(rng.uniform(np.log(0.15), np.log(0.7))))
    tool_mu, rolling = float(rng.uniform(0.15, 0.5)), float(10 ** rng.uniform(-4.5, -3))
    mass = float(rng.uniform(0.05, 0.4))
    body = dict(name="thing", mesh="thing.obj")
    if a.material:
        mu, tool_mu = (float(x * np.exp(rng.normal(0, 0.08))) for x in MATERIALS[a.material])
        body["material"] = a.material
    a.out.mkdir(parents=True, exist_ok=True)
    (a.out / "tracks").mkdir(exist_ok=True)
    write_obj(a.out / "thing.obj", points)
    held = set(a.hold_out.split(","))
    only = None if a.train is None else set(a.train.split(",")) | held
    interactions = []
    for tool_name, tool in TOOLS.items():
        world = World(thing, points, tool, mu, tool_mu, rolling, mass)
        for action in ACTIONS:
            group = f"{tool_name}:{action}"
            if only is not None and group not in only:
                continue
            count = a.held_trials if group in held and a.held_trials else a.trials
            for k in range(count):
                name = f"{tool_name}-{action}-{k:02d}"
                centre = rng.uniform(-0.1, 0.1, 2)
                yaw = rng.uniform(0, 2 * np.pi)
                start = np.array([*centre, half, np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)])
                times, path = tool_path(tool, action, centre, reach, 2 * half, rng)
                end, turn, force = world.run(start, times, path, 3.0)
                rows = ["time,x,y,z,qx,qy,qz,qw"]
                for t, place, q in ((0.0, start[:3], start[3:]), (3.0, end, turn)):
                    seen = place + rng.normal(0, NOISE, 3)
                    q = q[[1, 2, 3, 0]] / np.linalg.norm(q)
                    quat = ",".join("%.9f" % x for x in q) if a.orientation == "known" else "nan,nan,nan,nan"
                    rows.append("%.4f,%.6f,%.6f,%.6f,%s" % (t, *seen, quat))
                (a.out / "tracks" / f"{name}.csv").write_text("\n".join(rows) + "\n")
                rows = ["time,x,y,z,qx,qy,qz,qw"]
                rows += ["%.5f,%.6f,%.6f,%.6f,0,0,0,1" % (t, *x) for t, x in zip(times, path)]
                (a.out / "tracks" / f"{name}.tool.csv").write_text("\n".join(rows) + "\n")
                entry = dict(name=name, kind="push", action=action, tool_name=tool_name, tool=tool, target="thing",
                             tool_path=f"tracks/{name}.tool.csv", tracks={"thing": f"tracks/{name}.csv"})
                if group in held:
                    entry["held_out"] = True
                if a.force:
                    seen = force.reshape(-1, 5, 3).mean(1) + rng.normal(0, 0.02, (len(force) // 5, 3))
                    rows = ["time,fx,fy,fz"] + ["%.4f,%.5f,%.5f,%.5f" % ((i + 0.5) * 5 * STEP, *f) for i, f in enumerate(seen)]
                    (a.out / "tracks" / f"{name}.force.csv").write_text("\n".join(rows) + "\n")
                    entry["force"] = f"tracks/{name}.force.csv"
                interactions.append(entry)
    capture = dict(format="palpate-capture/1", name=f"snapshots-{thing}-{a.seed}", gravity=[0, 0, -G],
                   support=dict(point=[0, 0, 0], normal=[0, 0, 1]), bodies=[body],
                   noise=dict(position=NOISE), interactions=interactions, truth="truth.json")
    (a.out / "capture.json").write_text(json.dumps(capture, indent=1))
    truth = dict(bodies={"thing": dict(mass=mass, friction_static=mu, friction_kinetic=mu)})
    (a.out / "truth.json").write_text(json.dumps(truth, indent=1))
    print(json.dumps(dict(thing=thing, mu=mu, tool_mu=tool_mu, rolling=rolling, mass=mass)))


if __name__ == "__main__":
    main()
