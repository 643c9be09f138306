#!/usr/bin/env python3
"""Outside judges of an exported twin.   judge_exports.py TWIN_FOLDER... [--require NAME,NAME]

Loads scene.urdf, urdf/*.urdf, scene.xml and scene.glb of each folder with every judge that is installed (mujoco,
pybullet, drake, yourdfpy, trimesh, check_urdf, gltf-validator), compares masses, centres of mass, inertias and
joints with twin.json, and lets each scene rest for five seconds: after half a second nothing may drift more than a
millimetre or half a degree. Each judge runs in a process of its own, since a simulator may crash.

Exit code: 0 every judge that ran is content, 1 one is not, 2 wrong usage, 3 a judge that --require names is missing.
gltf-validator is looked for in the folder that GLTF_VALIDATOR names, or in node_modules beside this file.
"""
import argparse
import json
import math
import os
import re
import shutil
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
MARK = "@@"
STEP, SETTLED, SECONDS = 0.002, 0.5, 5.0
DRIFT, TURN = 1e-3, math.radians(0.5)


# ---------------------------------------------------------------- what the twin says
def clean(name, taken):
    """The name that the exports use for a link (docs/exports.md)."""
    base = re.sub(r"[^A-Za-z0-9_]", "_", name)
    base = "_" + base if not base or base[0].isdigit() else base
    count, candidate = 1, base
    while candidate in ("world", "support", "floor") or candidate in taken:
        count += 1
        candidate = f"{base}_{count}"
    taken.add(candidate)
    return candidate


def in_tree_order(body):
    """Links from the root down, as the exports name them."""
    held = {j["child"]: j["parent"] for j in body.get("joints", [])}
    order = [link for link in body["links"] if link["name"] not in held]
    for link in order:
        order.extend(c for c in body["links"] if held.get(c["name"]) == link["name"])
    return order


def expectations(folder):
    """name -> measured mass, centre of mass and inertia, world frame at the first view."""
    import numpy as np

    twin = json.load(open(os.path.join(folder, "twin.json")))
    taken, out = set(), {}
    for body in twin["bodies"]:
        for link in in_tree_order(body):
            rotation, shift = pose(link["pose"])
            want = {}
            if "mass" in link:
                want["mass"] = link["mass"]["value"]
            if "com" in link:
                want["com"] = rotation @ np.array(link["com"]["value"]) + shift
            if "inertia" in link:
                xx, yy, zz, xy, xz, yz = link["inertia"]["value"]
                tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
                want["inertia"] = rotation @ tensor @ rotation.T
            want["root"], want["pose"] = link is in_tree_order(body)[0], link["pose"]
            want["bare"] = not any(l.get("collision") for l in body["links"])
            out[clean(link["name"], taken)] = want
    return twin, out


def pose(seven):
    import numpy as np

    x, y, z, i, j, k, w = seven
    return matrix(w, i, j, k), np.array([x, y, z])


def matrix(w, x, y, z):
    import numpy as np

    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def compare(want, got, tolerance=1e-4):
    """got: name -> (mass, com in world, inertia in world). Returns complaints."""
    import numpy as np

    complaints = []
    for name, w in want.items():
        if name not in got:
            complaints.append(f"{name} is missing")
            continue
        mass, com, inertia = got[name]
        if "mass" in w and abs(mass - w["mass"]) > tolerance * w["mass"]:
            complaints.append(f"{name}: mass {mass}, not {w['mass']}")
        if "com" in w and np.linalg.norm(com - w["com"]) > tolerance:
            complaints.append(f"{name}: centre of mass {1e3 * np.linalg.norm(com - w['com']):.3f} mm away")
        if "inertia" in w:
            off = np.linalg.norm(inertia - w["inertia"]) / np.linalg.norm(w["inertia"])
            if off > tolerance:
                complaints.append(f"{name}: inertia off by {off:.1e}")
    return complaints


