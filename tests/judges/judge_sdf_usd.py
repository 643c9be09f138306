#!/usr/bin/env python3
"""Have scene.sdf judged by Drake and scene.usda by OpenUSD, both against what MuJoCo reads from scene.xml.

    judge_sdf_usd.py FOLDER...

Exit code: 0 all agree, 1 something differs, 3 a judge is not installed. Folders without these files are passed over.
"""
import os
import sys

import numpy as np

RELATIVE = {"sdf": 1e-6, "usd": 2e-6}  # USD holds single precision


def mujoco_bodies(folder):
    """Mass, centre and inertia about it, world axes, of every body at the first view, by name."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(os.path.join(folder, "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bodies = {}
    for i in range(1, model.nbody):
        turn = data.ximat[i].reshape(3, 3)
        bodies[model.body(i).name] = (model.body_mass[i], data.xipos[i], turn @ np.diag(model.body_inertia[i]) @ turn.T)
    return bodies


def drake_bodies(folder):
    import logging

    logging.getLogger("drake").setLevel(logging.ERROR)  # it tells of every element that it passes over
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
    from pydrake.multibody.tree import BodyIndex
    from pydrake.systems.framework import DiagramBuilder

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    Parser(plant).AddModels(os.path.join(folder, "scene.sdf"))
    plant.Finalize()
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()  # kept: the plant's context is a part of it
    context = plant.GetMyContextFromRoot(root)
    bodies = {}
    for body in (plant.get_body(BodyIndex(i)) for i in range(plant.num_bodies())):
        inertia = body.CalcSpatialInertiaInBodyFrame(context)
        pose = body.EvalPoseInWorld(context)
        mass, com = inertia.get_mass(), inertia.get_com()
        about = inertia.Shift(com).CalcRotationalInertia().CopyToFullMatrix3() if mass > 0 else np.zeros((3, 3))
        turn = pose.rotation().matrix()
        bodies[body.name()] = (mass, pose.multiply(com), turn @ about @ turn.T)
    return bodies


def usd_bodies(folder, faults):
    from pxr import Gf, Usd, UsdGeom, UsdPhysics, UsdUtils

    path = os.path.join(folder, "scene.usda")
    stage = Usd.Stage.Open(path)
    if UsdGeom.GetStageUpAxis(stage) != "Z" or UsdGeom.GetStageMetersPerUnit(stage) != 1:
        faults.append("the stage's units are not metres with z up")
    if not any(p.IsA(UsdPhysics.Scene) for p in stage.Traverse()):
        faults.append("no physics scene")
    cache, bodies = UsdGeom.XformCache(), {}
    for prim in stage.Traverse():
        for joint in [UsdPhysics.Joint(prim)] if prim.IsA(UsdPhysics.Joint) else []:
            ends = joint.GetBody0Rel().GetTargets() + joint.GetBody1Rel().GetTargets()
            if not ends or not all(stage.GetPrimAtPath(e).HasAPI(UsdPhysics.RigidBodyAPI) for e in ends):
                faults.append(f"joint {prim.GetName()} holds no bodies")
            faults.extend(frames_differ(stage, cache, joint, prim))
        if not prim.HasAPI(UsdPhysics.RigidBodyAPI):
            continue
        if not prim.HasAPI(UsdPhysics.MassAPI):
            faults.append(f"{prim.GetName()} has no mass")
            continue
        for child in prim.GetChildren():
            if child.HasAPI(UsdPhysics.CollisionAPI) and not UsdGeom.Mesh(child).GetPointsAttr().Get():
                faults.append(f"{child.GetName()} is a collider without points")
        api = UsdPhysics.MassAPI(prim)
        world = np.array(cache.GetLocalToWorldTransform(prim)).T
        q = api.GetPrincipalAxesAttr().Get()
        principal = np.array(Gf.Matrix3d(Gf.Quatd(q))).T
        turn = world[:3, :3] @ principal
        com = world @ np.append(np.array(api.GetCenterOfMassAttr().Get()), 1)
        tensor = turn @ np.diag(api.GetDiagonalInertiaAttr().Get()) @ turn.T
        bodies[prim.GetName()] = (api.GetMassAttr().Get(), com[:3], tensor)
    checker = UsdUtils.ComplianceChecker() if hasattr(UsdUtils, "ComplianceChecker") else None
    if checker:
        checker.CheckCompliance(path)
        faults.extend(str(e) for e in checker.GetErrors())
    return bodies


def frames_differ(stage, cache, joint, prim):
    """At the first view both frames of a joint are the same place."""
    from pxr import Gf

    worlds = []
    pairs = ((joint.GetBody0Rel(), joint.GetLocalPos0Attr(), joint.GetLocalRot0Attr()),
             (joint.GetBody1Rel(), joint.GetLocalPos1Attr(), joint.GetLocalRot1Attr()))
    for rel, pos, rot in pairs:
        frame = Gf.Matrix4d().SetRotate(Gf.Quatd(rot.Get())) * Gf.Matrix4d().SetTranslate(Gf.Vec3d(pos.Get()))
        for target in rel.GetTargets():
            frame = frame * cache.GetLocalToWorldTransform(stage.GetPrimAtPath(target))
        worlds.append(np.array(frame))
    apart = np.abs(worlds[0] - worlds[1]).max()
    return [f"joint {prim.GetName()}: its frames are {apart} apart"] if apart > 1e-5 else []


def compare(kind, want, got):
    faults, tolerance = [], RELATIVE[kind]
    for name, (mass, com, inertia) in want.items():
        if name not in got:
            faults.append(f"{name} is missing")
            continue
        m, c, i = got[name]
        off = {
            "mass": abs(m - mass) / mass,
            "centre": np.linalg.norm(np.array(c) - com),
            "inertia": np.abs(i - inertia).max() / np.abs(inertia).max(),
        }
        faults.extend(f"{name}: {what} off by {v:.2g}" for what, v in off.items() if v > tolerance)
    return faults


def judge(folder):
    faults, seen = [], 0
    want = mujoco_bodies(folder)
    if os.path.exists(os.path.join(folder, "scene.sdf")):
        faults += [f"sdf: {f}" for f in compare("sdf", want, drake_bodies(folder))]
        seen += 1
    if os.path.exists(os.path.join(folder, "scene.usda")):
        usd = []
        bodies = usd_bodies(folder, usd)
        faults += [f"usd: {f}" for f in usd + compare("usd", want, bodies)]
        seen += 1
    words = "passed" if not faults else "FAILED"
    print(f"{folder}: {seen} files, {len(want)} bodies: {words}")
    for fault in faults:
        print(f"  {fault}")
    return not faults


def main():
    try:
        import mujoco  # noqa: F401
        import pxr  # noqa: F401
        import pydrake  # noqa: F401
    except ImportError as missing:
        print(f"a judge is missing: {missing}")
        return 3
    results = [judge(folder) for folder in sys.argv[1:]]
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
