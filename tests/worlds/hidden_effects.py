"""Effects that a plain model lacks, hidden in a MuJoCo world or in what its sensors write down.

`EFFECTS[cause](strength, rng)` makes one effect. Strength 1 is a plain amplitude of its kind; signs and shapes are
drawn. An effect acts where it must: on the scene as it is built (`build`), on the friction under each foot (`friction`),
by a force on the body (`force`), in the elastic law of a pad (`elastic`), along a joint (`joint`, `stick`), or in the
recorded streams (`sense`). `parameters` is what the truth file says.
"""
import numpy as np

EFFECTS = {}


def cause(name):
    def register(maker):
        EFFECTS[name] = maker
        return maker
    return register


class Effect:
    """Nothing. `kinds` are the scenes in which the effect can be hidden."""
    kinds = ("tin", "pad", "hinge", "drawer")

    def __init__(self, strength, rng):
        self.strength, self.rng, self.parameters = strength, rng, {}
        self.sign = rng.choice([-1.0, 1.0])
        self.setup(rng)

    def setup(self, rng):
        """Draws signs and shapes."""

    def build(self, spec):
        """Changes the scene before it is built."""

    def begin(self, kind, index, start, wait):
        """An interaction starts at `start` on the clock of the capture, `wait` after the last one."""

    def friction(self, c):
        """Factor on the friction under each foot."""
        return 1.0

    def force(self, c):
        """Force on the body at its centre, world x and y (N)."""
        return None

    def elastic(self, u, du, dt, clock, k):
        """Force added to the spring at indentation `u` (N)."""
        return 0.0

    def joint(self, q, dq):
        """Effort added along the joint (N or N m)."""
        return 0.0

    def stick(self, q, dq):
        """Factor on the joint's dry friction."""
        return 1.0

    def sense(self, record, kind, heading):
        """Changes what was recorded; noise is added later unless `late`."""

    late = False


class Tin(Effect):
    kinds = ("tin",)


class Pad(Effect):
    kinds = ("pad",)


class Jointed(Effect):
    """`dt` is set to the step of the simulation."""
    kinds = ("hinge", "drawer")
    dt = 0.0

    def beside(self, friction):
        """Told what the joint rubs with, N·m or N."""


@cause("velocity-weakening-friction")
class Weakening(Tin):
    def setup(self, rng):
        self.rational = rng.random() < 0.5
        self.parameters = dict(amplitude=0.35 * self.strength, speed=float(np.exp(rng.uniform(np.log(0.015), np.log(0.05)))))

    def friction(self, c):
        ratio = np.hypot(*c.feet_velocity.T) / self.parameters["speed"]
        return 1 + self.parameters["amplitude"] * (1 / (1 + ratio**2) if self.rational else np.exp(-ratio))


@cause("viscous-friction")
class Viscous(Tin):
    def setup(self, rng):
        self.parameters = dict(damping=5.0 * self.strength)

    def force(self, c):
        return -self.parameters["damping"] * c.velocity


@cause("static-ageing")
class Ageing(Tin):
    """A contact that renews itself over the slip length: theta' = 1 - v theta / Dc."""
    theta = 1.0

    def setup(self, rng):
        self.parameters = dict(beta=0.15 * self.strength, slip_length=rng.uniform(5e-4, 1.5e-3))

    def begin(self, kind, index, start, wait):
        self.theta = wait

    def friction(self, c):
        speed, length = np.hypot(*c.velocity), self.parameters["slip_length"]
        self.theta = max(self.theta + c.dt * (1 - speed * self.theta / length), 0.0) if speed > 2e-4 else self.theta + c.dt
        return 1 + self.parameters["beta"] * np.log10(1 + self.theta)


@cause("anisotropic-friction")
class Anisotropic(Tin):
    def setup(self, rng):
        self.parameters = dict(amplitude=0.2 * self.strength, direction=rng.uniform(0, np.pi))

    def friction(self, c):
        heading = np.arctan2(c.feet_velocity[:, 1], c.feet_velocity[:, 0])
        return 1 + self.parameters["amplitude"] * np.cos(2 * (heading - self.parameters["direction"]))