def drift(late, now):
    """Way and turn by name; late and now hold places and rotation matrices."""
    import numpy as np

    def turn(a, b):
        # Of small turns the sine is told better than the cosine.
        r = a.T @ b
        sine = 0.5 * np.linalg.norm([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
        return math.atan2(sine, 0.5 * (np.trace(r) - 1.0))

    return {n: (float(np.linalg.norm(p - late[n][0])), turn(late[n][1], r)) for n, (p, r) in now.items()}


def restless(moved):
    said = lambda n, d, t: f"{n} drifts {1e3 * d:.2f} mm and {math.degrees(t):.2f} degrees"
    return [said(n, d, t) for n, (d, t) in moved.items() if not (d < DRIFT and t < TURN)]


# ---------------------------------------------------------------- the judges
def mujoco(folder, path, twin, want):
    import mujoco as mj
    import numpy as np

    model = mj.MjModel.from_xml_path(path)
    data = mj.MjData(model)
    mj.mj_forward(model, data)
    whole = path.endswith(".xml") or os.path.basename(path) == "scene.urdf" and len(twin["bodies"]) > 1
    names = {model.body(b).name: b for b in range(1, model.nbody)}
    mine = {n: w for n, w in want.items() if n in names or whole}
    home = (np.eye(3), np.zeros(3))
    if not whole:
        root = [n for n, w in mine.items() if w["root"]][0]
        home = pose(mine[root]["pose"])
        at = (data.xmat[names[root]].reshape(3, 3), data.xpos[names[root]])
        turn = home[0] @ at[0].T
        home = (turn, home[1] - turn @ at[1])
    got = {}
    for name, b in names.items():
        r = home[0] @ data.ximat[b].reshape(3, 3)
        got[name] = (model.body_mass[b], home[0] @ data.xipos[b] + home[1], r @ np.diag(model.body_inertia[b]) @ r.T)
    complaints = compare(mine, got)
    if path.endswith(".xml"):
        heavy = [n for n, w in want.items() if not w["bare"]]
        places = lambda: {n: (data.xipos[names[n]].copy(), data.xmat[names[n]].reshape(3, 3).copy()) for n in heavy}
        for k in range(int(SECONDS / STEP)):
            mj.mj_step(model, data)
            if k == int(SETTLED / STEP):
                late = places()
        complaints += restless(drift(late, places()))
    return complaints


def bullet_matter(p, body):
    import numpy as np

    root = p.getBodyInfo(body)[0].decode()
    got = {}
    for link in range(-1, p.getNumJoints(body)):
        info = p.getDynamicsInfo(body, link)
        if link < 0:
            name, (com, q) = root, p.getBasePositionAndOrientation(body)
        else:
            state = p.getLinkState(body, link, computeForwardKinematics=1)
            name, com, q = p.getJointInfo(body, link)[12].decode(), state[0], state[1]
        r = matrix(q[3], q[0], q[1], q[2])
        got[name] = (info[0], np.array(com), r @ np.diag(info[2]) @ r.T, r)
    return got


def pybullet(folder, path, twin, want):
    import numpy as np
    import pybullet as p

    p.connect(p.DIRECT)
    p.setTimeStep(STEP)
    p.setGravity(*twin["gravity"])
    flags = p.URDF_USE_INERTIA_FROM_FILE | p.URDF_USE_SELF_COLLISION | p.URDF_USE_SELF_COLLISION_EXCLUDE_PARENT
    os.chdir(os.path.dirname(path))
    whole = os.path.basename(path) == "scene.urdf" and len(twin["bodies"]) > 1
    if whole:
        body = p.loadURDF(os.path.basename(path), useFixedBase=True, flags=flags)
        mine = want
    else:
        body = p.loadURDF(os.path.basename(path), useFixedBase=False, flags=flags)
        names = list(bullet_matter(p, body))
        mine = {n: w for n, w in want.items() if n in names}
        seven = mine[names[0]]["pose"]
        # Bullet places the base by its centre of mass and principal axes.
        local, turn = p.getDynamicsInfo(body, -1)[3:5]
        at, q = p.multiplyTransforms(seven[:3], seven[3:], local, turn)
        p.resetBasePositionAndOrientation(body, at, q)
        support = twin.get("support")
        if support:
            plane = p.createCollisionShape(p.GEOM_PLANE, planeNormal=support["normal"])
            floor = p.createMultiBody(0, plane, basePosition=support["point"])
            p.changeDynamics(floor, -1, lateralFriction=1.0)
    complaints = compare(mine, {n: v[:3] for n, v in bullet_matter(p, body).items()})
    for joint in range(p.getNumJoints(body)):
        info = p.getJointInfo(body, joint)
        if info[2] in (p.JOINT_REVOLUTE, p.JOINT_PRISMATIC):
            # Bullet puts a motor on every joint; what is left of it is the dry friction.
            p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, targetVelocity=0, force=info[7])
    standing = resting_alone(twin, mine) or whole
    late = {}
    for k in range(int(SECONDS / STEP) if standing else 0):
        p.stepSimulation()
        if k == int(SETTLED / STEP):
            late = {n: (v[1], v[3]) for n, v in bullet_matter(p, body).items()}
    now = {n: (v[1], v[3]) for n, v in bullet_matter(p, body).items() if n in late and n in mine and not mine[n]["bare"]}
    return complaints + restless(drift(late, now))


def resting_alone(twin, mine):
    """Whether the body stands on the table itself, so that it would stand there alone."""
    support, bare = twin.get("support"), any(w["bare"] for w in mine.values())
    if not support or bare:
        return False
    names = {l["name"] for b in twin["bodies"] for l in b["links"]}
    on_others = [r for r in twin["relations"] if r["kind"] in ("resting", "fixed") and "support" not in (r["a"], r["b"])]
    return len(names) == len(mine) or not on_others


def drake(folder, path, twin, want):
    import numpy as np
    from pydrake.all import AddMultibodyPlantSceneGraph, DiagramBuilder, Parser, RigidTransform, RotationMatrix

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, STEP)
    instance = Parser(plant).AddModels(path)[0]
    plant.Finalize()
    names = {plant.get_body(i).name(): plant.get_body(i) for i in plant.GetBodyIndices(instance)}
    context = builder.Build().CreateDefaultContext()
    inner = plant.GetMyMutableContextFromRoot(context)
    whole = "support" in names
    mine = want if whole else {n: w for n, w in want.items() if n in names}
    if not whole:
        root = [n for n, w in mine.items() if w["root"]][0]
        r, t = pose(mine[root]["pose"])
        if names[root].is_floating():
            plant.SetFreeBodyPose(inner, names[root], RigidTransform(RotationMatrix.ProjectToRotationMatrix(r), t))
    got = {}
    for name, body in names.items():
        at = plant.EvalBodyPoseInWorld(inner, body)
        m = body.default_spatial_inertia()
        r, c = at.rotation().matrix(), np.asarray(m.get_com())
        about_com = m.CalcRotationalInertia().CopyToFullMatrix3() - m.get_mass() * (c @ c * np.eye(3) - np.outer(c, c))
        got[name] = (m.get_mass(), at.multiply(c), r @ about_com @ r.T)
    return compare(mine, got)


