import pybullet as p

HEAVY = 1e3
AWAY = [0.0, 0.0, 50.0, 0.0, 0.0, 0.0, 1.0]


def version():
    return str(p.getAPIVersion())


class Engine:
    def __init__(self, job, trial):
        if p.isConnected():
            p.disconnect()
        p.connect(p.DIRECT)
        self.job, self.trial, self.tool, self.bond = job, trial, None, None
        scene = job["scene"]
        p.setTimeStep(job["step"])
        p.setGravity(*scene["gravity"])
        p.setPhysicsEngineParameter(numSolverIterations=200, enableConeFriction=1)
        plane = p.createCollisionShape(p.GEOM_PLANE, planeNormal=scene["normal"])
        floor = p.createMultiBody(0, plane, basePosition=scene["point"])
        p.changeDynamics(floor, -1, lateralFriction=1.0)
        self.links = {}
        for i, tree in present(job, trial):
            pose = trial["roots"][i] if trial else tree["pose"]
            self.add_tree(tree, pose, trial["positions"] if trial else {})
        for a, b in welds(job, trial):
            self.weld(self.links[a], self.links[b], p.JOINT_FIXED)
        if trial:
            self.add_tool(trial)

    def add_tree(self, tree, pose, positions):
        flags = p.URDF_USE_INERTIA_FROM_FILE | p.URDF_USE_SELF_COLLISION | p.URDF_USE_SELF_COLLISION_EXCLUDE_PARENT
        os.chdir(os.path.dirname(os.path.join(self.job["folder"], tree["file"])))
        body = p.loadURDF(os.path.basename(tree["file"]), useFixedBase=tree["anchored"], flags=flags)
        os.chdir(self.job["folder"])
        # Bullet places the base by its centre of mass and principal axes.
        local, turn = p.getDynamicsInfo(body, -1)[3:5]
        at, q = p.multiplyTransforms(pose[:3], pose[3:], local, turn)
        p.resetBasePositionAndOrientation(body, at, q)
        self.links[p.getBodyInfo(body)[0].decode()] = (body, -1)
        for joint in range(p.getNumJoints(body)):
            info = p.getJointInfo(body, joint)
            self.links[info[12].decode()] = (body, joint)
            if info[2] in (p.JOINT_REVOLUTE, p.JOINT_PRISMATIC):
                # Bullet puts a motor on every joint; what is left of it is the dry friction.
                p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, targetVelocity=0, force=info[7])
                if info[1].decode() in positions:
                    p.resetJointState(body, joint, positions[info[1].decode()])

    def inertial(self, link):
        return p.getDynamicsInfo(*link)[3:5] if link[1] < 0 else ([0.0] * 3, [0.0, 0.0, 0.0, 1.0])

    def weld(self, a, b, kind):
        """Holds b to a where it is; in Bullet's frames, which lie at the centres of mass."""
        frames = []
        for link in (a, b):
            if link[1] < 0:
                frames.append(list(sum(map(list, p.getBasePositionAndOrientation(link[0])), [])))
            else:
                state = p.getLinkState(*link, computeForwardKinematics=1)
                frames.append(list(state[0]) + list(state[1]))
        between = compose(inverse(frames[0]), frames[1])
        bond = p.createConstraint(*a, *b, kind, [0, 0, 0], between[:3], [0, 0, 0], between[3:], [0, 0, 0, 1])
        p.changeConstraint(bond, maxForce=1e4)
        return bond

    def add_tool(self, trial):
        shape = trial["shape"]
        touch = trial["hold"] == "touch"
        if not touch:
            solid = -1
        elif shape["kind"] == "sphere":
            solid = p.createCollisionShape(p.GEOM_SPHERE, radius=shape["radius"])
        elif shape["kind"] == "box":
            solid = p.createCollisionShape(p.GEOM_BOX, halfExtents=shape["half"])
        elif shape["kind"] == "cylinder":
            solid = p.createCollisionShape(p.GEOM_CYLINDER, radius=shape["radius"], height=2.0 * shape["half_height"])
        else:
            solid = p.createCollisionShape(p.GEOM_MESH, vertices=shape["points"])
        self.tool = p.createMultiBody(HEAVY, solid, basePosition=AWAY[:3])
        # The product of the two coefficients is what counts.
        own = max(part_named(self.job, trial["target"])["friction"], 1e-9)
        p.changeDynamics(self.tool, -1, lateralFriction=trial["friction"] / own, linearDamping=0, angularDamping=0)
        self.now = (AWAY, ([0.0] * 3, [0.0] * 3))

    def bring(self, pose):
        self.now = (pose, ([0.0] * 3, [0.0] * 3))
        self.set_tool()
        if self.trial["hold"] == "touch":
            return
        target = self.links[self.trial["target"]]
        if self.trial["hold"] == "grip":
            self.bond = self.weld((self.tool, -1), target, p.JOINT_FIXED)
            return
        if target[1] < 0:
            frame = list(sum(map(list, p.getBasePositionAndOrientation(target[0])), []))
        else:
            state = p.getLinkState(*target, computeForwardKinematics=1)
            frame = list(state[0]) + list(state[1])
        at = compose(inverse(frame), pose)[:3]
        self.bond = p.createConstraint(self.tool, -1, *target, p.JOINT_POINT2POINT, [0, 0, 0], [0, 0, 0], at)
        p.changeConstraint(self.bond, maxForce=1e4)

    def move(self, pose, speed):
        self.now = (pose, speed)

    def set_tool(self):
        pose, speed = self.now
        p.resetBasePositionAndOrientation(self.tool, pose[:3], pose[3:])
        p.resetBaseVelocity(self.tool, *speed)
        lift = [-HEAVY * g for g in self.job["scene"]["gravity"]]
        p.applyExternalForce(self.tool, -1, lift, pose[:3], p.WORLD_FRAME)

    def step(self):
        if self.tool is not None:
            self.set_tool()
        p.stepSimulation()

    def poses(self):
        out = {}
        for name, link in self.links.items():
            if link[1] < 0:
                at, q = p.getBasePositionAndOrientation(link[0])
                local, turn = p.getDynamicsInfo(*link)[3:5]
                out[name] = compose(list(at) + list(q), inverse(list(local) + list(turn)))
            else:
                state = p.getLinkState(*link, computeForwardKinematics=1)
                out[name] = list(state[4]) + list(state[5])
        return out

    def force(self):
        if self.bond is not None:
            state = p.getConstraintState(self.bond)
            return [-v for v in state[:3]] if len(state) >= 3 else [0.0] * 3
        total = [0.0, 0.0, 0.0]
        for c in p.getContactPoints(bodyA=self.tool):
            # Normal and frictions as they act on A, the tool.
            for size, axis in ((c[9], c[7]), (c[10], c[11]), (c[12], c[13])):
                total = [t - size * a for t, a in zip(total, axis)]
        return total