@cause("friction-patch")
class Patch(Tin):
    """A disc with a soft rim; the feet that are on it feel it."""

    def setup(self, rng):
        self.at, self.radius = rng.uniform(-0.015, 0.015, 2), rng.uniform(0.018, 0.028)
        self.parameters = dict(amplitude=(0.6 if self.sign > 0 else -0.45) * self.strength, x=float(self.at[0]),
                               y=float(self.at[1]), radius=self.radius)

    def friction(self, c):
        away = np.hypot(*(c.feet - self.at).T)
        return 1 + max(self.parameters["amplitude"], -0.9) / (1 + np.exp((away - self.radius) / 0.002))


@cause("support-tilt")
class Tilt(Tin):
    def setup(self, rng):
        self.azimuth = rng.uniform(-np.pi, np.pi)
        self.parameters = dict(angle=0.035 * self.strength, azimuth=self.azimuth)

    def build(self, spec):
        lean = np.tan(self.parameters["angle"])
        spec["gravity"] = spec["gravity"] + 9.80665 * np.r_[lean * np.cos(self.azimuth), lean * np.sin(self.azimuth), 0]


@cause("gravity-error")
class GravityError(Tilt):
    """Gravity leans, and is not what the capture states."""

    def build(self, spec):
        super().build(spec)
        self.parameters["magnitude"] = 9.80665 * (1 + 0.03 * self.sign * self.strength)
        spec["gravity"] *= self.parameters["magnitude"] / np.linalg.norm(spec["gravity"])


@cause("com-offset")
class ComOffset(Tin):
    def setup(self, rng):
        way = rng.uniform(-np.pi, np.pi)
        self.com = 0.010 * self.strength * np.r_[np.cos(way), np.sin(way)]
        self.parameters = dict(distance=0.010 * self.strength, x=float(self.com[0]), y=float(self.com[1]))

    def build(self, spec):
        spec["com"] = self.com


@cause("uneven-support-pressure")
class UnevenPressure(Tin):
    """The feet carry at the rim, or near the middle."""

    def setup(self, rng):
        self.parameters = dict(torsion=float(np.clip(0.35 * self.strength * self.sign, -0.7, 0.6)))

    def build(self, spec):
        spec["spread"] = 1 + self.parameters["torsion"]


@cause("tool-friction")
class ToolFriction(Tin):
    def setup(self, rng):
        self.parameters = dict(ratio=float(1 + (1.0 if self.sign > 0 else -0.8) * min(self.strength, 1.2)))

    def build(self, spec):
        spec["tool_friction"] *= self.parameters["ratio"]


class Placed(Tin):
    """Something at one place of the table that acts on the body's centre."""

    def setup(self, rng):
        self.at, self.radius = rng.uniform(-0.015, 0.015, 2), rng.uniform(0.012, 0.02)
        self.parameters = dict(x=float(self.at[0]), y=float(self.at[1]), radius=self.radius)


@cause("bump")
class Bump(Placed):
    """A raised cosine in the table's height."""

    def setup(self, rng):
        super().setup(rng)
        self.height = 0.2 * self.radius * self.strength * self.sign
        self.parameters["height"] = self.height

    def force(self, c):
        away = c.place - self.at
        d, wide = np.hypot(*away), 2.2 * self.radius
        if d >= wide or d < 1e-9:
            return None
        slope = -self.height / 2 * np.pi / wide * np.sin(np.pi * d / wide)
        return -c.load * slope * away / d


@cause("magnet")
class Magnet(Placed):
    """Two poles below one another: a pull that falls with the fourth power."""

    def setup(self, rng):
        super().setup(rng)
        self.parameters["force"] = 1.4 * self.strength

    def force(self, c):
        away = (c.place - self.at) / self.radius
        return -self.parameters["force"] * away / (1 + 0.5 * away @ away) ** 2.5 / 0.4


@cause("tether")
class Tether(Tin):
    def setup(self, rng):
        way = rng.uniform(-np.pi, np.pi)
        self.at, self.length = 0.15 * np.r_[np.cos(way), np.sin(way)], rng.uniform(0.12, 0.15)
        self.parameters = dict(stiffness=22.0 * self.strength, x=float(self.at[0]), y=float(self.at[1]), length=self.length)

    def force(self, c):
        away = c.place - self.at
        d = np.hypot(*away)
        return -self.parameters["stiffness"] * max(d - self.length, 0) * away / d


