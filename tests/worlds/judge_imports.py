#!/usr/bin/env python3
"""judge_imports.py PALPATE OUT [SEEDS [FIRST]]: somebody's own URDF against captures, all right and with one number wrong.

A box glued on a box, a drawer in its case and a leaf on a rail: of the built-in lab (tests/imported/) and of worlds of MuJoCo,
whose URDFs are written here from what the worlds were made of. Each is imported and diagnosed as it is, and with one
number altered: mass, friction on the table, friction or damping of the joint. Prints, case by case, which numbers were told
to lie outside; fails where the wrong one is not among them. How often a right one is, is counted."""
import json, os, re, subprocess, sys

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)


def run(*words):
    return subprocess.run(words, capture_output=True, text=True)


def matter(parts):
    """Mass, centre and inertia of boxes (full size, centre, mass)."""
    total = sum(m for _, _, m in parts)
    centre = sum(m * np.array(c) for _, c, m in parts) / total
    inertia = np.zeros((3, 3))
    for size, at, m in parts:
        s, d = np.array(size), np.array(at) - centre
        inertia += np.diag([s[1] ** 2 + s[2] ** 2, s[0] ** 2 + s[2] ** 2, s[0] ** 2 + s[1] ** 2]) * m / 12
        inertia += m * (d @ d * np.eye(3) - np.outer(d, d))
    return total, centre, inertia


def words(v):
    return " ".join(f"{x:.7g}" for x in v)


def link(name, parts, mu=None):
    m, c, i = matter(parts)
    text = (f'<link name="{name}"><inertial><origin xyz="{words(c)}"/><mass value="{m:.7g}"/><inertia ixx="{i[0, 0]:.7g}" '
            f'iyy="{i[1, 1]:.7g}" izz="{i[2, 2]:.7g}" ixy="{i[0, 1]:.7g}" ixz="{i[0, 2]:.7g}" iyz="{i[1, 2]:.7g}"/></inertial>')
    for size, at, _ in parts:
        text += f'<visual><origin xyz="{words(at)}"/><geometry><box size="{words(size)}"/></geometry></visual>'
    if mu:
        text += f'<contact><lateral_friction value="{mu:.7g}"/></contact>'
    return text + "</link>"


def joint(kind, parent, child, at, law=None, span=None):
    text = f'<joint name="joint" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{words(at)}"/>'
    if law:
        text += f'<axis xyz="1 0 0"/><limit lower="{span[0]}" upper="{span[1]}" effort="100" velocity="1"/>'
        text += f'<dynamics friction="{law[0]:.7g}" damping="{law[1]:.7g}"/>'
    return text + "</joint>"


def glued(seed):
    import mujoco_world as w
    rng = np.random.default_rng([seed, list(w.KINDS).index("glued")])
    low, top, shift, low_mass, top_mass = w.two_boxes(rng)
    mu = rng.uniform(0.15, 0.6)
    return (link("low", [(2 * low, [0, 0, 0], low_mass)], mu) + link("top", [(2 * top, [0, 0, 0], top_mass)])
            + joint("fixed", "low", "top", shift))


def drawer(seed):
    import mujoco_world as w
    rng = np.random.default_rng([seed, list(w.KINDS).index("drawer")])
    case = np.r_[rng.uniform(0.05, 0.07), rng.uniform(0.04, 0.055), 0.03]
    case_mass, mass, mu = rng.uniform(0.8, 1.5), rng.uniform(0.1, 0.3), rng.uniform(0.4, 0.6)
    friction, damping, reach = rng.uniform(0.1, 0.6), rng.uniform(0, 3.0), rng.uniform(0.04, 0.06)
    x, y, z, thin = *case, 0.004
    walls = [([x, y, thin], [0, 0, -z + thin]), ([x, y, thin], [0, 0, z - thin]), ([x, thin, z], [0, y - thin, 0]),
             ([x, thin, z], [0, -y + thin, 0]), ([thin, y, z], [-x + thin, 0, 0])]
    half = np.r_[x - 0.008, y - 0.012, z - 0.012]
    return (link("case", [(2 * np.array(h), at, case_mass / 5) for h, at in walls], mu)
            + link("drawer", [(2 * half, [0, 0, 0], mass)])
            + joint("prismatic", "case", "drawer", [0.012, 0, 0], (friction, damping), (0, reach)))


def rail(seed):
    import joint_world as j
    rng = np.random.default_rng([seed, list(j.KINDS).index("rail"), 3])
    rng.uniform(-np.pi, np.pi)
    post = np.r_[0.05, 0.05, rng.uniform(0.1, 0.14)]
    half = np.r_[rng.uniform(0.05, 0.09), rng.uniform(0.006, 0.012), rng.uniform(0.03, 0.06)]
    hinge = np.r_[post[0] + 0.004, rng.uniform(-0.02, 0.02), rng.uniform(0.0, 0.03)]
    mass = rng.uniform(0.05, 0.25)
    friction, damping, spring = j.draws(rng, True)
    text = (link("post", [(2 * post, [0, 0, 0], 5.0)]) + link("leaf", [(2 * half, [0, 0, 0], mass)])
            + joint("prismatic", "post", "leaf", hinge + [half[0] + 0.003, 0, 0], (friction, damping), (-0.002, 0.05)))
    return None if spring else text


