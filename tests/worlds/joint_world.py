#!/usr/bin/env python3
"""Joints off the table, made with MuJoCo: doors, lids, rails, chutes, chains of two links, and things that merely touch.

    python joint_world.py OUT --kind door|lid|rail|chute|chain|loose --seed N

Known shapes, no views; tracks and forces with one of three levels of noise; moved by a pivoting grip, by the finger's
pushes, or by both. Friction, damping, spring, ends of the range, place and heading are drawn from the seed; the
right answers are in truth.json.
"""
import argparse
import json
import pathlib

import mujoco
import numpy as np

import mujoco_world as w
from hidden_scenes import box_mesh

# Tracks (m, rad), force (N), torque (N m): a motion capture rig, a good camera, a poor one.
LEVELS = [(1e-4, 1e-3, 0.02, 0.002), (4e-4, 4e-3, 0.04, 0.004), (1e-3, 8e-3, 0.08, 0.008)]
SPEEDS = [0.25, 0.6, 1.2, 0.4, 0.9]  # rad/s, or tenths of m/s
DRY = 'solreffriction="0.004 1" solimpfriction="0.99 0.9999 0.001" armature="1e-5"'


class World(w.World):
    """A world whose finger feels the torque of its contacts about its own centre."""

    def finger(self, tracked, waypoints, data=None):
        record_of = self.run

        def run(data, duration, tracked, drive, observe, turn=None):
            def felt(data):
                force, place = observe(data)
                return np.r_[force[:3], self.finger_torque(data)], place

            return record_of(data, duration, tracked, drive, felt, turn)

        self.run = run
        try:
            return super().finger(tracked, waypoints, data)
        finally:
            self.run = record_of

    def finger_torque(self, data):
        total, wrench = np.zeros(3), np.zeros(6)
        for i in range(data.ncon):
            contact = data.contact[i]
            if self.tip in (contact.geom1, contact.geom2):
                mujoco.mj_contactForce(self.model, data, i, wrench)
                force = contact.frame.reshape(3, 3).T @ wrench[:3]
                arm = contact.pos - data.geom_xpos[self.tip]
                total += np.cross(arm, force if contact.geom1 == self.tip else -force)
        return total


def draws(rng, slides):
    """Friction, damping, spring (half of them none): a slide's in N, N s/m, N/m."""
    friction = rng.uniform(0.03, 0.12) * (10 if slides else 1)
    damping = friction * rng.uniform(0.1, 0.8) * (10 if slides else 1)
    spring = rng.uniform(0.06, 0.3) * (100 if slides else 1) if rng.random() < 0.5 else 0.0
    return friction, damping, spring


def joint_text(name, kind, axis, at, law, span):
    friction, damping, spring = law
    return (f'<joint name="{name}" type="{kind}" axis="{axis[0]} {axis[1]} {axis[2]}" pos="{at[0]} {at[1]} {at[2]}" '
            f'frictionloss="{friction}" damping="{damping}" stiffness="{spring}" limited="true" '
            f'range="{span[0]} {span[1]}" solreflimit="0.004 1" {DRY}/>')