@cause("hidden-body")
class HiddenBody(Tin):
    """A thing that no camera saw, in the way of two headings."""

    def setup(self, rng):
        self.share = 0.5 * self.strength

    def build(self, spec):
        spec["hidden_mass"] = self.share * spec["mass"]
        self.parameters = dict(mass=spec["hidden_mass"])


@cause("breakaway-bond")
class Bond(Tin):
    """Glue that stretches, tears, and is gone after the first push."""
    index = None
    start = None

    def setup(self, rng):
        self.parameters = dict(force=2.2 * self.strength, length=rng.uniform(1.5e-3, 3e-3))

    def begin(self, kind, index, start, wait):
        self.index, self.start = (index if kind == "push" else None), None

    def force(self, c):
        if self.index != 0:
            return None
        if self.start is None:
            self.start = c.place.copy()
        away = c.place - self.start
        s = np.hypot(*away)
        if s < 1e-9:
            return None
        size = self.parameters["force"] * min(s / 2e-4, 1) * max(1 - s / (2 * self.parameters["length"]), 0)
        return -size * away / s


@cause("wear-or-heating")
class Wear(Tin):
    def setup(self, rng):
        self.parameters = dict(wear=0.5 * self.strength * self.sign)

    def friction(self, c):
        return 1 + self.parameters["wear"] * c.worn / (1 + 0.3 * c.worn)


@cause("outside-ratchet")
class Ratchet(Tin):
    """A nap: rubbing against it is harder than along it, with a sharp change between."""

    def setup(self, rng):
        self.parameters = dict(amplitude=0.25 * self.strength, direction=rng.uniform(-np.pi, np.pi))

    def friction(self, c):
        heading = np.arctan2(c.feet_velocity[:, 1], c.feet_velocity[:, 0]) - self.parameters["direction"]
        return 1 + self.parameters["amplitude"] * np.tanh(4 * np.cos(heading))


@cause("outside-texture")
class Texture(Tin):
    """Friction that is periodic in place."""

    def setup(self, rng):
        way = rng.uniform(0, np.pi)
        self.wave = 2 * np.pi / rng.uniform(0.01, 0.02) * np.r_[np.cos(way), np.sin(way)]
        self.parameters = dict(amplitude=0.3 * self.strength)

    def friction(self, c):
        return 1 + self.parameters["amplitude"] * np.sin(self.wave @ c.place)


@cause("outside-shaking-table")
class Shaking(Tin):
    """The table trembles; told in the table's own frame."""

    def setup(self, rng):
        self.rate, way = 2 * np.pi * rng.uniform(3, 8), rng.uniform(-np.pi, np.pi)
        self.way = np.r_[np.cos(way), np.sin(way)]
        self.parameters = dict(acceleration=0.9 * self.strength, frequency=self.rate / 2 / np.pi)

    def force(self, c):
        return c.load / 9.80665 * self.parameters["acceleration"] * np.sin(self.rate * c.clock) * self.way


# Sensors. `record` holds arrays: force (t, fx, fy, fz, tx, ty, tz), tool (t, pose), tracks {name: (t, pose)}.


def in_tool(record, heading, change):
    """Changes the forces in the tool's frame (x along `heading`)."""
    c, s = np.cos(heading), np.sin(heading)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    if len(record["force"]):
        record["force"][:, 1:4] = change(record["force"][:, 0], record["force"][:, 1:4] @ turn) @ turn.T


@cause("contact-point-offset")
class ContactPointOffset(Tin):
    """The tool's tip is not where its path says: a step in the room, or in the tool's own frame."""

    def setup(self, rng):
        way = rng.uniform(-np.pi, np.pi)
        self.own = bool(rng.random() < 0.5)
        self.step = 0.004 * self.strength * np.r_[np.cos(way), np.sin(way)]
        self.parameters = dict(dx=float(self.step[0]), dy=float(self.step[1]))

    def sense(self, record, kind, heading):
        turn = heading if self.own else 0.0
        way = np.r_[np.cos(turn) * self.step[0] - np.sin(turn) * self.step[1], np.sin(turn) * self.step[0] + np.cos(turn) * self.step[1]]
        if len(record["tool"]):
            record["tool"][:, 1:3] += way


