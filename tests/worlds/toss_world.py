"""Tosses of a box with MuJoCo as the world, plain or with one hidden effect; used by mujoco_world.py.

The box flies, strikes a table, tumbles, slides and comes to rest. MuJoCo has no coefficient of restitution: contacts are
stiff springs with a damping from the wanted coefficient, and what is called the truth is what a ball of the same contact
measures when it is dropped in the same world. Friction is MuJoCo's elliptic cone.
"""
import numpy as np
import mujoco

G = 9.80665
STEP = 1e-4  # s
STIFF = 4e6  # 1/s², contact stiffness over mass
TOSSES = 10
CAUSES = ["length-scale", "gravity-error", "support-tilt", "com-offset", "nonuniform-density", "tracking-error",
          "velocity-weakening-friction", "outside-wind", "outside-patch"]


def quat_multiply(a, b):
    """Product of two quaternions, scalar first."""
    out = np.zeros(4)
    mujoco.mju_mulQuat(out, np.asarray(a, float), np.asarray(b, float))
    return out


def quat_of(vector):
    """Quaternion (scalar first) of a rotation vector."""
    angle = np.linalg.norm(vector)
    return np.r_[np.cos(angle / 2), np.sin(angle / 2) * np.asarray(vector) / max(angle, 1e-12)]


def solref(restitution):
    """Stiffness and damping, over mass, of a contact that gives back this share of the speed."""
    log = -np.log(max(restitution, 1e-3))
    ratio = log / np.hypot(np.pi, log)
    return f"{-STIFF} {-2 * ratio * np.sqrt(STIFF)}"


def xml(geom, inertial, friction, restitution, gravity, tilt):
    quat = " ".join(f"{x:.9g}" for x in quat_of([tilt[0], tilt[1], 0.0]))
    return f"""<mujoco><option timestep="{STEP}" gravity="{gravity[0]} {gravity[1]} {gravity[2]}" cone="elliptic" impratio="20"
 solver="Newton" iterations="80" tolerance="1e-12" integrator="implicitfast"/>
<default><geom contype="0" conaffinity="0"/></default>
<worldbody><geom name="table" type="plane" size="5 5 0.1" quat="{quat}"/>
<body name="box" pos="0 0 1"><freejoint/>{inertial}{geom}</body></worldbody>
<contact><pair geom1="table" geom2="shape" condim="3" friction="{friction} {friction} 0 0 0" solref="{solref(restitution)}"
 solimp="0.99 0.99 0.0005"/></contact></mujoco>"""


def measured_restitution(restitution, friction):
    """What a ball gives back that falls on the table."""
    ball = xml('<geom name="shape" type="sphere" size="0.04" mass="0.3"/>', "", friction, restitution, [0, 0, -G], [0, 0])
    model = mujoco.MjModel.from_xml_string(ball)
    data = mujoco.MjData(model)
    data.qpos[2], data.qvel[2] = 0.06, -1.0
    fastest, struck = 0.0, False
    for _ in range(int(0.1 / STEP)):
        before = data.qvel[2]
        mujoco.mj_step(model, data)
        fastest = min(fastest, data.qvel[2])
        struck |= data.ncon > 0
        if struck and data.ncon == 0:
            return float(-data.qvel[2] / fastest) if before else 0.0
    return 0.0


class Effect:
    """One hidden effect with its strength: 1 is typical."""

    def __init__(self, cause, strength, rng):
        sign, even = rng.choice([-1.0, 1.0]), rng.uniform(0.8, 1.25) * strength
        way = rng.uniform(0, 2 * np.pi)
        self.cause, self.parameters = cause, {}
        self.scale, self.gravity, self.tilt, self.turn = 0.0, np.array([0, 0, -G]), [0.0, 0.0], [0.0, 0.0]
        self.centre, self.inertia, self.weakening, self.wind, self.patch = np.zeros(3), 1.0, 0.0, np.zeros(3), 0.0
        small = 0.035 * even * np.array([np.cos(way), np.sin(way)])
        if cause == "length-scale":
            self.scale = self.parameters["s"] = 0.025 * even * sign
        elif cause == "gravity-error":
            self.gravity = np.array([G * small[0], G * small[1], -G * np.sqrt(1 - small @ small)])
            self.parameters = dict(gx=self.gravity[0], gy=self.gravity[1])
        elif cause == "support-tilt":
            self.tilt = list(small)
            self.parameters = dict(tilt_x=small[0], tilt_y=small[1])
        elif cause == "tracking-error":
            self.turn = list(small)
            self.parameters = dict(tilt_x=small[0], tilt_y=small[1])
        elif cause == "com-offset":
            away = rng.normal(size=3)
            self.centre = 0.007 * even * away / np.linalg.norm(away)
            self.parameters = dict(zip("xyz", self.centre))
        elif cause == "nonuniform-density":
            self.inertia = np.exp(0.3 * even * (1 if sign > 0 else -1))
            self.parameters = dict(log_inertia_ratio=np.log(self.inertia))
        elif cause == "velocity-weakening-friction":
            self.weakening = self.parameters["a"] = 0.6 * even
        elif cause == "outside-wind":
            self.wind = 0.9 * even * np.array([np.cos(way), np.sin(way), 0])  # m/s², of a periodic gust
        elif cause == "outside-patch":
            self.patch = 0.8 * even
        elif cause != "none":
            raise SystemExit(f"{cause} cannot be hidden in a toss; it can hide: none {' '.join(CAUSES)}")


