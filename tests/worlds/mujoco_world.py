#!/usr/bin/env python3
"""Makes captures with MuJoCo as the world: a judge that shares no physics with the estimators.

    python mujoco_world.py OUT --kind tin|pad|stack|glued|hinge|bars|drawer --seed N [--views]
    python mujoco_world.py OUT --kind tin|pad|hinge|drawer|toss|ball --seed N --hide CAUSE[:STRENGTH][,CAUSE...] [--views]

Needs `mujoco` and `numpy` only. OUT becomes a capture folder (format palpate-capture/1) with the right
answers in truth.json beside it. Masses, frictions, sizes, stiffnesses, joint axes and the noise are drawn
from the seed. Friction is regularised Coulomb (static = kinetic). With --views the scene is rendered by
MuJoCo (MUJOCO_GL=egl or osmesa) or, without a graphics library, ray-cast. With --hide the scene has a richer
protocol and an effect that a plain model lacks (or `none`), told in truth.json alone; shapes are known, or with
--views (tin, pad, hinge, drawer) seen only.
"""
import argparse
import bisect
import json
import os
import pathlib
import struct
import zlib

import numpy as np

os.environ.setdefault("MUJOCO_GL", "egl")
import mujoco  # noqa: E402

STEP = 0.00025  # s
FORCE_EVERY = 8  # 500 Hz
TRACK_EVERY = 33  # 121 Hz
G = 9.80665
TIP = 0.008  # m, radius of the finger
NOISE = dict(force=0.03, torque=0.002, tool=5e-5, position=4e-4, rotation=4e-3)
CAMERA = dict(name="wrist", width=320, height=240, fx=300.0, fy=300.0, cx=159.5, cy=119.5,
              depth_unit=0.001, depth_min=0.1, depth_max=3.0)


def quat_multiply(a, b):
    """Product of two quaternions, scalar first."""
    out = np.zeros(4)
    mujoco.mju_mulQuat(out, np.asarray(a, float), np.asarray(b, float))
    return out


def quat_about(axis, angle):
    """Quaternion (scalar first) of a turn about a unit axis."""
    return np.r_[np.cos(angle / 2), np.sin(angle / 2) * np.asarray(axis, float)]


def matrix_of(quat):
    """Rotation matrix of a quaternion, scalar first."""
    out = np.zeros(9)
    mujoco.mju_quat2Mat(out, np.asarray(quat, float))
    return out.reshape(3, 3)