def yourdfpy(folder, path, twin, want):
    import yourdfpy as y

    base = os.path.dirname(path)
    robot = y.URDF.load(path, load_collision_meshes=True, filename_handler=lambda fname: os.path.join(base, fname))
    complaints = []
    for name, link in robot.link_map.items():
        if name in want and "mass" in want[name] and abs(link.inertial.mass - want[name]["mass"]) > 1e-9:
            complaints.append(f"{name}: mass {link.inertial.mass}")
        for shape in list(link.visuals) + list(link.collisions):
            mesh = shape.geometry.mesh
            if mesh is not None and not os.path.isfile(os.path.join(base, mesh.filename)):
                complaints.append(f"{name}: {mesh.filename} is not there")
    if not robot.validate():
        complaints.append("not a valid URDF: " + "; ".join(map(str, robot.errors)))
    return complaints


def check_urdf(folder, path, twin, want):
    tool = shutil.which("check_urdf")
    if not tool:
        raise ModuleNotFoundError("check_urdf is not installed (Debian: liburdfdom-tools)")
    done = subprocess.run([tool, path], capture_output=True, text=True, timeout=60)
    return [] if done.returncode == 0 else [(done.stdout + done.stderr).strip().replace("\n", " | ")]


def trimesh(folder, path, twin, want):
    import trimesh as t

    scene = t.load(path)
    shown = sum("mesh" in l for b in twin["bodies"] for l in b["links"])
    found = len(scene.graph.nodes_geometry)
    return [] if found >= shown else [f"{found} meshes in the scene, {shown} links with one"]