@cause("yaw-inertia")
class YawInertia(Tin):
    def setup(self, rng):
        self.parameters = dict(factor=float(np.exp(0.6 * self.strength * self.sign)))

    def build(self, spec):
        spec["yaw"] = self.parameters["factor"]


@cause("rolling-resistance")
class RollingResistance(Effect):
    """MuJoCo's rolling friction, a length."""

    kinds = ("ball",)

    def setup(self, rng):
        self.parameters = dict(length=2e-4 * self.strength)

    def build(self, spec):
        spec["rolling"] = self.parameters["length"]


@cause("added-inertia")
class AddedInertia(Tin):
    """What has to be sped up, but weighs nothing."""

    def setup(self, rng):
        self.parameters = dict(share=0.5 * self.strength)

    def build(self, spec):
        spec["added"] = self.parameters["share"]


@cause("loose-mass")
class LooseMass(Tin):
    """A part of the mass on a spring and a damper, in the plane."""

    def setup(self, rng):
        self.parameters = dict(share=min(0.35 * self.strength, 0.8), rate=rng.uniform(15, 35), damping_ratio=rng.uniform(0.03, 0.2))
        self.at = self.way = np.zeros(2)

    def build(self, spec):
        spec["loose"] = self.parameters["share"]
        self.mass = spec["loose"] * spec["mass"]

    def begin(self, kind, index, start, wait):
        self.at, self.way = None, np.zeros(2)

    def force(self, c):
        rate, ratio = self.parameters["rate"], self.parameters["damping_ratio"]
        self.at = c.place.copy() if self.at is None else self.at
        pull = self.mass * (rate**2 * (self.at - c.place) + 2 * ratio * rate * (self.way - c.velocity))
        self.way = self.way - pull / self.mass * c.dt
        self.at = self.at + self.way * c.dt
        return pull


@cause("force-bias")
class ForceBias(Effect):
    def setup(self, rng):
        self.parameters = dict(force=0.3 * self.strength * self.sign)

    def sense(self, record, kind, heading):
        axis = [0, 0, 1] if kind == "press" else [1, 0, 0]
        in_tool(record, heading, lambda t, f: f + self.parameters["force"] * np.array(axis))


@cause("force-bias-world")
class ForceBiasWorld(Effect):
    kinds = ("tin",)

    def setup(self, rng):
        way = rng.uniform(-np.pi, np.pi)
        self.bias = 0.3 * self.strength * np.r_[np.cos(way), np.sin(way), 0]
        self.parameters = dict(x=float(self.bias[0]), y=float(self.bias[1]))

    def sense(self, record, kind, heading):
        if len(record["force"]):
            record["force"][:, 1:4] += self.bias


@cause("force-gain")
class ForceGain(Tin):
    def setup(self, rng):
        self.parameters = dict(gain=0.15 * self.strength * self.sign)

    def sense(self, record, kind, heading):
        if len(record["force"]) and kind == "push":
            record["force"][:, 1:] *= 1 + self.parameters["gain"]


@cause("force-drift")
class ForceDrift(Effect):
    def setup(self, rng):
        self.parameters = dict(per_second=0.15 / 60 * self.strength * self.sign)

    def sense(self, record, kind, heading):
        axis = np.array([0, 0, 1.0] if kind == "press" else [1.0, 0, 0])
        in_tool(record, heading, lambda t, f: f + np.outer(self.parameters["per_second"] * t, axis))


@cause("force-crosstalk")
class ForceCrosstalk(Tin):
    def setup(self, rng):
        self.parameters = dict(share=0.1 * self.strength * self.sign)

    def sense(self, record, kind, heading):
        mix = np.eye(3)
        mix[1, 0], mix[0, 1], mix[2, 0] = self.parameters["share"], -0.6 * self.parameters["share"], 0.5 * self.parameters["share"]
        in_tool(record, heading, lambda t, f: f @ mix.T)