class World:
    """One scene: its MJCF, its noise, and the recorder of interactions."""

    tip_springs = (1500, 4000)  # N/m, of the springs that carry its tip
    twists = False  # whether a tin is lifted once more and twisted

    def __init__(self, bodies, pairs, rng, gravity_comp_tip=True, extra=""):
        self.rng = rng
        self.xml = f"""<mujoco>
<compiler angle="radian"/>
<option timestep="{STEP}" gravity="0 0 -{G}" cone="elliptic" impratio="20" integrator="implicitfast"
        solver="Newton" iterations="60" tolerance="1e-12" noslip_iterations="0"/>
<visual><global offwidth="640" offheight="480"/><quality shadowsize="1024"/><map znear="0.02" zfar="20"/></visual>
<default><geom solref="0.003 1" solimp="0.95 0.99 0.0005" condim="4" contype="0" conaffinity="0"/></default>
<worldbody>
<light pos="0.3 -0.2 2" dir="-0.1 0.1 -1" diffuse="0.7 0.7 0.7"/>
<geom name="table" type="plane" size="3 3 0.1" rgba="0.55 0.45 0.38 1"/>
{bodies}
 <body name="tip" gravcomp="1"><joint name="tx" type="slide" axis="1 0 0" stiffness="{{k}}" damping="{{b}}"/>
 <joint name="ty" type="slide" axis="0 1 0" stiffness="{{k}}" damping="{{b}}"/>
 <joint name="tz" type="slide" axis="0 0 1" stiffness="{{k}}" damping="{{b}}"/>
 <geom name="tip" type="sphere" size="{TIP}" mass="0.02" rgba="0.2 0.2 0.2 0"/></body>
</worldbody>
<contact>{pairs}</contact>{extra}
</mujoco>"""
        k = rng.uniform(*self.tip_springs)
        self.xml = self.xml.format(k=k, b=2 * np.sqrt(0.02 * k))
        self.model = mujoco.MjModel.from_xml_string(self.xml)
        self.tip = self.model.geom("tip").id
        self.tip_body = self.model.body("tip").id
        self.tip_at = slice(self.model.joint("tx").qposadr[0], self.model.joint("tx").qposadr[0] + 3)

    def aim(self, place):
        """Where the springs that carry the finger's tip pull it. (A tip on a mocap body would have no velocity in contacts.)"""
        self.model.qpos_spring[self.tip_at] = place

    def put(self, data, place):
        """The finger there, at rest."""
        self.aim(place)
        data.qpos[self.tip_at] = place
        data.qvel[self.model.joint("tx").dofadr[0]:][:3] = 0

    def place(self, data):
        """Puts the bodies where the next interaction, or the camera before them all, finds them."""

    def fresh(self, settle=0.4):
        """The scene at rest, the finger far away."""
        data = mujoco.MjData(self.model)
        self.put(data, [0, 0, 1])
        mujoco.mj_forward(self.model, data)
        for _ in range(int(settle / STEP)):
            mujoco.mj_step(self.model, data)
        data.time = 0.0
        return data

    def finger_force(self, data):
        """What the finger exerts on whatever it touches, world axes."""
        total = np.zeros(3)
        wrench = np.zeros(6)
        for i in range(data.ncon):
            contact = data.contact[i]
            if self.tip not in (contact.geom1, contact.geom2):
                continue
            mujoco.mj_contactForce(self.model, data, i, wrench)
            force = contact.frame.reshape(3, 3).T @ wrench[:3]
            total += force if contact.geom1 == self.tip else -force
        return total

    def finger_torque(self, data):
        """The moment of the same about the middle of its tip, where the sensor gives it: what rubs at its surface turns it."""
        total, wrench = np.zeros(3), np.zeros(6)
        for i in range(data.ncon):
            contact = data.contact[i]
            if self.tip not in (contact.geom1, contact.geom2):
                continue
            mujoco.mj_contactForce(self.model, data, i, wrench)
            force, moment = wrench.reshape(2, 3) @ contact.frame.reshape(3, 3)
            about = moment + np.cross(contact.pos - data.xpos[self.tip_body], force)
            total += about if contact.geom1 == self.tip else -about
        return total

    def track_row(self, data, body, turn=None):
        """A noisy pose of a body, `x y z qx qy qz qw`."""
        position, quat = data.xpos[body].copy(), data.xquat[body].copy()
        if turn is not None:
            position, quat = matrix_of(turn) @ position, quat_multiply(turn, quat)
        wobble = self.rng.normal(0, NOISE["rotation"], 3)
        angle = np.linalg.norm(wobble)
        quat = quat_multiply(quat_about(wobble / angle, angle), quat)
        quat *= np.sign(quat[0]) or 1.0
        position += self.rng.normal(0, NOISE["position"], 3)
        return [*position, quat[1], quat[2], quat[3], quat[0]]

    def run(self, data, duration, tracked, drive, observe, turn=None):
        """Steps the world; `drive(t, data)` acts, `observe(data)` gives force and tool position."""
        force, tool, tracks = [], [], {name: [] for name in tracked}
        summed, held = np.zeros(6), 0
        for i in range(int(round(duration / STEP))):
            t = i * STEP
            drive(t, data)
            if i % TRACK_EVERY == 0:
                for name in tracked:
                    orientation = turn(t) if turn else None
                    tracks[name].append([t, *self.track_row(data, self.model.body(name).id, orientation)])
            mujoco.mj_step(self.model, data)
            reading = observe(data)
            if reading is None:
                continue
            wrench, position = reading
            summed, held = summed + wrench, held + 1
            if i % FORCE_EVERY == 0:
                noise = np.r_[self.rng.normal(0, NOISE["force"], 3), self.rng.normal(0, NOISE["torque"], 3)]
                force.append([t, *(summed / held + noise)])
                tool.append([t, *(position + self.rng.normal(0, NOISE["tool"], 3)), 0, 0, 0, 1])
                summed, held = np.zeros(6), 0
        return dict(force=force, tool=tool, tracks=tracks)

    def finger(self, tracked, waypoints, data=None):
        """The finger follows `[(time, position), ...]` linearly; force is read from its contacts."""
        data = data or self.fresh()
        times = [w[0] for w in waypoints]
        places = np.array([w[1] for w in waypoints])
        self.put(data, places[0])
        mujoco.mj_forward(self.model, data)

        def drive(t, data):
            i = min(max(bisect.bisect_right(times, t), 1), len(times) - 1)
            share = min(max((t - times[i - 1]) / (times[i] - times[i - 1]), 0.0), 1.0)
            self.aim(places[i - 1] + share * (places[i] - places[i - 1]))

        def observe(data):
            return np.r_[self.finger_force(data), self.finger_torque(data)], data.xpos[self.tip_body]

        return self.run(data, times[-1], tracked, drive, observe)

    def grip(self, tracked, body, point, waypoints, pivot, stiffness=4000.0, twist=None):
        """A tool that holds `point` of `body` (body frame) and follows `[(time, offset), ...]` from 0.35 s on, turned about the
        vertical by `twist(time)`."""
        data = self.fresh()
        b = self.model.body(body).id
        place = lambda d: d.xpos[b] + d.xmat[b].reshape(3, 3) @ point  # noqa: E731
        start, upright = place(data).copy(), data.xquat[b].copy()
        times = [w[0] for w in waypoints]
        offsets = np.array([w[1] for w in waypoints])
        mass = self.model.body_subtreemass[b]
        wrench = np.zeros(6)

        def drive(t, data):
            wrench[:] = 0
            if t >= times[0]:
                goal = start + [np.interp(t, times, offsets[:, k]) for k in range(3)]
                spin = np.zeros(6)
                mujoco.mj_objectVelocity(self.model, data, mujoco.mjtObj.mjOBJ_XBODY, b, spin, 0)
                arm = place(data) - data.xpos[b]
                speed = spin[3:] + np.cross(spin[:3], arm)
                wrench[:3] = stiffness * (goal - place(data)) - 2 * np.sqrt(stiffness * mass) * speed
                if not pivot:
                    turn, vector = np.zeros(4), np.zeros(3)
                    mujoco.mju_negQuat(turn, data.xquat[b])
                    aim = quat_multiply(quat_about([0, 0, 1], twist(t)), upright) if twist else upright
                    mujoco.mju_quat2Vel(vector, quat_multiply(aim, turn), 1.0)
                    inertia = mass * 0.03**2
                    wrench[3:] = 4.0 * vector - 2 * np.sqrt(4.0 * inertia) * spin[:3]
            data.xfrc_applied[b, :3] = wrench[:3]
            data.xfrc_applied[b, 3:] = wrench[3:] + np.cross(place(data) - data.xipos[b], wrench[:3])

        return self.run(data, times[-1], tracked, drive, lambda d: (wrench.copy(), place(d)))

    def tilt(self, tracked, rate, limit, azimuth):
        """The support turns about a horizontal axis through the origin until the limit; quasi-static."""
        data = self.fresh()
        axis = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
        angle = lambda t: min(max(t - 0.4, 0.0) * rate, limit)  # noqa: E731
        turn = lambda t: quat_about(axis, angle(t))  # noqa: E731

        def drive(t, _):
            self.model.opt.gravity[:] = matrix_of(turn(t)).T @ [0, 0, -G]

        record = self.run(data, 0.4 + limit / rate, tracked, drive, lambda d: None, turn)
        self.model.opt.gravity[:] = [0, 0, -G]
        stamps = [row[0] for row in next(iter(record["tracks"].values()))]
        record["support"] = [[t, *(matrix_of(turn(t)) @ [0, 0, 1])] for t in stamps]
        return record