def one_joint(rng, kind):
    """A leaf on a fixed post, its joint's frame turned about the vertical."""
    slides = kind in ("rail", "chute")
    yaw = rng.uniform(-np.pi, np.pi)
    q = w.quat_about([0, 0, 1], yaw)
    turn = w.matrix_of(q)
    post = np.r_[0.05, 0.05, rng.uniform(0.1, 0.14)]
    half = np.r_[rng.uniform(0.05, 0.09), rng.uniform(0.006, 0.012), rng.uniform(0.03, 0.06)]
    if kind in ("lid", "chute"):
        half = half[[0, 2, 1]]
    hinge = np.r_[post[0] + 0.004, rng.uniform(-0.02, 0.02), rng.uniform(0.0, 0.03)]
    centre = hinge + [half[0] + 0.003, 0, 0]
    mass = rng.uniform(0.05, 0.25)
    friction, damping, spring = draws(rng, slides)
    axis, span = {"door": ([0, 0, 1.0], [-0.9, 0.9]), "lid": ([0, -1.0, 0], [0, 1.1]),
                  "rail": ([1.0, 0, 0], [-0.002, 0.05]), "chute": ([np.cos(0.4), 0, np.sin(0.4)], [-0.002, 0.05])}[kind]
    axis = np.array(axis)
    if kind == "lid" and rng.random() < 0.5:
        spring = 0.0
    if kind == "chute":
        friction += 1.4 * mass * w.G * axis[2]
    if kind == "lid":
        friction += 1.2 * mass * w.G * half[0]
    text = joint_text("joint", "slide" if slides else "hinge", axis, hinge - centre, (friction, damping, spring), span)
    bodies = (f'<body name="post" pos="0 0 {post[2]}" quat="{q[0]} 0 0 {q[3]}">{w.box_geom("post", post, 5.0)}'
              f'<body name="leaf" pos="{centre[0]} {centre[1]} {centre[2]}">{text}'
              f'{w.box_geom("leaf", half, mass)}</body></body>')
    world = World(bodies, w.pair("tip", "leaf", 0.3) + w.pair("tip", "post", 0.3), rng)
    both, home = ["post", "leaf"], np.r_[0, 0, post[2]]
    place = lambda p: home + turn @ p  # noqa: E731
    way = (lambda q: axis * q) if slides else None

    def moved(point, q):
        """A point of the leaf (post's frame) after the joint moved by q."""
        return point + way(q) if slides else hinge + w.matrix_of(w.quat_about(axis, q)) @ (point - hinge)

    by = ["grip", "poke", "both"][rng.integers(3)]
    hand = centre + [0.8 * half[0], 0, 0]
    done, ends = [], [False, False]
    scale = 0.1 if slides else 1.0
    for i, pace in enumerate(SPEEDS):
        pace *= scale * rng.uniform(0.8, 1.2)
        most = span[1] * rng.uniform(0.6, 0.9)
        far = most if kind != "door" or rng.random() < 0.5 else -most
        if i == 1 and rng.random() < 0.5:
            far = 1.06 * span[1]
            ends[1] = True
        gripped = by == "grip" or by == "both" and i % 2 == 0
        if gripped:
            time = abs(far) / pace
            go = [(0.6 + time * s, turn @ (moved(hand, far * s) - hand)) for s in np.linspace(0, 1, 60)]
            back = [(0.9 + time * (2 - s), turn @ (moved(hand, far * s) - hand)) for s in np.linspace(1, 0.05, 60)]
            path = [(0.35, np.zeros(3)), *go, *back, (1.2 + 2 * time, back[-1][1])]
            record = world.grip(both, "leaf", hand - centre, path, True, 3000.0)
            done.append((f"pull-{i:02d}", "pull", "leaf", record))
            continue
        # The finger follows the face's own arc, on the side that it drives.
        side = np.sign(far)
        if slides:
            face, off = centre - axis * 0, -np.r_[half[0], 0, 0] - [w.TIP, 0, 0]
            # A slide is pushed by a peg's side: its outer end, back in, from where it was drawn out to.
            face, off = centre + [half[0], 0, 0], np.r_[w.TIP, 0, 0]
        elif kind == "lid":
            face, off = hand - [0, 0, half[2]], np.r_[0, 0, -w.TIP]
        else:
            face, off = hand - [0, side * half[1], 0], np.r_[0, -side * w.TIP, 0]
        start = 0.0
        if slides:
            start, far = 0.9 * span[1], 0.1 * span[1]
        data = world.fresh()
        data.qpos[world.model.joint("joint").qposadr[0]] = start
        time = abs(far - start) / pace
        away = off / np.linalg.norm(off)
        tip = lambda q: place(moved(face + off, q))  # noqa: E731
        ready = tip(start) + turn @ away * 0.01
        path = [(0, ready), (0.4, ready), (0.55, tip(start))]
        path += [(0.55 + time * s, tip(start + (far - start) * s)) for s in np.linspace(0.02, 1, 60)]
        path += [(0.7 + time, path[-1][1]), (0.9 + time, path[-1][1] + turn @ away * 0.02)]
        done.append((f"push-{i:02d}", "push", "leaf", world.finger(both, path, data)))
    if kind in ("lid", "rail", "chute"):
        ends[0] = False
    joint = {"a": "post", "b": "leaf", "type": "prismatic" if slides else "revolute", "axis": (turn @ axis).tolist(),
             "friction": friction, "damping": damping}
    if not slides:
        joint["origin"] = place(hinge).tolist()
    if spring:
        joint["stiffness"] = spring
    truth = {"joints": [joint], "relations": {"post|leaf": [0, 1] if slides else [1, 0]}, "causes": [],
             "bodies": {}}
    quat = [0, 0, q[3], q[0]]
    meshes = {"post": (box_mesh(post), [*home, *quat]), "leaf": (box_mesh(half), [*place(centre), *quat])}
    return done, truth, meshes