def box_mesh(half):
    """A box as an OBJ."""
    corners = [[x, y, z] for x in (-half[0], half[0]) for y in (-half[1], half[1]) for z in (-half[2], half[2])]
    faces = ["1 2 4", "1 4 3", "5 7 8", "5 8 6", "1 5 6", "1 6 2", "3 4 8", "3 8 7", "1 3 7", "1 7 5", "2 6 8", "2 8 4"]
    return "\n".join([f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in corners] + [f"f {f}" for f in faces]) + "\n"


def one_toss(model, rng, effect, half, noise, friction):
    """The track of one toss."""
    data = mujoco.MjData(model)
    reach = np.linalg.norm(half)
    data.qpos[:3] = [*rng.uniform(-0.1, 0.1, 2), reach + rng.uniform(0.08, 0.2)]
    turn = rng.normal(size=4)
    data.qpos[3:7] = turn / np.linalg.norm(turn)
    way = rng.uniform(0, 2 * np.pi)
    speed = rng.uniform(0.4, 1.2)
    data.qvel[:3] = [speed * np.cos(way), speed * np.sin(way), rng.uniform(-0.2, 0.6)]
    data.qvel[3:6] = rng.normal(0, 4.0, 3)
    mujoco.mj_forward(model, data)
    rows, every, box = [], 68, model.body("box").id
    for k in range(int(1.0 / STEP)):
        if k % every == 0:
            place, quat = data.xpos[box].copy(), data.xquat[box].copy()
            if any(effect.turn):
                turned = quat_of([*effect.turn, 0.0])
                matrix = np.zeros(9)
                mujoco.mju_quat2Mat(matrix, turned)
                place, quat = matrix.reshape(3, 3) @ place, quat_multiply(turned, quat)
            place = place * (1 + effect.scale) + rng.normal(0, noise[0], 3)
            quat = quat_multiply(quat_of(rng.normal(0, noise[1], 3)), quat)
            quat *= np.sign(quat[0]) or 1.0
            rows.append([k * STEP, *place, quat[1], quat[2], quat[3], quat[0]])
        if effect.weakening:
            slip = np.linalg.norm(data.qvel[:2])
            model.pair_friction[:, :2] = friction * (1 + effect.weakening / (1 + (slip / 0.15) ** 2))
        if effect.patch:
            inside = np.sin(2 * np.pi * data.qpos[0] / 0.15) * np.sin(2 * np.pi * data.qpos[1] / 0.15) > 0
            model.pair_friction[:, :2] = friction * (1 + effect.patch * inside)
        if effect.wind.any():
            data.xfrc_applied[box, :3] = model.body_mass[box] * effect.wind * np.sin(2 * np.pi * 7 * data.time)
        mujoco.mj_step(model, data)
    return dict(force=[], tracks={"box": rows})


def make(seed, hidden):
    """Records, names of those held out, truth, and the mesh, of one capture."""
    rng = np.random.default_rng([seed, 41])
    cause, _, strength = hidden.partition(":")
    effect = Effect(cause, float(strength or 1), np.random.default_rng([seed, 43]))
    half = rng.uniform(0.03, 0.06, 3)
    mass, friction, wanted = rng.uniform(0.15, 0.8), rng.uniform(0.15, 0.5), rng.uniform(0.1, 0.6)
    noise = rng.choice([(5e-5, 5e-4), (2e-4, 2e-3), (4e-4, 4e-3)])
    inertia = mass / 3 * np.array([half[1]**2 + half[2]**2, half[0]**2 + half[2]**2, half[0]**2 + half[1]**2]) * effect.inertia
    inertial = (f'<inertial pos="{effect.centre[0]} {effect.centre[1]} {effect.centre[2]}" mass="{mass}" '
                f'diaginertia="{inertia[0]} {inertia[1]} {inertia[2]}"/>')
    geom = f'<geom name="shape" type="box" size="{half[0]} {half[1]} {half[2]}"/>'
    model = mujoco.MjModel.from_xml_string(xml(geom, inertial, friction, wanted, effect.gravity, effect.tilt))
    done, held = [], []
    for k in range(TOSSES):
        name = f"toss-{k:02d}"
        done.append((name, "toss", "box", one_toss(model, rng, effect, half, noise, friction)))
        if k % 5 == 4:
            held.append(name)
    body = dict(restitution=measured_restitution(wanted, friction), friction_kinetic=friction, mass=mass,
                com=[float(x) for x in effect.centre])
    body = {k: v if isinstance(v, list) else float(v) for k, v in body.items()}
    truth = {"bodies": {"box": body}, "causes": [] if cause == "none" else [cause],
             "cause_parameters": {} if cause == "none" else {cause: {k: float(v) for k, v in effect.parameters.items()}}}
    return done, held, truth, {"box": (box_mesh(half), [0, 0, 0, 0, 0, 0, 1])}
