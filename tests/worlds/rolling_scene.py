"""A ball that is weighed and pushed so that it rolls on; MuJoCo's own rolling friction slows it, or nothing does."""
import numpy as np

import hidden_scenes
import mujoco_world as w

PUSHES = [(0.0, 0.06, 0), (np.pi, 0.12, 0), (1.6, 0.09, 0), (-1.5, 0.16, 0), (0.5, 0.2, 0), (3.7, 0.08, 0), (2.1, 0.14, 1),
          (-1.0, 0.1, 1)]  # heading (rad), speed (m/s), held out


def ball_mesh(radius, rings=24, count=48):
    """A ball as OBJ text, faces outward."""
    lines = [f"v 0 0 {-radius:.9g}"]
    for i in range(1, rings):
        polar = np.pi * i / rings
        r, z = radius * np.sin(polar), -radius * np.cos(polar)
        lines += [f"v {r * np.cos(a):.9g} {r * np.sin(a):.9g} {z:.9g}" for a in 2 * np.pi * np.arange(count) / count]
    lines.append(f"v 0 0 {radius:.9g}")
    at, last = lambda i, j: 2 + (i - 1) * count + j % count, 2 + (rings - 1) * count
    for j in range(count):
        lines.append(f"f 1 {at(1, j + 1)} {at(1, j)}")
        lines.append(f"f {last} {at(rings - 1, j)} {at(rings - 1, j + 1)}")
        for i in range(1, rings - 1):
            lines.append(f"f {at(i, j)} {at(i, j + 1)} {at(i + 1, j + 1)}")
            lines.append(f"f {at(i, j)} {at(i + 1, j + 1)} {at(i + 1, j)}")
    return "\n".join(lines) + "\n"


def ball(rng, effects):
    """Weighed, then pushed from all sides; the finger stops and the ball rolls on."""
    radius, mu = rng.uniform(0.025, 0.04), rng.uniform(0.25, 0.5)
    mass = 1100 * 4 / 3 * np.pi * radius**3
    spec = dict(gravity=np.r_[0, 0, -w.G], rolling=0.0)
    for effect in effects:
        effect.build(spec)
    bodies = (f'<body name="ball" pos="0 0 {radius}"><freejoint name="free"/>'
              f'<geom name="ball" type="sphere" size="{radius}" mass="{mass}"/></body>')
    under = (f'<pair geom1="table" geom2="ball" condim="6" friction="{mu} {mu} 0 {spec["rolling"]} {spec["rolling"]}" '
             f'solref="0.003 1" solimp="0.95 0.99 0.0005"/>')
    bench = hidden_scenes.Bench(bodies, under + w.pair("tip", "ball", 0.2), rng, effects, spec)
    bench.begin("lift", 1.0)
    bench.keep("lift-00", "lift", "ball", bench.grip(["ball"], "ball", np.r_[0, 0, radius], w.lift_path(0.06), False))
    held = set()
    for i, (heading, pace, check) in enumerate(PUSHES):
        way = np.r_[np.cos(heading), np.sin(heading), 0]
        start = np.r_[0, 0, radius] - way * (radius + w.TIP + 0.008)
        path = w.push_path(start, way, 0.035, pace * rng.uniform(0.95, 1.05), rest=0.5)
        path.append((path[-1][0] + 0.8, path[-1][1]))
        bench.begin("push", 2.0)
        bench.keep(f"push-{i:02d}", "push", "ball", bench.finger(["ball"], path), float(heading))
        if check:
            held.add(f"push-{i:02d}")
    inertia = [0.4 * mass * radius**2] * 3
    truth = {"bodies": {"ball": {"mass": mass, "friction_static": mu, "friction_kinetic": mu, "com": [0, 0, 0],
                                 "inertia": [*inertia, 0, 0, 0]}}}
    return bench, held, truth, {"ball": (ball_mesh(radius), [0, 0, radius, 0, 0, 0, 1])}