def push_path(start, direction, travel, speed, rest=0.4, back=0.012):
    """Rest, straight push, short stop, retreat, rest."""
    start, direction = np.asarray(start, float), np.asarray(direction, float) / np.linalg.norm(direction)
    end = start + direction * travel
    t1 = rest + travel / speed
    return [(0, start), (rest, start), (t1, end), (t1 + 0.15, end), (t1 + 0.35, end - direction * back),
            (t1 + 0.35 + rest, end - direction * back)]


def lift_path(height, speed=0.08):
    """Rest (not yet held until 0.35 s), up, hold."""
    up = height / speed
    return [(0.35, [0, 0, 0]), (0.4, [0, 0, 0]), (0.4 + up, [0, 0, height]), (1.6 + up, [0, 0, height])]


def twist_path(height, angle=0.4, rate=1.3, count=3, speed=0.08):
    """Rest, up, hold, then to and fro about the vertical so many times (rate in Hz): offsets, and the angle by time."""
    start = 0.4 + height / speed + 0.6
    end = start + count / rate
    turn = lambda t: angle * np.sin(2 * np.pi * rate * (min(max(t, start), end) - start))  # noqa: E731
    return [*lift_path(height, speed)[:-1], (end + 0.3, [0, 0, height])], turn


def box_geom(name, half, mass, at=(0, 0, 0), color="0.7 0.3 0.3 1"):
    size, place = " ".join(map(str, half)), " ".join(map(str, at))
    return f'<geom name="{name}" type="box" size="{size}" pos="{place}" mass="{mass}" rgba="{color}"/>'


def pair(a, b, mu, torsion=1e-5):
    """A contact with its own friction (elsewhere MuJoCo would take the larger of two)."""
    return (f'<pair geom1="{a}" geom2="{b}" condim="4" friction="{mu} {mu} {torsion} 0 0" solref="0.003 1" '
            f'solimp="0.95 0.99 0.0005"/>')