def chain(rng, _):
    """Two links on a post, hinged about verticals and bent at first; the outer one is led by its tip, then the inner one
    is pulled."""
    post, high = np.r_[0.05, 0.05, 0.1], 0.15
    halves = [np.r_[rng.uniform(0.05, 0.08), 0.012, 0.012] for _ in range(2)]
    laws = [(rng.uniform(0.03, 0.08), rng.uniform(0.004, 0.03), 0.0) for _ in range(2)]
    hinges = [np.r_[0.056, 0, high - post[2]], np.r_[2 * halves[0][0] + 0.006, 0, 0]]
    middles = [h + np.r_[half[0] + 0.003, 0, 0] for h, half in zip(hinges, halves)]
    texts = [joint_text(f"j{i}", "hinge", [0, 0, 1], np.r_[-halves[i][0] - 0.003, 0, 0], laws[i], [-2, 2]) for i in range(2)]
    bent = w.quat_about([0, 0, 1], rng.uniform(0.8, 1.2))
    inner = hinges[1] - np.r_[halves[0][0] + 0.003, 0, 0] + w.matrix_of(bent) @ [halves[1][0] + 0.003, 0, 0]
    bodies = (f'<body name="post" pos="0 0 {post[2]}">{w.box_geom("post", post, 5.0)}'
              f'<body name="upper" pos="{middles[0][0]} 0 {middles[0][2]}">{texts[0]}{w.box_geom("upper", halves[0], 0.1)}'
              f'<body name="fore" pos="{inner[0]} {inner[1]} 0" '
              f'quat="{bent[0]} 0 0 {bent[3]}">{texts[1]}{w.box_geom("fore", halves[1], 0.08)}</body></body></body>')
    world = World(bodies, "", rng)
    names, done = ["post", "upper", "fore"], []
    for i in range(6):
        name = "fore" if i < 4 else "upper"
        half = halves[1] if i < 4 else halves[0]
        side = 1 if i % 2 == 0 else -1
        way = np.r_[rng.uniform(-0.6, 0.3), side, 0] if i < 4 else np.r_[0, side, 0]
        reach = way / np.linalg.norm(way) * rng.uniform(0.05, 0.09) * (1 if i < 4 else 0.5)
        time = np.linalg.norm(reach) / [0.03, 0.06, 0.1, 0.15, 0.05, 0.1][i]
        path = [(0.35, np.zeros(3)), (0.6, np.zeros(3)), (0.6 + time, reach), (0.9 + time, reach), (0.9 + 2 * time, 0.05 * reach),
                (1.2 + 2 * time, 0.05 * reach)]
        done.append((f"pull-{i:02d}", "pull", name, world.grip(names, name, np.r_[0.7 * half[0], 0, 0], path, True, 3000.0)))
    starts = [np.r_[0, 0, post[2]] + hinges[0], np.r_[0, 0, post[2]] + hinges[0] + hinges[1]]
    pairs = [("post", "upper"), ("upper", "fore")]
    joints = [{"a": a, "b": b, "type": "revolute", "axis": [0, 0, 1], "origin": start.tolist(), "friction": law[0],
               "damping": law[1]} for (a, b), start, law in zip(pairs, starts, laws)]
    truth = {"joints": joints, "relations": {"post|upper": [1, 0], "upper|fore": [1, 0]}, "causes": [], "bodies": {}}
    at = [np.r_[0, 0, post[2]] + middles[0], np.r_[0, 0, post[2]] + middles[0] + inner]
    turns = [[0, 0, 0, 1], [0, 0, 0, 1], [0, 0, bent[3], bent[0]]]
    meshes = {n: (box_mesh(h), [*p, *q]) for n, h, p, q in zip(names, [post, *halves], [[0, 0, post[2]], *at], turns)}
    return done, truth, meshes


