"""Scenes with protocols rich enough that a hidden effect can show: a tin that is pushed, a pad that is pressed, a hinge
and a drawer that are pulled open and shut. The plain world has what a plain model says: even pressure under a level
base, one friction, a linear spring, an ideal joint with dry friction, honest sensors.
"""
import types

import mujoco
import numpy as np

import mujoco_world as w
from hidden_effects import EFFECTS, Effect

FINE = 0.0005  # s, step
FORCE_EVERY, TRACK_EVERY = 4, 20  # 500 Hz, 100 Hz


class Bench(w.World):
    """A world that effects act on, with one clock for the whole capture; noise is added when all is done."""

    def __init__(self, bodies, pairs, rng, effects, spec, extra=""):
        self.effects, self.spec, self.records = effects, spec, []
        self.clock, self.start, self.worn, self.act = 0.0, 0.0, 0.0, lambda t, data: None
        super().__init__(bodies, pairs, rng, extra=extra)
        self.model.opt.timestep, self.model.opt.impratio = FINE, 100
        self.model.opt.gravity[:] = spec["gravity"]
        self.tip_dofs = [self.model.joint(n).dofadr[0] for n in ("tx", "ty", "tz")]
        self.tip_model = self.model.body("tip").id

    def begin(self, kind, wait):
        """Opens the next interaction on the clock."""
        self.start = self.clock + wait
        index = sum(k == kind for _, k, *_ in self.records)
        for effect in self.effects:
            effect.begin(kind, index, self.start, wait)

    def fresh(self, settle=0.3):
        data = mujoco.MjData(self.model)
        self.put(data, [0, 0, 1])
        self.place(data)
        mujoco.mj_forward(self.model, data)
        for _ in range(int(settle / FINE)):
            mujoco.mj_step(self.model, data)
        data.qvel[:] = 0
        return data

    def run(self, data, duration, tracked, drive, observe, turn=None):
        force, tool, tracks, summed, held = [], [], {name: [] for name in tracked}, np.zeros(6), 0
        bodies = {name: self.model.body(name).id for name in tracked}
        for i in range(int(round(duration / FINE))):
            t = i * FINE
            drive(t, data)
            self.act(self.start + t, data)
            if i % TRACK_EVERY == 0:
                for name, body in bodies.items():
                    position, quat = data.xpos[body], data.xquat[body]
                    if turn is not None:
                        position, quat = w.matrix_of(turn(t)) @ position, w.quat_multiply(turn(t), quat)
                    tracks[name].append([self.start + t, *position, *quat])
            mujoco.mj_step(self.model, data)
            reading = observe(data)
            if reading is None:
                continue
            summed, held = summed + reading[0], held + 1
            if i % FORCE_EVERY == 0:
                force.append([self.start + t, *(summed / held)])
                tool.append([self.start + t, *reading[1]])
                summed, held = np.zeros(6), 0
        self.clock = self.start + duration
        return dict(force=np.array(force), tool=np.array(tool), tracks={k: np.array(v) for k, v in tracks.items()})

    def finger_force(self, data):
        return -data.qfrc_constraint[self.tip_dofs] + self.pull(data)

    def pull(self, _):
        """What sticks between finger and body, beyond contact."""
        return np.zeros(3)

    def keep(self, name, kind, target, record, heading=0.0):
        record["heading"] = heading
        self.records.append((name, kind, target, record))

    def finished(self):
        """The sensors: hidden faults, noise, faults that come after the noise; rows as they are written."""
        for effect in self.effects:
            if hasattr(effect, "prepare"):
                effect.prepare([(kind, record) for _, kind, _, record in self.records])
        for _, kind, _, record in self.records:
            for late in (False, True):
                if late:
                    self.add_noise(record)
                for effect in self.effects:
                    if effect.late == late:
                        effect.sense(record, kind, record["heading"])
            half = record["heading"] / 2
            record["tool"] = [[*row, 0, 0, np.sin(half), np.cos(half)] for row in record["tool"]]
            record["tracks"] = {n: [[*r[:4], *r[5:8], r[4]] for r in rows] for n, rows in record["tracks"].items()}
            record["force"] = list(record["force"])
        return [(name, kind, target, record) for name, kind, target, record in self.records]

    def add_noise(self, record):
        normal = self.rng.normal
        if len(record["force"]):
            record["force"][:, 1:4] += normal(0, w.NOISE["force"], record["force"][:, 1:4].shape)
            record["force"][:, 4:] += normal(0, w.NOISE["torque"], record["force"][:, 4:].shape)
            record["tool"][:, 1:] += normal(0, w.NOISE["tool"], record["tool"][:, 1:].shape)
        for rows in record["tracks"].values():
            rows[:, 1:4] += normal(0, w.NOISE["position"], (len(rows), 3))
            for row, wobble in zip(rows, normal(0, w.NOISE["rotation"], (len(rows), 3))):
                angle = np.linalg.norm(wobble)
                row[4:8] = w.quat_multiply(w.quat_about(wobble / angle, angle), row[4:8])
                row[4:8] *= (np.sign(row[4]) or 1.0) / np.linalg.norm(row[4:8])