def tin(rng):
    """A single cylinder or box: tilt, lift, pushes from four sides."""
    mass, mu, tool_mu = rng.uniform(0.1, 1.0), rng.uniform(0.15, 0.6), rng.uniform(0.1, 0.5)
    round_ = rng.random() < 0.5
    half_height, yaw = rng.uniform(0.015, 0.03), rng.uniform(-0.6, 0.6)
    place = np.r_[rng.uniform(-0.03, 0.03, 2), half_height]
    if round_:
        half = np.r_[[rng.uniform(0.03, 0.05)] * 2, half_height]
        geom = f'<geom name="tin" type="cylinder" size="{half[0]} {half_height}" mass="{mass}" rgba="0.7 0.3 0.3 1"/>'
        inertia = [mass * (3 * half[0]**2 + (2 * half_height)**2) / 12] * 2 + [mass * half[0]**2 / 2]
    else:
        half = np.r_[rng.uniform(0.03, 0.055, 2), half_height]
        geom = box_geom("tin", half, mass)
        inertia = [mass * (half[1]**2 + half[2]**2) / 3, mass * (half[0]**2 + half[2]**2) / 3,
                   mass * (half[0]**2 + half[1]**2) / 3]
    quat = quat_about([0, 0, 1], yaw)
    bodies = (f'<body name="tin" pos="{place[0]} {place[1]} {place[2]}" quat="{quat[0]} 0 0 {quat[3]}"><freejoint/>'
              f'{geom}</body>')
    world = World(bodies, pair("table", "tin", mu) + pair("tip", "tin", tool_mu), rng)
    done = [("tilt-00", "tilt", "tin", world.tilt(["tin"], 0.12, np.arctan(mu) + 0.12, rng.uniform(-np.pi, np.pi)))]
    point = np.r_[0, 0, half_height]
    done.append(("lift-00", "lift", "tin", world.grip(["tin"], "tin", point, lift_path(0.08), False)))
    rotation = matrix_of(quat)[:2, :2]
    for i in range(6):
        side = rng.integers(4) if i > 3 else i
        inward = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])[side]
        offset = rng.uniform(-0.5, 0.5) * 0.4 * half[0] * np.array([-inward[1], inward[0]])
        reach = half[abs(inward[1])] + TIP + 0.012
        start = place[:2] + rotation @ (offset - inward * reach)
        path = push_path(np.r_[start, half_height], np.r_[rotation @ inward, 0], rng.uniform(0.045, 0.065),
                         rng.uniform(0.025, 0.06))
        done.append((f"push-{i:02d}", "push", "tin", world.finger(["tin"], path)))
    held = {"push-04", "push-05"}
    truth = {"bodies": {"tin": {"mass": mass, "friction_static": mu, "friction_kinetic": mu, "com": [0, 0, 0],
                                "inertia": [*inertia, 0, 0, 0]}}, "causes": []}
    return world, done, held, truth


def pad(rng):
    """A plate on a vertical spring, pressed three or four times."""
    stiffness, damping = np.exp(rng.uniform(np.log(500), np.log(5000))), rng.uniform(1, 8)
    half, height, mass = rng.uniform(0.03, 0.05), rng.uniform(0.05, 0.08), 0.02
    sag = mass * G / stiffness
    bodies = (f'<body name="pad" pos="0 0 {height}" gravcomp="0"><joint name="spring" type="slide" axis="0 0 1" '
              f'stiffness="{stiffness}" damping="{damping}" springref="{sag}"/>'
              + box_geom("pad", [half, half, height / 2], mass, (0, 0, -height / 2), "0.3 0.5 0.8 1") + "</body>")
    world = World(bodies, pair("tip", "pad", 0.4), rng)
    done = []
    for i in range(4):
        depth = min(rng.uniform(3, 12) / stiffness, 0.008)
        at = np.r_[rng.uniform(-0.4, 0.4, 2) * half, height + TIP]
        speed = rng.uniform(0.004, 0.012)
        down = (0.006 + depth) / speed
        above, low = at + [0, 0, 0.006], at - [0, 0, depth]
        path = [(0, above), (0.4, above), (0.4 + down, low), (1.1 + down, low), (1.1 + 2 * down, above),
                (1.5 + 2 * down, above)]
        done.append((f"press-{i:02d}", "press", "pad", world.finger(["pad"], path)))
    return world, done, {"press-03"}, {"bodies": {"pad": {"stiffness": stiffness, "damping": damping}}, "causes": []}


def two_boxes(rng):
    low = np.r_[rng.uniform(0.03, 0.05, 2), rng.uniform(0.018, 0.028)]
    top = np.r_[low[:2] * rng.uniform(0.55, 0.95, 2), rng.uniform(0.015, 0.022)]
    shift = rng.uniform(-0.3, 0.3, 2) * (low[:2] - top[:2])
    return low, top, np.r_[shift, low[2] + top[2]], rng.uniform(0.2, 0.8), rng.uniform(0.1, 0.4)


def stack_trials(world, rng, low, top, shift):
    """Lift of the top, push of the lower, push of the top."""
    both = ["low", "top"]
    done = [("lift-00", "lift", "top", world.grip(both, "top", np.r_[0, 0, top[2]], lift_path(0.08), False))]
    azimuth = rng.choice([0, 1])
    for i, (name, half, centre) in enumerate([("low", low, np.r_[0, 0, low[2]]), ("low", low, np.r_[0, 0, low[2]]),
                                              ("top", top, np.r_[0, 0, low[2]] + shift)]):
        inward = np.array([[1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0], [0, -1.0, 0]])[(azimuth + i) % 4]
        reach = half[int(abs(inward[1]))] + TIP + 0.01
        path = push_path(centre - inward * reach, inward, rng.uniform(0.03, 0.05), rng.uniform(0.03, 0.05))
        done.append((f"push-{i:02d}", "push", name, world.finger(both, path)))
    return done