@cause("force-saturation")
class ForceSaturation(Effect):
    kinds = ("tin", "pad")
    limit = None

    def setup(self, rng):
        self.share = max(1 - 0.25 * self.strength, 0.3)

    def prepare(self, records):
        axis = 3 if any(kind == "press" for kind, _ in records) else slice(1, 3)
        tops = [np.percentile(np.abs(r["force"][:, axis]), 97) for kind, r in records if kind in ("push", "press", "pull")]
        self.limit = self.share * max(tops)
        self.parameters = dict(limit=float(self.limit))

    def sense(self, record, kind, heading):
        if kind != "lift":
            in_tool(record, heading, lambda t, f: np.clip(f, -self.limit, self.limit))


@cause("time-delay")
class TimeDelay(Effect):
    def setup(self, rng):
        self.parameters = dict(seconds=0.03 * self.strength * self.sign)

    def sense(self, record, kind, heading):
        for rows in record["tracks"].values():
            late = rows[:, 0] - self.parameters["seconds"]
            rows[:, 1:] = np.column_stack([np.interp(late, rows[:, 0], rows[:, k]) for k in range(1, 8)])


@cause("sensor-lag")
class SensorLag(Effect):
    """One pole, or two of half its time each."""

    def setup(self, rng):
        self.poles = int(rng.integers(1, 3))
        self.parameters = dict(seconds=0.05 * self.strength)

    def sense(self, record, kind, heading):
        rows = record["force"]
        for _ in range(self.poles if len(rows) else 0):
            follow = 1 - np.exp(-np.diff(rows[:, 0]) * self.poles / self.parameters["seconds"])
            for i in range(1, len(rows)):
                rows[i, 1:] = rows[i - 1, 1:] + follow[i - 1] * (rows[i, 1:] - rows[i - 1, 1:])


def moved(record, scale, angle):
    c, s = scale * np.cos(angle), scale * np.sin(angle)
    for rows in record["tracks"].values():
        rows[:, 1:4] = rows[:, 1:4] @ np.array([[c, -s, 0], [s, c, 0], [0, 0, scale]]).T


@cause("tracking-error")
class TrackingError(Tin):
    def setup(self, rng):
        self.parameters = dict(scale=0.03 * self.strength * self.sign, angle=0.035 * self.strength * rng.choice([-1.0, 1.0]))

    def sense(self, record, kind, heading):
        moved(record, 1 + self.parameters["scale"], self.parameters["angle"])


@cause("length-scale")
class LengthScale(Effect):
    kinds = ("tin", "pad")

    def setup(self, rng):
        self.parameters = dict(scale=0.04 * self.strength * self.sign)

    def sense(self, record, kind, heading):
        moved(record, 1 + self.parameters["scale"], 0.0)


@cause("quantisation")
class Quantisation(Effect):
    late = True

    def setup(self, rng):
        self.parameters = dict(step=0.25 * self.strength)

    def sense(self, record, kind, heading):
        if len(record["force"]):
            record["force"][:, 1:4] = np.round(record["force"][:, 1:4] / self.parameters["step"]) * self.parameters["step"]


@cause("outliers")
class Outliers(Effect):
    late = True

    def setup(self, rng):
        self.parameters = dict(share=min(0.02 * self.strength, 0.3))

    def sense(self, record, kind, heading):
        for rows, size in [(record["force"], 0.3), *[(rows, 0.004) for rows in record["tracks"].values()]]:
            if len(rows):
                hit = self.rng.random(len(rows)) < self.parameters["share"]
                rows[hit, 1:4] += size * self.rng.standard_t(2.5, (hit.sum(), 3))


# What is pressed: `u` is the indentation (m), the plain law is k u.


@cause("hardening-stiffness")
class Hardening(Pad):
    """Quadratic, or cubic."""

    def setup(self, rng):
        self.power = int(rng.integers(1, 3))
        self.parameters = dict(amplitude=0.4 * self.strength)

    def elastic(self, u, du, dt, clock, k):
        return k * u * self.parameters["amplitude"] * (max(u, 0) / 0.006) ** self.power


@cause("second-stage")
class SecondStage(Pad):
    def setup(self, rng):
        self.parameters = dict(ratio=0.6 * self.strength, depth=rng.uniform(0.002, 0.0035))

    def elastic(self, u, du, dt, clock, k):
        return k * self.parameters["ratio"] * max(u - self.parameters["depth"], 0)