def box_mesh(half, centre=(0, 0, 0)):
    """A box as OBJ text, faces outward."""
    corners = [np.array([sx, sy, sz]) * half + centre for sz in (-1, 1) for sy in (-1, 1) for sx in (-1, 1)]
    faces = ["1 3 4", "1 4 2", "5 6 8", "5 8 7", "1 2 6", "1 6 5", "3 7 8", "3 8 4", "1 5 7", "1 7 3", "2 4 8", "2 8 6"]
    return "".join("v %.9g %.9g %.9g\n" % tuple(c) for c in corners) + "".join(f"f {f}\n" for f in faces)


def drum_mesh(radius, half_height, count=64):
    """An upright cylinder as OBJ text."""
    around = 2 * np.pi * np.arange(count) / count
    lines = [f"v {radius * np.cos(a):.9g} {radius * np.sin(a):.9g} {z:.9g}" for z in (-half_height, half_height) for a in around]
    lines += [f"v 0 0 {-half_height}", f"v 0 0 {half_height}"]
    for i in range(count):
        a, b = i + 1, (i + 1) % count + 1
        lines += [f"f {a} {b} {b + count}", f"f {a} {b + count} {a + count}", f"f {2 * count + 1} {b} {a}",
                  f"f {2 * count + 2} {a + count} {b + count}"]
    return "\n".join(lines) + "\n"


def feet_of(half, round_, spread):
    """Nine points that carry alike, as far out as makes their torsion that of an even pressure (times `spread`)."""
    if round_:
        ring = [np.r_[np.cos(a), np.sin(a)] for a in 2 * np.pi * np.arange(8) / 8]
        # An even disc: mean distance 2/3 R; eight of nine points on a ring of 3/4 R.
        return spread * 0.75 * half[0] * np.array([[0, 0], *ring])
    grid = np.array([[x, y] for x in (-1, 0, 1) for y in (-1, 0, 1)]) * (2 / 3) * half[:2]
    x, y = np.meshgrid(*[(np.arange(200) + 0.5) / 100 - 1] * 2)
    even = np.hypot(x * half[0], y * half[1]).mean()
    return np.minimum(1.5, spread * even / np.hypot(*grid.T).mean()) * grid


# Heading of the finger in quarter turns of the body, along the face (share), speed, wait before, held out.
PUSHES = [(0, 0, 0.035, 5, 0), (2, 0, 0.035, 2, 0), (1, 0, 0.08, 2, 0), (3, 0.05, 0.08, 10, 0), (0, 0.4, 0.015, 2, 0),
          (2, -0.3, 0.16, 2, 0), (1, 0.35, 0.16, 30, 0), (3, 0, 0.015, 2, 0), (0, 0, 0.035, 60, 0), (2, 0.1, 0.08, 1, 0),
          (1, 0, 0.035, 10, 1), (0, -0.2, 0.10, 2, 1)]