def gltf_validator(folder, path, twin, want):
    module = os.environ.get("GLTF_VALIDATOR", os.path.join(HERE, "node_modules", "gltf-validator"))
    node = shutil.which("node")
    if not node or not os.path.isdir(module):
        raise ModuleNotFoundError(f"node, or gltf-validator in {module}, is missing")
    script = (
        "const v=require(process.argv[1]),fs=require('fs');"
        "v.validateBytes(new Uint8Array(fs.readFileSync(process.argv[2]))).then(r=>console.log(JSON.stringify(r.issues)))"
    )
    done = subprocess.run([node, "-e", script, module, path], capture_output=True, text=True, timeout=120)
    issues = json.loads(done.stdout)
    bad = [m for m in issues["messages"] if m["severity"] < 2]
    return [f"{m['code']} {m.get('pointer', '')}: {m['message']}" for m in bad[:5]]


URDF = [check_urdf, yourdfpy, mujoco, pybullet, drake]
JUDGES = {j.__name__: j for j in URDF + [trimesh, gltf_validator]}


def judges_of(path):
    if path.endswith(".urdf"):
        return URDF
    return [mujoco] if path.endswith(".xml") else [trimesh, gltf_validator]


# ---------------------------------------------------------------- the court
def work(judge, folder, path):
    """In a process of its own: prints what the judge says."""
    try:
        twin, want = expectations(folder)
        said = {"complaints": JUDGES[judge](folder, path, twin, want)}
    except ImportError as error:
        said = {"missing": str(error)}
    except BaseException as error:  # a simulator may raise anything
        said = {"complaints": [f"{type(error).__name__}: {error}".replace("\n", " | ")[:300]]}
    print("\n" + MARK + json.dumps(said), flush=True)
    os._exit(0)


def ask(judge, folder, path):
    call = [sys.executable, os.path.abspath(__file__), "--work", judge, folder, path]
    try:
        done = subprocess.run(call, capture_output=True, text=True, timeout=180)
    except subprocess.TimeoutExpired:
        return {"complaints": ["no answer in 180 s"]}
    lines = [line for line in done.stdout.splitlines() if line.startswith(MARK)]
    if lines:
        return json.loads(lines[-1][len(MARK):])
    return {"complaints": [f"crashed with {done.returncode}: {done.stderr.strip()[-200:]}"]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="*")
    parser.add_argument("--require", default="", help="judges that must be there")
    parser.add_argument("--work", nargs=3, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.work:
        work(*args.work)
    if not args.folders or not all(os.path.isfile(os.path.join(f, "twin.json")) for f in args.folders):
        parser.print_usage(sys.stderr)
        print("each folder must hold a twin.json", file=sys.stderr)
        return 2
    complaints, missing, heard = 0, {}, 0
    for folder in map(os.path.abspath, args.folders):
        alone = os.path.join(folder, "urdf")
        files = [os.path.join(folder, f) for f in ("scene.urdf", "scene.xml", "scene.glb")]
        files += [os.path.join(alone, f) for f in sorted(os.listdir(alone)) if f.endswith(".urdf")]
        for path in files:
            verdicts = []
            for judge in (j.__name__ for j in judges_of(path)):
                said = {"missing": missing[judge]} if judge in missing else ask(judge, folder, path)
                if "missing" in said:
                    missing[judge] = said["missing"]
                    continue
                heard += 1
                complaints += len(said["complaints"])
                verdicts.append(judge + (": " + "; ".join(said["complaints"]) if said["complaints"] else " ok"))
            print(f"{os.path.relpath(path, os.path.dirname(folder))}: {', '.join(verdicts) or 'not judged'}")
    for judge, why in missing.items():
        print(f"NOT HEARD {judge}: {why}")
    print(f"{heard} judgements, {complaints} complaints, {len(missing)} judges missing")
    if complaints or not heard:
        return 1
    return 3 if set(filter(None, args.require.split(","))) & set(missing) else 0


if __name__ == "__main__":
    sys.exit(main())