def stack(rng):
    """Two boxes, the upper one merely resting."""
    low, top, shift, low_mass, top_mass = two_boxes(rng)
    mu, between = rng.uniform(0.15, 0.6), rng.uniform(0.2, 0.6)
    bodies = (f'<body name="low" pos="0 0 {low[2]}"><freejoint/>{box_geom("low", low, low_mass)}</body>'
              f'<body name="top" pos="{shift[0]} {shift[1]} {low[2] + shift[2]}"><freejoint/>'
              f'{box_geom("top", top, top_mass, color="0.2 0.6 0.3 1")}</body>')
    pairs = pair("table", "low", mu) + pair("table", "top", mu) + pair("low", "top", between)
    world = World(bodies, pairs + pair("tip", "low", 0.3) + pair("tip", "top", 0.3), rng)
    truth = {"relations": {"low|top": "resting"}, "causes": [],
             "bodies": {"top": {"mass": top_mass}, "low": {"friction_kinetic": mu}}}
    return world, stack_trials(world, rng, low, top, shift), set(), truth


def glued(rng):
    """Two boxes that are one."""
    low, top, shift, low_mass, top_mass = two_boxes(rng)
    mu = rng.uniform(0.15, 0.6)
    bodies = (f'<body name="low" pos="0 0 {low[2]}"><freejoint/>{box_geom("low", low, low_mass)}'
              f'<body name="top" pos="{shift[0]} {shift[1]} {shift[2]}">'
              f'{box_geom("top", top, top_mass, color="0.2 0.6 0.3 1")}</body></body>')
    pairs = pair("table", "low", mu) + pair("tip", "low", 0.3) + pair("tip", "top", 0.3)
    world = World(bodies, pairs, rng)
    world.model.body_subtreemass[world.model.body("top").id] = low_mass + top_mass
    truth = {"relations": {"low|top": [0, 0]}, "causes": []}
    return world, stack_trials(world, rng, low, top, shift), set(), truth


def hinge(rng):
    """Two bars on the table, hinged about a vertical axis that need not pass through either track's origin."""
    base = np.r_[rng.uniform(0.045, 0.06), rng.uniform(0.022, 0.03), 0.02]
    arm = np.r_[rng.uniform(0.045, 0.06), rng.uniform(0.015, 0.022), 0.018]
    base_mass, arm_mass, mu = rng.uniform(0.4, 1.0), rng.uniform(0.1, 0.3), rng.uniform(0.2, 0.5)
    friction, damping = rng.uniform(0.0, 0.04), rng.uniform(0, 0.01)
    axis_at = np.r_[base[0] + 0.004, rng.uniform(-0.4, 0.4) * base[1], 0.02]
    centre = np.r_[axis_at[0] + arm[0] + 0.004, axis_at[1], 0.02]
    local = axis_at - centre
    bodies = (f'<body name="base" pos="0 0 0.02"><freejoint/>{box_geom("base", base, base_mass, color="0.8 0.7 0.1 1")}'
              f'<body name="arm" pos="{centre[0]} {centre[1]} 0"><joint name="hinge" type="hinge" axis="0 0 1" '
              f'pos="{local[0]} {local[1]} 0" frictionloss="{friction}" damping="{damping}" armature="1e-5"/>'
              f'{box_geom("arm", arm, arm_mass, color="0.1 0.6 0.2 1")}</body></body>')
    pairs = (pair("table", "base", mu) + pair("tip", "base", 0.3) + pair("tip", "arm", 0.3))
    world = World(bodies, pairs, rng)
    both, done = ["base", "arm"], []
    for i, (sign, share) in enumerate([(1, 0.75), (-1, 0.75), (0, 0), (1, 0.5), (-1, 0.6)]):
        speed = rng.uniform(0.04, 0.06)
        if sign == 0:
            start, way, name = np.r_[-base[0] - TIP - 0.012, 0, 0.02], [1, 0, 0], "base"
        else:
            x = axis_at[0] + share * 2 * arm[0]
            start, way, name = np.r_[x, centre[1] - sign * (arm[1] + TIP + 0.012), 0.02], [0, sign, 0], "arm"
        done.append((f"push-{i:02d}", "push", name,
                     world.finger(both, push_path(start, way, rng.uniform(0.05, 0.07), speed))))
    truth = {"joints": [{"a": "base", "b": "arm", "type": "revolute", "axis": [0, 0, 1], "origin": axis_at.tolist(),
                         "friction": friction, "damping": damping}],
             "bodies": {"base": {"mass": base_mass}, "arm": {"mass": arm_mass}},
             "relations": {"base|arm": [1, 0]}, "causes": []}
    return world, done, {"push-03"}, truth