def tin(rng, effects):
    """Weighed, tilted, and pushed to and fro over one spot of the table."""
    round_, half_height, yaw = rng.random() < 0.4, rng.uniform(0.015, 0.025), rng.uniform(-0.6, 0.6)
    half = np.r_[rng.uniform(0.03, 0.045, 2), half_height]
    if round_:
        half[1] = half[0]
    spec = dict(mass=rng.uniform(0.3, 1.0), mu=rng.uniform(0.2, 0.5), tool_friction=rng.uniform(0.36, 0.44), com=np.zeros(2),
                spread=1.0, gravity=np.r_[0, 0, -w.G], hidden_mass=0.0, yaw=1.0, added=0.0, loose=0.0)
    for effect in effects:
        effect.build(spec)
    mass, mu, com = spec["mass"], spec["mu"], spec["com"]
    feet = feet_of(half, round_, spec["spread"])
    if round_:
        shape = f'<geom name="tin" type="cylinder" size="{half[0]} {half_height}" rgba="0.7 0.3 0.3 1"/>'
        inertia = [mass * (3 * half[0]**2 + 4 * half_height**2) / 12] * 2 + [mass * half[0]**2 / 2]
    else:
        shape = w.box_geom("tin", half, 1)
        inertia = [mass * (half[1]**2 + half[2]**2) / 3, mass * (half[0]**2 + half[2]**2) / 3,
                   mass * (half[0]**2 + half[1]**2) / 3]
    inertia[2] = min(spec["yaw"] * inertia[2], 0.99 * (inertia[0] + inertia[1]))
    small = "".join(f'<geom name="foot{i}" type="sphere" size="0.002" pos="{x} {y} {0.002 - half_height}"/>'
                    for i, (x, y) in enumerate(feet))
    bodies = (f'<body name="tin" pos="0 0 {half_height}"><freejoint name="free"/><inertial pos="{com[0]} {com[1]} 0" mass="{mass * (1 - spec["loose"])}" '
              f'diaginertia="{inertia[0]} {inertia[1]} {inertia[2]}"/>{shape}{small}</body>')
    pairs = "".join(f'<pair name="under{i}" geom1="table" geom2="foot{i}" condim="3" friction="{mu} {mu} 0 0 0" '
                    f'solref="0.003 1" solimp="0.95 0.99 0.0005"/>' for i in range(len(feet)))
    heading = yaw
    if spec["hidden_mass"]:
        size, way = np.r_[0.012, 0.03, 0.012], np.r_[np.cos(heading), np.sin(heading)]
        at, q = way * (half[0] + 0.012 + rng.uniform(0.005, 0.015)), w.quat_about([0, 0, 1], heading)
        bodies += (f'<body name="unseen" pos="{at[0]} {at[1]} 0.012" quat="{q[0]} 0 0 {q[3]}"><freejoint/>'
                   + w.box_geom("unseen", size, spec["hidden_mass"]) + "</body>")
        pairs += w.pair("table", "unseen", mu) + w.pair("tin", "unseen", 0.2)
    bench = Bench(bodies, pairs + w.pair("tip", "tin", spec["tool_friction"]), rng, effects, spec)
    model, body = bench.model, bench.model.body("tin").id
    under = [model.pair(f"under{i}").id for i in range(len(feet))]
    free = model.joint("free")
    position, speed = free.qposadr[0], free.dofadr[0]
    if spec["added"]:
        model.dof_armature[speed:speed + 3] += spec["added"] * mass
        mujoco.mj_setConst(model, mujoco.MjData(model))
    pose = [np.zeros(2), 0.0]
    acting = any(type(e).friction is not Effect.friction or type(e).force is not Effect.force for e in effects)
    local = np.column_stack([feet, np.full(len(feet), -half_height)])

    def place(data):
        q = w.quat_about([0, 0, 1], pose[1])
        data.qpos[position:position + 7] = [*pose[0], half_height, *q]
        if spec["hidden_mass"] and not pushing[0]:
            unseen = model.body("unseen").jntadr[0]
            data.qpos[model.jnt_qposadr[unseen]:][:3] = [5, 5, 0.012]

    def loose_weight():
        """What is loose hangs on the tin whatever is done, along the gravity that there is."""
        return spec["loose"] * mass * bench.model.opt.gravity

    def act_held(_, data):
        data.xfrc_applied[body, :3] += loose_weight()

    def act(clock, data):
        if not acting:
            return
        data.xfrc_applied[body, :3] = loose_weight()
        turn = data.xmat[body].reshape(3, 3)
        velocity, spin = data.qvel[speed:speed + 3], turn @ data.qvel[speed + 3:speed + 6]
        arms = local @ turn.T
        c = types.SimpleNamespace(clock=clock, dt=FINE, worn=bench.worn, load=-mass * spec["gravity"][2])
        c.feet = (data.xpos[body] + arms)[:, :2]
        c.feet_velocity = (velocity + np.cross(spin, arms))[:, :2]
        c.place, c.velocity = data.xipos[body][:2], (velocity + np.cross(spin, data.xipos[body] - data.xpos[body]))[:2]
        c.on_table = data.xpos[body][2] < half_height + 0.002
        factor, total = np.ones(len(feet)), np.zeros(2)
        for effect in effects:
            factor = factor * effect.friction(c)
            push = effect.force(c) if c.on_table else None
            total = total if push is None else total + push
        model.pair_friction[under, 0] = model.pair_friction[under, 1] = np.maximum(mu * factor, 0.01)
        data.xfrc_applied[body, :2] += total
        if c.on_table:
            bench.worn += np.hypot(*c.velocity) * FINE * (np.hypot(*c.velocity) > 1e-3)

    bench.place, pushing = place, [False]
    azimuth = rng.uniform(-np.pi, np.pi)
    pose[1] = yaw
    bench.begin("tilt", 1.0)
    bench.act = act
    bench.keep("tilt-00", "tilt", "tin", tilted(bench, ["tin"], 0.12, np.arctan(1.3 * mu) + 0.08, azimuth))
    bench.begin("lift", 2.0)
    bench.act = act_held
    bench.keep("lift-00", "lift", "tin", bench.grip(["tin"], "tin", np.r_[0, 0, half_height], w.lift_path(0.06), False))
    bench.act, held, pushing[0] = act, set(), True
    for i, (side, share, pace, wait, check) in enumerate(PUSHES):
        quarter = np.pi / 2 * side
        inward = np.round([np.cos(quarter), np.sin(quarter)])
        pose[1] = yaw + (0.5 if i in (6, 9) else 0.0)
        turn = w.matrix_of(w.quat_about([0, 0, 1], pose[1]))[:2, :2]
        travel = rng.uniform(0.05, 0.06)
        reach = half[int(abs(inward[1]))] + w.TIP
        # The body crosses the same stretch of the table whichever way it goes.
        pose[0] = -turn @ inward * 0.022 + rng.normal(0, 0.003, 2)
        start = pose[0] + turn @ (share * half[0] * np.r_[-inward[1], inward[0]] - inward * (reach + 0.008))
        way = turn @ inward
        path = w.push_path(np.r_[start, half_height], np.r_[way, 0], travel, pace * rng.uniform(0.95, 1.05))
        bench.begin("push", wait)
        bench.keep(f"push-{i:02d}", "push", "tin", bench.finger(["tin"], path), float(np.arctan2(way[1], way[0])))
        if check:
            held.add(f"push-{i:02d}")
    pose[:], pushing[0] = [np.zeros(2), yaw], False
    if bench.twists:
        bench.begin("lift", 2.0)
        bench.act, (path, twist) = act_held, w.twist_path(0.06)
        grip = bench.grip(["tin"], "tin", np.r_[0, 0, half_height], path, False, twist=twist)
        bench.keep("lift-01", "lift", "tin", grip)
        bench.act = act
    truth = {"bodies": {"tin": {"mass": mass, "friction_static": mu, "friction_kinetic": mu, "com": [*map(float, com), 0],
                                "inertia": [*inertia, 0, 0, 0]}}}
    mesh = drum_mesh(half[0], half_height) if round_ else box_mesh(half)
    quat = w.quat_about([0, 0, 1], yaw)
    return bench, held, truth, {"tin": (mesh, [0, 0, half_height, 0, 0, quat[3], quat[0]])}