def loose(rng, _):
    """Two boxes side by side, touching or nearly, neither held to the other; each is pushed, one through the other."""
    halves = [np.r_[rng.uniform(0.025, 0.04, 2), rng.uniform(0.015, 0.03)] for _ in range(2)]
    gap, mu = rng.choice([0.0005, 0.003]), rng.uniform(0.2, 0.5)
    at = [np.r_[0, 0, halves[0][2]], np.r_[halves[0][0] + gap + halves[1][0], rng.uniform(-0.01, 0.01), halves[1][2]]]
    names = ["left", "right"]
    bodies = "".join(f'<body name="{n}" pos="{p[0]} {p[1]} {p[2]}"><freejoint/>{w.box_geom(n, h, rng.uniform(0.1, 0.4))}</body>'
                     for n, p, h in zip(names, at, halves))
    pairs = "".join(w.pair("table", n, mu) + w.pair("tip", n, 0.3) for n in names) + w.pair("left", "right", 0.3)
    world = World(bodies, pairs, rng)
    done = []
    ways = [("left", [1, 0]), ("right", [0, 1]), ("right", [-1, 0]), ("left", [0, -1])]
    for i, (name, way) in enumerate(ways):
        k, way = names.index(name), np.r_[way, 0.0]
        start = at[k] - way * (halves[k] @ np.abs(way) + w.TIP + 0.012)
        start[2] = halves[k][2]
        path = w.push_path(start, way, rng.uniform(0.04, 0.06), rng.uniform(0.03, 0.05))
        done.append((f"push-{i:02d}", "push", name, world.finger(names, path)))
    truth = {"relations": {"left|right": "separate"}, "causes": [], "bodies": {}}
    return done, truth, {n: (box_mesh(h), [*p, 0, 0, 0, 1]) for n, h, p in zip(names, halves, at)}


KINDS = dict(door=one_joint, lid=one_joint, rail=one_joint, chute=one_joint, chain=chain, loose=loose)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--kind", choices=list(KINDS), required=True)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rng = np.random.default_rng([options.seed, list(KINDS).index(options.kind), 3])
    level = LEVELS[options.seed % 3]
    w.NOISE.update(position=level[0], rotation=level[1], force=level[2], torque=level[3])
    done, truth, meshes = KINDS[options.kind](rng, options.kind)
    out = options.out
    (out / "meshes").mkdir(parents=True, exist_ok=True)
    bodies = []
    for name, (mesh, pose) in meshes.items():
        (out / "meshes" / f"{name}.obj").write_text(mesh)
        bodies.append(dict(name=name, mesh=f"meshes/{name}.obj", pose=[float(x) for x in pose]))
    capture = {"format": "palpate-capture/1", "name": f"{options.kind}-{options.seed}", "gravity": [0, 0, -w.G],
               "support": {"point": [0, 0, 0], "normal": [0, 0, 1], "material": "wood"}, "bodies": bodies,
               "interactions": [w.write_interaction(out, *trial, False) for trial in done], "truth": "truth.json"}
    (out / "capture.json").write_text(json.dumps(capture, indent=1))
    (out / "truth.json").write_text(json.dumps(truth, indent=1))


if __name__ == "__main__":
    main()