def bars(rng):
    """Two bars, both flat on the table, hinged end to end: they chatter on their corners while one of them slides."""
    base = np.r_[rng.uniform(0.05, 0.065), rng.uniform(0.022, 0.03), 0.02]
    arm = np.r_[rng.uniform(0.045, 0.06), rng.uniform(0.015, 0.022), 0.02]
    base_mass, arm_mass, mu = rng.uniform(0.4, 0.8), rng.uniform(0.1, 0.25), rng.uniform(0.25, 0.5)
    friction, gap = rng.uniform(0.005, 0.04), rng.uniform(0.003, 0.012)
    axis_at = np.r_[base[0] + 0.5 * gap, 0, 0.02]
    middle = 0.5 * gap + arm[0]
    bodies = (f'<body name="base" pos="0 0 0.02"><freejoint/>{box_geom("base", base, base_mass, color="0.8 0.7 0.1 1")}'
              f'<body name="arm" pos="{axis_at[0]} 0 0"><joint name="hinge" type="hinge" axis="0 0 1" '
              f'frictionloss="{friction}" armature="1e-5"/>'
              f'{box_geom("arm", arm, arm_mass, (middle, 0, 0), "0.1 0.6 0.2 1")}</body></body>')
    pairs = (pair("table", "base", mu) + pair("table", "arm", mu) + pair("tip", "base", 0.3) + pair("tip", "arm", 0.3))
    world = World(bodies, pairs, rng)
    both, done = ["base", "arm"], []
    for i, (sign, share) in enumerate([(1, 0.8), (-1, 0.8), (0, 0), (1, 0.62)]):
        speed = rng.uniform(0.04, 0.055) if i < 3 else rng.uniform(0.07, 0.085)
        if sign == 0:
            start, way, name = np.r_[-base[0] - TIP - 0.012, 0, 0.02], [1, 0, 0], "base"
        else:
            x = axis_at[0] + 0.5 * gap + share * 2 * arm[0]
            start, way, name = np.r_[x, -sign * (arm[1] + TIP + 0.02), 0.02], [0, sign, 0], "arm"
        done.append((f"push-{i:02d}", "push", name, world.finger(both, push_path(start, way, rng.uniform(0.07, 0.09), speed))))
    truth = {"joints": [{"a": "base", "b": "arm", "type": "revolute", "axis": [0, 0, 1], "origin": axis_at.tolist(),
                         "friction": friction}],
             "bodies": {"base": {"mass": base_mass}, "arm": {"mass": arm_mass}},
             "relations": {"base|arm": [1, 0]}, "causes": []}
    return world, done, {"push-03"}, truth


def drawer(rng):
    """A heavy case with a drawer that slides out along a random horizontal direction, stops at both ends."""
    case = np.r_[rng.uniform(0.05, 0.07), rng.uniform(0.04, 0.055), 0.03]
    case_mass, mass, mu = rng.uniform(0.8, 1.5), rng.uniform(0.1, 0.3), rng.uniform(0.4, 0.6)
    friction, damping, reach = rng.uniform(0.1, 0.6), rng.uniform(0, 3.0), rng.uniform(0.04, 0.06)
    yaw = rng.uniform(-np.pi, np.pi)
    quat, rotation = quat_about([0, 0, 1], yaw), matrix_of(quat_about([0, 0, 1], yaw))
    thin = 0.004
    walls = [("floor", [case[0], case[1], thin], [0, 0, -case[2] + thin]),
             ("roof", [case[0], case[1], thin], [0, 0, case[2] - thin]),
             ("left", [case[0], thin, case[2]], [0, case[1] - thin, 0]),
             ("right", [case[0], thin, case[2]], [0, -case[1] + thin, 0]),
             ("back", [thin, case[1], case[2]], [-case[0] + thin, 0, 0])]
    geoms = "".join(box_geom(n, h, case_mass / 5, at, "0.5 0.5 0.6 1") for n, h, at in walls)
    half = np.r_[case[0] - 0.008, case[1] - 0.012, case[2] - 0.012]
    bodies = (f'<body name="case" pos="0 0 {case[2]}" quat="{quat[0]} 0 0 {quat[3]}"><freejoint/>{geoms}'
              f'<body name="drawer" pos="0.012 0 0"><joint name="slide" type="slide" axis="1 0 0" limited="true" '
              f'range="0 {reach}" frictionloss="{friction}" damping="{damping}" solreflimit="0.003 1"/>'
              f'{box_geom("drawer", half, mass, color="0.8 0.5 0.2 1")}</body></body>')
    pairs = pair("table", "floor", mu) + "".join(pair("tip", n, 0.3) for n, _, _ in walls) + pair("tip", "drawer", 0.3)
    world = World(bodies, pairs, rng)
    both, done = ["case", "drawer"], []
    out = rotation @ [1.0, 0, 0]
    point = np.r_[half[0], 0, 0]
    for i, share in enumerate([0.7, 1.15, 0.8]):
        travel, speed = share * reach, rng.uniform(0.03, 0.05)
        up, start = travel / speed, 0.4
        path = [(0.35, [0, 0, 0]), (start, [0, 0, 0]), (start + up, out * travel), (start + up + 0.3, out * travel)]
        if i != 1:
            path += [(start + 2 * up + 0.3, out * 0.004), (start + 2 * up + 0.7, out * 0.004)]
        done.append((f"pull-{i:02d}", "pull", "drawer", world.grip(both, "drawer", point, path, True, 3000.0)))
    side = rotation @ np.r_[0, 1.0, 0]
    for i, (way, reach_to) in enumerate([(side, case[1]), (-side, case[1])]):
        start = -way * (reach_to + TIP + 0.012) + [0, 0, case[2] * 0.6]
        path = push_path(start, way, rng.uniform(0.03, 0.045), rng.uniform(0.03, 0.05))
        done.append((f"push-{i:02d}", "push", "case", world.finger(both, path)))
    truth = {"joints": [{"a": "case", "b": "drawer", "type": "prismatic", "axis": out.tolist(), "friction": friction,
                         "limits": [0.0, reach], "damping": damping}],
             "relations": {"case|drawer": [0, 1]}, "causes": []}
    return world, done, {"pull-02"}, truth