def tilted(bench, tracked, rate, limit, azimuth):
    """As `World.tilt`, with the gravity that there really is."""
    data = bench.fresh()
    axis = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    turn = lambda t: w.quat_about(axis, min(max(t - 0.4, 0.0) * rate, limit))  # noqa: E731

    def drive(t, _):
        bench.model.opt.gravity[:] = w.matrix_of(turn(t)).T @ bench.spec["gravity"]

    record = bench.run(data, 0.4 + limit / rate, tracked, drive, lambda d: None, turn)
    bench.model.opt.gravity[:] = bench.spec["gravity"]
    stamps = next(iter(record["tracks"].values()))[:, 0]
    record["support"] = [[t, *(w.matrix_of(turn(t - stamps[0])) @ [0, 0, 1])] for t in stamps]
    return record


# Share of the greatest depth, speed (m/s), hold (s), wait before (s), held out.
PRESSES = [(0.35, 0.006, 0.6, 2, 0), (1.0, 0.006, 1.2, 2, 0), (0.35, 0.006, 0.6, 2, 0), (0.7, 0.02, 1.2, 5, 0),
           (0.5, 0.02, 0.5, 2, 0), (0.85, 0.006, 0.8, 20, 0), (0.7, 0.02, 1.2, 2, 0), (1.0, 0.02, 1.2, 2, 0),
           (0.6, 0.006, 0.8, 60, 1), (0.9, 0.012, 1.0, 2, 1)]