@cause("power-law-stiffness")
class PowerLaw(Pad):
    def setup(self, rng):
        self.parameters = dict(exponent=0.35 * self.strength)

    def elastic(self, u, du, dt, clock, k):
        return k * u * ((max(u, 0) / 0.004) ** self.parameters["exponent"] - 1) if u > 1e-5 else 0.0


@cause("elastic-damping")
class ElasticDamping(Pad):
    def setup(self, rng):
        self.parameters = dict(seconds=0.025 * self.strength)

    def elastic(self, u, du, dt, clock, k):
        return k * self.parameters["seconds"] * du


@cause("stress-relaxation")
class Relaxation(Pad):
    """Two relaxation times."""

    def setup(self, rng):
        tau = rng.uniform(0.3, 0.8)
        self.taus, self.state = np.array([0.5, 2.0]) * tau, np.zeros(2)
        self.parameters = dict(share=0.25 * self.strength, seconds=tau)

    def begin(self, kind, index, start, wait):
        self.state[:] = 0

    def elastic(self, u, du, dt, clock, k):
        self.state += dt * (0.5 * self.parameters["share"] * k * du - self.state / self.taus)
        return self.state.sum()


@cause("plastic-set")
class PlasticSet(Pad):
    set_, deepest = 0.0, 0.0

    def setup(self, rng):
        self.parameters = dict(share=0.2 * self.strength, depth=rng.uniform(0.0015, 0.003))

    def elastic(self, u, du, dt, clock, k):
        self.deepest = max(self.deepest, u)
        self.set_ = self.parameters["share"] * max(self.deepest - self.parameters["depth"], 0)
        return -k * self.set_


@cause("elastic-hysteresis")
class Hysteresis(Pad):
    """Eight bristles that slip one after another (Iwan)."""

    def setup(self, rng):
        reach = rng.uniform(0.0008, 0.002)
        self.limits, self.state = reach * (np.arange(8) + 0.5) / 4, np.zeros(8)
        self.parameters = dict(force=0.8 * self.strength, reach=reach)

    def begin(self, kind, index, start, wait):
        self.state[:] = 0

    def elastic(self, u, du, dt, clock, k):
        self.state = np.clip(self.state + du * dt, -self.limits, self.limits)
        return self.parameters["force"] * self.state.sum() / self.limits.sum()


@cause("softening-by-use")
class Mullins(Pad):
    deepest = 0.0

    def setup(self, rng):
        self.parameters = dict(share=0.3 * self.strength)

    def elastic(self, u, du, dt, clock, k):
        self.deepest = max(self.deepest, u)
        return -k * u * self.parameters["share"] * np.tanh((self.deepest - u) / 0.003)


@cause("adhesion")
class Adhesion(Pad):
    def setup(self, rng):
        self.parameters = dict(force=0.8 * self.strength)


@cause("preload")
class Preload(Pad):
    def setup(self, rng):
        self.parameters = dict(force=0.8 * self.strength)

    def build(self, spec):
        spec["stop"] = True

    def elastic(self, u, du, dt, clock, k):
        return self.parameters["force"]


@cause("snap-through")
class Snap(Pad):
    def setup(self, rng):
        self.parameters = dict(force=1.2 * self.strength, depth=rng.uniform(0.002, 0.0035), width=rng.uniform(3e-4, 6e-4))

    def elastic(self, u, du, dt, clock, k):
        p = self.parameters
        return -p["force"] / np.cosh((u - p["depth"]) / p["width"]) ** 2


@cause("guide-friction")
class GuideFriction(Pad):
    def setup(self, rng):
        self.parameters = dict(force=0.5 * self.strength)

    def build(self, spec):
        spec["guide"] = self.parameters["force"]


@cause("stiffness-drift")
class StiffnessDrift(Pad):
    def setup(self, rng):
        self.parameters = dict(per_second=1e-3 * self.strength * self.sign)

    def elastic(self, u, du, dt, clock, k):
        return k * u * self.parameters["per_second"] * clock


# Joints: efforts are in units of the joint's own, 1 N m or (times 10) 1 N.


@cause("joint-damping")
class JointDamping(Jointed):
    def setup(self, rng):
        self.parameters = dict(damping=0.06 * self.strength)

    def joint(self, q, dq):
        return -self.parameters["damping"] * dq