def write_png(path, image):
    """8-bit RGB or 16-bit greyscale."""
    deep = image.dtype == np.uint16
    height, width = image.shape[:2]
    raw = image.astype(">u2") if deep else image
    rows = b"".join(b"\0" + raw[y].tobytes() for y in range(height))

    def chunk(tag, body):
        return struct.pack(">I", len(body)) + tag + body + struct.pack(">I", zlib.crc32(tag + body))

    head = struct.pack(">IIBBBBB", width, height, 16 if deep else 8, 0 if deep else 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 6))
                     + chunk(b"IEND", b""))


def look_at(eye, target):
    """World-from-camera, optical frame."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(forward, right), forward])


def shoot_rays(model, data, eye, rotation):
    """Depth and flat colour by ray casting, where no graphics library is there."""
    c = CAMERA
    u, v = np.meshgrid(np.arange(c["width"]), np.arange(c["height"]))
    rays = np.stack([(u - c["cx"]) / c["fx"], (v - c["cy"]) / c["fy"], np.ones_like(u, float)], -1).reshape(-1, 3)
    lengths = np.linalg.norm(rays, axis=1)
    world = (rays / lengths[:, None]) @ rotation.T
    depth, color = np.zeros(len(rays)), np.zeros((len(rays), 3), np.uint8)
    hit = np.zeros(1, np.int32)
    for i, ray in enumerate(world):
        distance = mujoco.mj_ray(model, data, eye, ray, None, 1, model.body("tip").id, hit)
        if distance > 0:
            depth[i] = distance / lengths[i]
            color[i] = 200 * model.geom_rgba[hit[0], :3]
    shape = (c["height"], c["width"])
    return depth.reshape(shape), color.reshape(*shape, 3)


def render(model, data, eye, rotation, renderers):
    """Depth (m) and colour from MuJoCo's renderer, or from rays."""
    if renderers is None:
        return shoot_rays(model, data, eye, rotation)
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
    camera.fixedcamid = 0
    model.cam_fovy[0] = np.degrees(2 * np.arctan(CAMERA["height"] / 2 / CAMERA["fy"]))
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, (rotation @ np.diag([1.0, -1, -1])).ravel())
    model.cam_pos[0], model.cam_quat[0] = eye, quat
    mujoco.mj_forward(model, data)
    out = []
    for renderer in renderers:
        renderer.update_scene(data, camera)
        out.append(renderer.render().copy())
    return out[1].astype(float), out[0]


def make_renderers(model):
    """A colour and a depth renderer, or nothing where no graphics library works."""
    try:
        pair_ = [mujoco.Renderer(model, CAMERA["height"], CAMERA["width"]) for _ in range(2)]
        pair_[1].enable_depth_rendering()
        return pair_
    except Exception as error:  # noqa: BLE001 - whatever the missing library raises
        print(f"no renderer ({error}); casting rays")
        return None


def take_views(world, out, rng, count=16):
    """Range images on three rings around the scene at rest."""
    model = mujoco.MjModel.from_xml_string(
        world.xml.replace("<worldbody>", '<worldbody><camera name="wrist" pos="0 0 1" resolution="320 240"/>'))
    data = mujoco.MjData(model)
    world.place(data)
    model.qpos_spring[world.tip_at] = data.qpos[world.tip_at] = [0, 0, 30]
    for _ in range(int(0.3 / STEP)):
        mujoco.mj_step(model, data)
    renderers = make_renderers(model)
    views = []
    (out / "views").mkdir(exist_ok=True)
    for i in range(count):
        around = 2 * np.pi * i / count + 0.1
        radius, height = [(0.42, 0.2), (0.34, 0.36), (0.2, 0.46)][i % 3]
        eye = np.r_[radius * np.cos(around), radius * np.sin(around), height]
        rotation = look_at(eye, np.array([0, 0, 0.03]))
        depth, color = render(model, data, eye, rotation, renderers)
        noisy = depth + rng.normal(0, 1, depth.shape) * 0.001 * depth**2
        counts = np.where((depth > 0.1) & (depth < 3), np.round(noisy / 0.001), 0).astype(np.uint16)
        write_png(out / f"views/{i:06d}.depth.png", counts)
        write_png(out / f"views/{i:06d}.color.png", color)
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, rotation.ravel())
        views.append(dict(camera="wrist", time=round(0.1 * i, 3), pose=[*eye, *quat[1:], quat[0]],
                          depth=f"views/{i:06d}.depth.png", color=f"views/{i:06d}.color.png"))
    return views