def pad(rng, effects):
    """A plate on a vertical spring, pressed to several depths at several rates, some of them again."""
    spec = dict(gravity=np.r_[0, 0, -w.G], stop=False, guide=0.0)
    for effect in effects:
        effect.build(spec)
    stiffness = np.exp(rng.uniform(np.log(900), np.log(3000)))
    half, height, deepest = rng.uniform(0.03, 0.05), rng.uniform(0.05, 0.08), rng.uniform(0.0045, 0.006)
    stop = 'limited="true" range="-0.04 0" solreflimit="0.002 1"' if spec["stop"] else ""
    bodies = (f'<body name="pad" pos="0 0 {height}" gravcomp="1"><joint name="spring" type="slide" axis="0 0 1" {stop} '
              f'stiffness="{stiffness}" damping="0.4" frictionloss="{spec["guide"]}"/>'
              + w.box_geom("pad", [half, half, height / 2], 0.02, (0, 0, -height / 2), "0.3 0.5 0.8 1") + "</body>")
    bench = Bench(bodies, w.pair("tip", "pad", 0.4), rng, effects, spec)
    joint, dof = bench.model.joint("spring").qposadr[0], bench.model.joint("spring").dofadr[0]
    sticky = next((e.parameters["force"] for e in effects if type(e).__name__ == "Adhesion"), 0.0)
    state = dict(touched=False, pull=0.0, set=0.0)

    def act(clock, data):
        u, du = -data.qpos[joint], -data.qvel[dof]
        extra = sum(e.elastic(u, du, FINE, clock, stiffness) for e in effects)
        state["u"] = u
        gap = data.xpos[bench.tip_model][2] - w.TIP - (height - u)
        state["touched"] = (state["touched"] or gap < 0) and gap < 1e-3
        state["pull"] = sticky * np.exp(-max(gap, 0) / 2e-4) * (gap > -2e-4) if state["touched"] and sticky else 0.0
        data.qfrc_applied[dof] = extra + state["pull"]
        data.qfrc_applied[bench.tip_dofs[2]] = -state["pull"]

    bench.pull = lambda data: np.r_[0, 0, state["pull"]]
    bench.place = lambda data: data.qpos.__setitem__(joint, -state["set"])
    bench.act, held = act, set()
    for i, (share, pace, hold, wait, check) in enumerate(PRESSES):
        at = np.r_[rng.uniform(-0.2, 0.2, 2) * half, height + w.TIP]
        above, low = at + [0, 0, 0.003], at - [0, 0, deepest * share]
        down = (0.003 + deepest * share) / pace
        path = [(0, above), (0.4, above), (0.4 + down, low), (0.4 + hold + down, low), (0.4 + hold + 2 * down, above),
                (0.8 + hold + 2 * down, above)]
        state["set"] = sum(getattr(e, "set_", 0.0) for e in effects)
        bench.begin("press", wait)
        bench.keep(f"press-{i:02d}", "press", "pad", bench.finger(["pad"], path))
        if check:
            held.add(f"press-{i:02d}")
    state["set"] = 0.0
    truth = {"bodies": {"pad": {"stiffness": stiffness}}}
    return bench, held, truth, {"pad": (box_mesh(np.r_[half, half, height / 2], np.r_[0, 0, -height / 2]),
                                        [0, 0, height, 0, 0, 0, 1])}