@cause("joint-spring")
class JointSpring(Jointed):
    def setup(self, rng):
        self.parameters = dict(stiffness=0.15 * self.strength, rest=rng.uniform(-0.2, 0.2))

    def joint(self, q, dq):
        return -self.parameters["stiffness"] * (q - self.parameters["rest"])


@cause("joint-stiction")
class JointStiction(Jointed):
    def setup(self, rng):
        self.parameters = dict(ratio=1.2 * self.strength, speed=0.03)

    def stick(self, q, dq):
        return 1 + self.parameters["ratio"] * np.exp(-((dq / self.parameters["speed"]) ** 2))


@cause("detent")
class Detent(Jointed):
    """A notch of one period of a sine."""

    def setup(self, rng):
        self.parameters = dict(effort=0.1 * self.strength, position=rng.uniform(0.3, 0.6), width=rng.uniform(0.08, 0.15))

    def joint(self, q, dq):
        x = (q - self.parameters["position"]) / self.parameters["width"]
        return -self.parameters["effort"] * np.sin(np.pi * x / 1.6) if abs(x) < 1.6 else 0.0


@cause("latch")
class Latch(Detent):
    def setup(self, rng):
        self.parameters = dict(effort=0.15 * self.strength, position=0.0, width=rng.uniform(0.05, 0.1))


@cause("joint-gravity")
class JointGravity(Jointed):
    kinds = ("hinge",)

    def setup(self, rng):
        way = rng.uniform(-np.pi, np.pi)
        self.parameters = dict(cos=0.15 * self.strength * np.cos(way), sin=0.15 * self.strength * np.sin(way))

    def beside(self, friction):
        """No more than friction holds, or the arm would swing as it likes before anyone touches it."""
        share = min(1.0, 0.85 * friction / np.hypot(*self.parameters.values()))
        self.parameters = {k: share * v for k, v in self.parameters.items()}

    def joint(self, q, dq):
        return self.parameters["cos"] * np.cos(q) + self.parameters["sin"] * np.sin(q)


@cause("soft-close")
class SoftClose(Jointed):
    def setup(self, rng):
        self.parameters = dict(damping=0.25 * self.strength, position=rng.uniform(0.3, 0.5))

    def joint(self, q, dq):
        return -self.parameters["damping"] * dq / (1 + np.exp((q - 0.6 * self.parameters["position"]) / 0.05))


@cause("limit-compliance")
class LimitCompliance(Jointed):
    def setup(self, rng):
        self.parameters = dict(stiffness=1.0 * self.strength, position=rng.uniform(0.7, 0.8))

    def joint(self, q, dq):
        return -self.parameters["stiffness"] * max(q - self.parameters["position"], 0)


@cause("backlash")
class Backlash(Jointed):
    """The dry friction sits behind a play, which it has half gone through at first."""

    def setup(self, rng):
        self.parameters = dict(half=0.03 * self.strength)
        self.drive = 0.0

    def stick(self, q, dq):
        half = self.parameters["half"]
        self.drive = min(max(self.drive, q - half), q + half)
        return 1.0 if abs(q - self.drive) > 0.98 * half else 0.0


@cause("joint-loose-mass")
class JointLooseMass(Jointed):
    """Something in the moved part hangs on a spring and a damper."""

    def setup(self, rng):
        self.parameters = dict(inertia=1.5e-3 * self.strength, rate=rng.uniform(12, 25), damping_ratio=rng.uniform(0.05, 0.2))
        self.at = None

    def begin(self, kind, index, start, wait):
        self.at = None

    def joint(self, q, dq):
        rate, ratio = self.parameters["rate"], self.parameters["damping_ratio"]
        if self.at is None:
            self.at, self.way = q, dq
        pull = rate**2 * (q - self.at) + 2 * ratio * rate * (dq - self.way)
        self.way += pull * self.dt
        self.at += self.way * self.dt
        return -self.parameters["inertia"] * pull


@cause("outside-joint-texture")
class JointTexture(Jointed):
    """Dry friction that depends on the angle."""

    def setup(self, rng):
        self.parameters = dict(amplitude=0.6 * self.strength)

    def stick(self, q, dq):
        return max(1 + self.parameters["amplitude"] * np.sin(40 * q), 0)