def write_rows(path, header, rows):
    path.write_text("\n".join([header] + [",".join(f"{x:.10g}" for x in row) for row in rows]) + "\n")


def write_interaction(out, name, kind, target, record, held):
    """The streams of one interaction, and its entry."""
    folder = out / "interactions" / name
    folder.mkdir(parents=True, exist_ok=True)
    here = f"interactions/{name}/"
    entry = {"name": name, "kind": kind, "target": target}
    if held:
        entry["held_out"] = True
    if len(record["force"]):
        write_rows(folder / "force.csv", "time,fx,fy,fz,tx,ty,tz", record["force"])
        write_rows(folder / "tool.csv", "time,x,y,z,qx,qy,qz,qw", record["tool"])
        entry |= {"force": here + "force.csv", "tool_path": here + "tool.csv",
                  "tool": {"shape": "sphere", "size": [TIP]}}
        if kind == "lift":
            entry["tool"]["grip"] = True
        if kind == "pull":
            entry["tool"]["pin"] = True
    if "support" in record:
        write_rows(folder / "support.csv", "time,nx,ny,nz", record["support"])
        entry["support_path"] = here + "support.csv"
    entry["tracks"] = {}
    for body, rows in record["tracks"].items():
        write_rows(folder / f"track.{body}.csv", "time,x,y,z,qx,qy,qz,qw", rows)
        entry["tracks"][body] = here + f"track.{body}.csv"
    return entry


KINDS = dict(tin=tin, pad=pad, stack=stack, glued=glued, hinge=hinge, bars=bars, drawer=drawer)


def write_hidden(options):
    """A capture with a hidden effect: of known shapes, or seen by a camera."""
    world = None
    if options.kind == "toss":
        import toss_world
        done, held, truth, meshes = toss_world.make(options.seed, options.hide)
    else:
        import hidden_scenes
        world, done, held, truth, meshes = hidden_scenes.make(options.kind, options.seed, options.hide)
    capture = {"format": "palpate-capture/1", "name": f"{options.kind}-{options.seed}", "gravity": [0, 0, -G],
               "support": {"point": [0, 0, 0], "normal": [0, 0, 1], "material": "wood"}}
    out = options.out
    out.mkdir(parents=True, exist_ok=True)
    if options.views:
        capture |= {"cameras": [CAMERA], "views": take_views(world, out, np.random.default_rng(options.seed))}
    else:
        (out / "meshes").mkdir(exist_ok=True)
        capture["bodies"] = []
        for name, (mesh, pose) in meshes.items():
            (out / "meshes" / f"{name}.obj").write_text(mesh)
            capture["bodies"].append(dict(name=name, mesh=f"meshes/{name}.obj", pose=[float(x) for x in pose]))
    capture["interactions"] = [write_interaction(out, *trial, trial[0] in held) for trial in done]
    write_capture(out, capture, truth)


def write_capture(out, capture, truth):
    capture["truth"] = "truth.json"
    (out / "capture.json").write_text(json.dumps(capture, indent=1))
    (out / "truth.json").write_text(json.dumps(truth, indent=1))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--kind", choices=[*KINDS, "toss", "ball"], required=True)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--firm-finger", action="store_true", help="its tip on springs of 15 to 30 kN/m, for 1.5 to 4")
    parser.add_argument("--twist", action="store_true", help="lift a tin with a hidden effect (or none) once more and twist it")
    parser.add_argument("--views", action="store_true")
    parser.add_argument("--hide", metavar="CAUSE[:STRENGTH]", help="hide effects in the world or its sensors")
    options = parser.parse_args()
    if options.firm_finger:
        import hidden_scenes  # whose `World` is that of the module, not of the script
        World.tip_springs = hidden_scenes.w.World.tip_springs = (15000, 30000)
    if options.twist:
        import hidden_scenes
        hidden_scenes.w.World.twists = True
    if options.kind == "toss":
        options.hide = options.hide or "none"
    if options.hide and options.views and options.kind in ("toss", "ball"):
        parser.error(f"a scene of kind {options.kind} has no views")
    if options.hide:
        return write_hidden(options)
    rng = np.random.default_rng([options.seed, list(KINDS).index(options.kind)])
    world, done, held, truth = KINDS[options.kind](rng)
    out = options.out
    out.mkdir(parents=True, exist_ok=True)
    entries = [write_interaction(out, *trial, trial[0] in held) for trial in done]
    capture = {"format": "palpate-capture/1", "name": f"{options.kind}-{options.seed}", "gravity": [0, 0, -G],
               "support": {"point": [0, 0, 0], "normal": [0, 0, 1], "material": "wood"}}
    if options.views:
        capture |= {"cameras": [CAMERA], "views": take_views(world, out, rng)}
    write_capture(out, capture | {"interactions": entries}, truth)


if __name__ == "__main__":
    main()