def scaled(pattern, factor, nth=0):
    """The nth number after `pattern` times a factor."""
    def change(text):
        found = list(re.finditer(pattern + r'"([0-9.eE+-]+)"', text))[nth]
        return text[:found.start(1)] + f"{float(found.group(1)) * factor:.7g}" + text[found.end(1):]
    return change


MASS, MU = scaled("<mass value=", 1.5), scaled("lateral_friction value=", 1.4)
DRY, DAMPING = scaled("dynamics friction=", 1.8), scaled(r'dynamics friction="[^"]*" damping=', 8)
FORCE = "friction force on the table"
# What is altered, how, and which quantities may be accused for it (one that ends in + by how it begins).
STACK = [("all right", None, []), ("mass", MASS, ["mass"]), ("friction", MU, ["friction.kinetic", FORCE])]
CASE = [("all right", None, []), ("friction on the table", MU, ["friction.kinetic", FORCE]),
        ("mass of the case", MASS, ["mass", FORCE]),
        ("joint friction", DRY, ["friction", "friction +"]), ("joint damping", DAMPING, ["damping", "friction +"])]
LEAF = [CASE[0], CASE[3], CASE[4]]


def cases(palpate, out, seeds, first):
    data = os.path.join(HERE, "..", "imported")
    for seed in range(first, first + seeds):
        for scene, file, altered in [("glued-stack", "stack", STACK), ("drawer", "drawer", CASE)]:
            capture = f"{out}/lab-{scene}-{seed}"
            if not os.path.exists(f"{capture}/truth.json"):
                run(palpate, "synth", f"lab:{scene}", "--seed", str(seed), "--out", capture, "-q")
            yield capture, open(f"{data}/{file}.urdf").read(), altered
        for kind, write, altered in [("glued", glued, STACK), ("drawer", drawer, CASE), ("rail", rail, LEAF)]:
            text = write(seed)
            if text is None:
                continue
            capture = f"{out}/mujoco-{kind}-{seed}"
            if not os.path.exists(f"{capture}/truth.json"):
                maker = "joint_world.py" if kind == "rail" else "mujoco_world.py"
                views = [] if kind == "rail" else ["--views"]
                run(sys.executable, f"{HERE}/{maker}", capture, "--kind", kind, "--seed", str(seed), *views)
            yield capture, f'<robot name="own">{text}</robot>', altered


def main():
    palpate, out = sys.argv[1], sys.argv[2]
    seeds = int(sys.argv[3]) if len(sys.argv) > 3 else 2
    first = int(sys.argv[4]) if len(sys.argv) > 4 else 700
    os.makedirs(out, exist_ok=True)
    found, wrong, accused, right, clean, whole, failed = 0, 0, 0, 0, 0, 0, 0
    for capture, text, altered in cases(palpate, out, seeds, first):
        for name, change, quantities in altered:
            case = f"{capture}-{name.replace(' ', '-')}"
            with open(f"{case}.urdf", "w") as file:
                file.write(change(text) if change else text)
            made = run(palpate, "import", "twin", f"{case}.urdf", "--out", f"{case}-model", "-q")
            told = run(palpate, "diagnose", capture, "--model", f"{case}-model", "--json")
            if made.returncode or told.returncode:
                print(f"{case}: {made.stderr.strip()} {told.stderr.strip()[-300:]}")
                failed += 1
                continue
            told = json.loads(told.stdout)
            meant = lambda n: any(n["quantity"] == q or (q[-1] == "+" and n["quantity"].startswith(q))  # noqa: E731
                                  for q in quantities)
            outside = [n for n in told["numbers"] if n["outside"]]
            others = [n for n in told["numbers"] if not meant(n)]
            right += len(others)
            wrongly = [n for n in outside if not meant(n)] + told["structure"]
            accused += len(wrongly)
            if change:
                wrong += 1
                found += any(meant(n) for n in outside)
            else:
                whole += 1
                clean += not wrongly
            of = lambda n: n if isinstance(n, str) else (  # noqa: E731
                f'{n["about"]}: {n["quantity"]} {n["model"]:.4g}, measured {n["measured"]:.4g} '
                f'[{n["ci95"][0]:.4g}, {n["ci95"][1]:.4g}]')
            rmse = {k: float(f"{v:.3g}") for k, v in told["base"]["rmse"].items()}
            print(f"{os.path.basename(case)}: {told['verdict']}, {len(told['numbers'])} numbers, foretold to {rmse}")
            for n in outside + told["structure"]:
                print(f"    {of(n)}")
    print(f"wrong numbers found {found} of {wrong}; right ones accused {accused} of {right}; models all right told so {clean} "
          f"of {whole}; failed {failed}")
    return 1 if failed or found < wrong else 0


if __name__ == "__main__":
    sys.exit(main())