# From, to (rad, or tenths of a metre), speed of the joint (rad/s), held out.
TURNS = [(0.0, 0.9, 0.4, 0), (0.0, 0.9, 1.2, 0), (0.0, 0.5, 0.15, 0), (0.3, 0.95, 0.8, 0), (0.0, 0.7, 0.4, 0), (0.2, 0.6, 2.0, 0),
         (0.0, 0.8, 0.7, 1), (0.1, 0.65, 0.25, 1)]


def jointed(rng, effects, revolute):
    """A part held by a pivoting tool that is moved to and fro along its joint, at several speeds."""
    spec = dict(gravity=np.r_[0, 0, -w.G])
    scale = 1.0 if revolute else 0.1
    friction = rng.uniform(0.02, 0.05) / scale
    base, arm = np.r_[0.06, 0.06, 0.03], np.r_[0.06, rng.uniform(0.015, 0.022), 0.018]
    base_mass, mass, mu = 4.0, rng.uniform(0.1, 0.3), 0.8
    yaw = rng.uniform(-np.pi, np.pi)
    q = w.quat_about([0, 0, 1], yaw)
    rotation = w.matrix_of(q)
    hinge_at = np.r_[base[0] + 0.004, 0, 0.0]
    centre = hinge_at + [arm[0] + 0.004, 0, 0]
    axis, kind, pos = ("0 0 1", "hinge", f'pos="{-arm[0] - 0.004} 0 0"') if revolute else ("1 0 0", "slide", "")
    names = ("base", "arm") if revolute else ("case", "drawer")
    bodies = (f'<body name="{names[0]}" pos="0 0 0.03" quat="{q[0]} 0 0 {q[3]}"><freejoint/>'
              f'{w.box_geom(names[0], base, base_mass, color="0.8 0.7 0.1 1")}'
              f'<body name="{names[1]}" pos="{centre[0]} 0 0"><joint name="joint" type="{kind}" axis="{axis}" {pos} '
              f'frictionloss="{friction}" armature="1e-5"/>{w.box_geom(names[1], arm, mass, color="0.1 0.6 0.2 1")}</body></body>')
    pairs = w.pair("table", names[0], mu) + w.pair("tip", names[1], 0.3) + w.pair("tip", names[0], 0.3)
    bench = Bench(bodies, pairs, rng, effects, spec)
    model, start = bench.model, [0.0]
    joint, dof = model.joint("joint").qposadr[0], model.joint("joint").dofadr[0]
    bench.place = lambda data: data.qpos.__setitem__(joint, start[0] * scale)
    for effect in effects:
        effect.dt = model.opt.timestep
        effect.beside(friction)

    def act(clock, data):
        q, dq = data.qpos[joint] / scale, data.qvel[dof] / scale
        data.qfrc_applied[dof] = sum(e.joint(q, dq) for e in effects) / scale
        model.dof_frictionloss[dof] = friction * np.prod([e.stick(q, dq) for e in effects])

    def fresh(settle=0.3):
        data = Bench.fresh(bench, settle)
        data.qpos[joint], data.qvel[dof] = start[0] * scale, 0.0
        mujoco.mj_forward(model, data)
        return data

    bench.act, bench.fresh, held = act, fresh, set()
    point = np.r_[arm[0] - 0.01, 0, 0]
    pivot = rotation @ hinge_at + [0, 0, 0.03]
    radius = 2 * arm[0] + 0.004 - 0.01
    for i, (low, high, pace, check) in enumerate(TURNS):
        start[0] = low

        def offset(x):
            if not revolute:
                return rotation @ np.r_[scale * (x - low), 0, 0]
            there, here = [radius * np.r_[np.cos(v + yaw), np.sin(v + yaw), 0] for v in (x, low)]
            return there - here

        span = (high - low) / pace
        out = [(0.6 + span * s, offset(low + (high - low) * s)) for s in np.linspace(0, 1, 80)]
        back = [(0.6 + span * (2 - s) + 0.4, offset(low + (high - low) * s)) for s in np.linspace(1, 0, 80)]
        path = [(0.35, offset(low)), *out, *back, (1.4 + 2 * span, offset(low))]
        bench.begin("pull", 3.0)
        bench.keep(f"pull-{i:02d}", "pull", names[1], bench.grip(list(names), names[1], point, path, True, 3000.0))
        if check:
            held.add(f"pull-{i:02d}")
    start[0] = 0.0
    kind = "revolute" if revolute else "prismatic"
    way = [0, 0, 1] if revolute else (rotation @ [1.0, 0, 0]).tolist()
    truth = {"joints": [{"a": names[0], "b": names[1], "type": kind, "axis": way, "origin": pivot.tolist(),
                         "friction": friction}],
             "relations": {"|".join(names): [1, 0] if revolute else [0, 1]}}
    place = rotation @ centre + [0, 0, 0.03]
    meshes = {names[0]: (box_mesh(base), [0, 0, 0.03, 0, 0, q[3], q[0]]),
              names[1]: (box_mesh(arm), [*place, 0, 0, q[3], q[0]])}
    return bench, held, truth, meshes


