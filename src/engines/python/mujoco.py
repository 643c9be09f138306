import mujoco as mj
import numpy as np

TOOL = "recorded_tool"
HEAVY = 1e4  # kg: what the tool meets does not turn it aside within a step
AWAY = [0.0, 0.0, 50.0, 0.0, 0.0, 0.0, 1.0]


def version():
    return mj.__version__


def to_mujoco(pose):
    """Scalar first."""
    return list(pose[:3]) + [pose[6]] + list(pose[3:6])


class Engine:
    def __init__(self, job, trial):
        spec = mj.MjSpec.from_file("scene.xml")
        self.trial, self.job = trial, job
        if trial:
            self.add_tool(spec, job, trial)
        spec.option.timestep = job["step"]
        self.model = spec.compile()
        self.data = mj.MjData(self.model)
        self.names = {p["name"]: self.model.body(p["name"]).id for p in parts(job)}
        self.tool_geoms = set()
        if trial:
            self.place(job, trial)
        mj.mj_forward(self.model, self.data)

    def add_tool(self, spec, job, trial):
        body = spec.worldbody.add_body(name=TOOL, gravcomp=1.0)
        body.add_freejoint(name=TOOL)
        body.mass, body.inertia, body.explicitinertial = HEAVY, [HEAVY] * 3, True
        if trial["hold"] != "touch":
            kind = mj.mjtEq.mjEQ_WELD if trial["hold"] == "grip" else mj.mjtEq.mjEQ_CONNECT
            bond = spec.add_equality(name=TOOL, type=kind, name1=TOOL, name2=trial["target"])
            bond.objtype, bond.active = mj.mjtObj.mjOBJ_BODY, False
            bond.solref = [2.0 * job["step"], 1.0]
            return
        shape = trial["shape"]
        geom = dict(name=TOOL, contype=0, conaffinity=0)
        if shape["kind"] == "sphere":
            body.add_geom(type=mj.mjtGeom.mjGEOM_SPHERE, size=[shape["radius"], 0, 0], **geom)
        elif shape["kind"] == "box":
            body.add_geom(type=mj.mjtGeom.mjGEOM_BOX, size=shape["half"], **geom)
        elif shape["kind"] == "cylinder":
            size = [shape["radius"], shape["half_height"], 0]
            body.add_geom(type=mj.mjtGeom.mjGEOM_CYLINDER, size=size, **geom)
        else:
            spec.add_mesh(name=TOOL, uservert=np.array(shape["points"]).flatten(), inertia=mj.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
            body.add_geom(type=mj.mjtGeom.mjGEOM_MESH, meshname=TOOL, **geom)
        # A pair's own friction: between this tool and this thing, not the greater of two against the table.
        for part in parts(job):
            for k in range(part["hulls"]):
                other = f"{part['name']}_hull_{k}"
                friction = [trial["friction"]] * 2 + [1e-4] * 3
                pair = dict(geomname1=TOOL, geomname2=other, condim=3, friction=friction)
                if part["soft"]:
                    of = spec.geom(other)
                    pair.update(solref=list(of.solref), solimp=list(of.solimp))
                else:
                    pair.update(solref=[2.0 * job["step"], 1.0])
                spec.add_pair(**pair)

    def place(self, job, trial):
        for tree, pose in zip(job["scene"]["trees"], trial["roots"]):
            root = self.model.body(tree["parts"][0]["name"])
            if not tree["anchored"] and root.jntnum[0] == 1:
                at = self.model.jnt_qposadr[root.jntadr[0]]
                self.data.qpos[at : at + 7] = to_mujoco(pose)
        for name, position in trial["positions"].items():
            joint = mj.mj_name2id(self.model, mj.mjtObj.mjOBJ_JOINT, name)
            if joint >= 0:
                self.data.qpos[self.model.jnt_qposadr[joint]] = position
        self.at = self.model.jnt_qposadr[self.model.joint(TOOL).id]
        self.speed = self.model.jnt_dofadr[self.model.joint(TOOL).id]
        if trial["hold"] == "touch":
            self.tool_geoms = {self.model.geom(TOOL).id}
        self.set_tool(AWAY, ([0.0] * 3, [0.0] * 3))

    def set_tool(self, pose, speed):
        self.data.qpos[self.at : self.at + 7] = to_mujoco(pose)
        x, y, z, w = pose[3:]
        self.data.qvel[self.speed : self.speed + 3] = speed[0]
        # A free joint's spin is in the frame of its body.
        self.data.qvel[self.speed + 3 : self.speed + 6] = rotate([-x, -y, -z, w], speed[1])

    def bring(self, pose):
        self.set_tool(pose, ([0.0] * 3, [0.0] * 3))
        if self.trial["hold"] == "touch":
            return
        mj.mj_kinematics(self.model, self.data)
        between = compose(inverse(pose), self.poses()[self.trial["target"]])
        data = self.model.eq_data[0 if self.model.neq == 1 else self.model.equality(TOOL).id]
        data[:] = 0.0
        if self.trial["hold"] == "grip":
            data[3:10], data[10] = to_mujoco(between), 1.0
        else:
            data[3:6] = inverse(between)[:3]
        self.data.eq_active[self.model.equality(TOOL).id] = 1

    def move(self, pose, speed):
        self.set_tool(pose, speed)

    def step(self):
        mj.mj_step(self.model, self.data)

    def poses(self):
        out = {}
        for name, body in self.names.items():
            w, x, y, z = self.data.xquat[body]
            out[name] = [float(v) for v in self.data.xpos[body]] + [float(v) for v in (x, y, z, w)]
        return out

    def force(self):
        total, wrench = np.zeros(3), np.zeros(6)
        for i in range(self.data.ncon):
            contact = self.data.contact[i]
            first, second = contact.geom1 in self.tool_geoms, contact.geom2 in self.tool_geoms
            if first or second:
                mj.mj_contactForce(self.model, self.data, i, wrench)
                on_second = contact.frame.reshape(3, 3).T @ wrench[:3]
                total += on_second if first else -on_second
        if self.trial["hold"] != "touch":
            held = self.model.equality(TOOL).id
            rows = [r for r in range(self.data.nefc) if self.data.efc_type[r] == 0 and self.data.efc_id[r] == held]
            total = -self.data.efc_force[rows][:3] if len(rows) >= 3 else total
        return [float(v) for v in total]