def rolls(rng, effects):
    import rolling_scene  # which has its worlds from here
    return rolling_scene.ball(rng, effects)


SCENES = dict(tin=tin, pad=pad, hinge=lambda rng, e: jointed(rng, e, True), drawer=lambda rng, e: jointed(rng, e, False),
              ball=rolls)


def make(kind, seed, hidden):
    """The scene with the effects `hidden` (`CAUSE[:STRENGTH]`, several with commas, or `none`), and its records."""
    rng = np.random.default_rng([seed, list(SCENES).index(kind), 7])
    effects = []
    for i, word in enumerate(x for x in hidden.split(",") if x != "none"):
        name, _, strength = word.partition(":")
        if name not in EFFECTS or kind not in EFFECTS[name].kinds:
            able = sorted(n for n, e in EFFECTS.items() if kind in e.kinds)
            raise SystemExit(f"{name} cannot be hidden in the scene {kind}; it can hide: none {' '.join(able)}")
        effect = EFFECTS[name](float(strength or 1), np.random.default_rng([seed, i, 11]))
        effect.cause = name
        effects.append(effect)
    bench, held, truth, meshes = SCENES[kind](rng, effects)
    done = bench.finished()
    truth["causes"] = [e.cause for e in effects]
    truth["cause_parameters"] = {e.cause: {k: float(v) for k, v in e.parameters.items()} for e in effects}
    return bench, done, held, truth, meshes
