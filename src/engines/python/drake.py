import logging

logging.disable(logging.WARNING)
import pydrake
from pydrake.all import (
    AddCompliantHydroelasticProperties,
    AddCompliantHydroelasticPropertiesForHalfSpace,
    AddContactMaterial,
    AddMultibodyPlant,
    AddRigidHydroelasticProperties,
    Box,
    Convex,
    CoulombFriction,
    Cylinder,
    DiagramBuilder,
    HalfSpace,
    MultibodyPlantConfig,
    Parser,
    ProximityProperties,
    Quaternion,
    RigidTransform,
    RoleAssign,
    Simulator,
    SpatialInertia,
    SpatialVelocity,
    Sphere,
    UnitInertia,
)
import numpy as np

AWAY = [0.0, 0.0, 50.0, 0.0, 0.0, 0.0, 1.0]
HEAVY = 1e4
MODULUS = 1e8  # Pa
DISSIPATION = 5.0  # s/m
POINT = 1e5  # N/m: a foot sinks by less than it stands out


def version():
    return getattr(pydrake, "__version__", "") or __import__("importlib.metadata").metadata.version("drake")


def transform(pose):
    q = np.array([pose[6], *pose[3:6]])
    return RigidTransform(Quaternion(q / np.linalg.norm(q)), pose[:3])


class Engine:
    def __init__(self, job, trial):
        if trial and trial["hold"] != "touch":
            raise RuntimeError("a held thing is not played in Drake")
        self.job, self.trial, self.tool = job, trial, None
        scene, builder = job["scene"], DiagramBuilder()
        # Patches, not points: of a face on a table Drake's point contact has one point. What has feet stands on those,
        # by a point each: the few large triangles of a face give a patch that turns far too easily.
        plant, graph = AddMultibodyPlant(
            MultibodyPlantConfig(
                time_step=job["step"],
                contact_model="hydroelastic_with_fallback",
                contact_surface_representation="triangle",
                discrete_contact_approximation="lagged",
            ),
            builder,
        )
        plant.mutable_gravity_field().set_gravity_vector(scene["gravity"])
        self.plant = plant
        turn = HalfSpace.MakePose(np.array(scene["normal"]), np.array(scene["point"]))
        own = part_named(job, trial["target"])["friction"] if trial else max(p["friction"] for p in parts(job))
        plant.RegisterCollisionGeometry(plant.world_body(), turn, HalfSpace(), "table", yielding(own, 0.1))
        self.roots = []
        here = present(job, trial)
        for _, tree in here:
            instance = Parser(plant).AddModels(os.path.join(job["folder"], tree["file"]))[0]
            root = plant.GetBodyByName(tree["parts"][0]["name"], instance)
            self.roots.append(root)
            if tree["anchored"]:
                plant.WeldFrames(plant.world_frame(), root.body_frame(), transform(tree["pose"]))
        self.names = {}
        for (_, tree), root in zip(here, self.roots):
            for part in tree["parts"]:
                self.names[part["name"]] = plant.GetBodyByName(part["name"], root.model_instance())
        self.graph = graph
        for part in parts(job):
            if part["name"] in self.names:
                self.solid(part)
        home = self.first_poses(scene)
        for a, b in welds(job, trial):
            between = transform(home[a]).inverse() @ transform(home[b])
            if b in [r.name() for r in self.roots]:
                plant.WeldFrames(self.names[a].body_frame(), self.names[b].body_frame(), between)
            else:
                plant.WeldFrames(self.names[b].body_frame(), self.names[a].body_frame(), between.inverse())
        if trial:
            self.add_tool(trial)
        plant.Finalize()
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        self.simulator.Initialize()
        self.context = self.simulator.get_mutable_context()
        self.inner = plant.GetMyMutableContextFromRoot(self.context)
        self.time = 0.0
        self.place(scene, trial)

    def solid(self, part):
        """Rigid where patches form, and on its feet where it has some."""
        body, source = self.names[part["name"]], self.plant.get_source_id()
        for geometry in self.plant.GetCollisionGeometriesForBody(body):
            properties = ProximityProperties(self.graph.model_inspector().GetProximityProperties(geometry))
            AddRigidHydroelasticProperties(0.01, properties)
            self.graph.AssignRole(source, geometry, properties, RoleAssign.kReplace)
        for k, at in enumerate(part["feet"]):
            properties = ProximityProperties()
            AddContactMaterial(DISSIPATION, POINT, CoulombFriction(part["friction"], part["friction"]), properties)
            ball, name = Sphere(self.job["scene"]["foot"]), f"{part['name']}_foot_{k}"
            self.plant.RegisterCollisionGeometry(body, RigidTransform(at), ball, name, properties)

    def first_poses(self, scene):
        out = {}
        for tree in scene["trees"]:
            out.update({p["name"]: p["pose"] for p in tree["parts"] if "pose" in p})
            out[tree["parts"][0]["name"]] = tree["pose"]
        return out

    def add_tool(self, trial):
        shape, plant = trial["shape"], self.plant
        own = part_named(self.job, trial["target"])["friction"]
        want = trial["friction"]
        # Of two coefficients Drake takes 2ab/(a + b).
        mine = want * own / (2.0 * own - want) if want < 1.99 * own else 200.0 * own
        solid = {
            "sphere": lambda: Sphere(shape["radius"]),
            "box": lambda: Box(*[2.0 * h for h in shape["half"]]),
            "cylinder": lambda: Cylinder(shape["radius"], 2.0 * shape["half_height"]),
            "hull": lambda: Convex(np.array(shape["points"]).T, "tool"),
        }[shape["kind"]]()
        matter = SpatialInertia(HEAVY, np.zeros(3), UnitInertia.SolidSphere(1.0))
        instance = plant.AddModelInstance("recorded_tool")
        self.tool = plant.AddRigidBody("recorded_tool", instance, matter)
        plant.RegisterCollisionGeometry(self.tool, RigidTransform(), solid, "tool", yielding(mine, None))
        plant.set_gravity_enabled(instance, False)

    def place(self, scene, trial):
        for (i, tree), root in zip(present(self.job, trial), self.roots):
            if root.is_floating_base_body():
                pose = trial["roots"][i] if trial else tree["pose"]
                self.plant.SetFreeBodyPose(self.inner, root, transform(pose))
            for name, position in (trial["positions"] if trial else {}).items():
                if self.plant.HasJointNamed(name, root.model_instance()):
                    joint = self.plant.GetJointByName(name, root.model_instance())
                    self.plant.SetPositions(self.inner, np.array(self.with_joint(joint, position)))
        if trial:
            self.set_tool(AWAY, ([0.0] * 3, [0.0] * 3))

    def with_joint(self, joint, position):
        q = self.plant.GetPositions(self.inner)
        q[joint.position_start()] = position
        return q

    def set_tool(self, pose, speed):
        self.plant.SetFreeBodyPose(self.inner, self.tool, transform(pose))
        self.plant.SetFreeBodySpatialVelocity(self.inner, self.tool, SpatialVelocity(speed[1], speed[0]))

    def bring(self, pose):
        self.set_tool(pose, ([0.0] * 3, [0.0] * 3))

    def move(self, pose, speed):
        self.set_tool(pose, speed)

    def step(self):
        self.time += self.job["step"]
        self.simulator.AdvanceTo(self.time)

    def poses(self):
        out = {}
        for name, body in self.names.items():
            x = self.plant.EvalBodyPoseInWorld(self.inner, body)
            q = x.rotation().ToQuaternion().wxyz()
            out[name] = [float(v) for v in (*x.translation(), q[1], q[2], q[3], q[0])]
        return out

    def force(self):
        results = self.plant.get_contact_results_output_port().Eval(self.inner)
        total, mine = np.zeros(3), self.tool.index()
        for i in range(results.num_point_pair_contacts()):
            pair = results.point_pair_contact_info(i)
            if pair.bodyA_index() == mine:
                total += pair.contact_force()
            elif pair.bodyB_index() == mine:
                total -= pair.contact_force()
        for i in range(results.num_hydroelastic_contacts()):
            patch = results.hydroelastic_contact_info(i)
            surface = patch.contact_surface()
            graph = self.graph_ids()
            on_first = patch.F_Ac_W().translational()
            if surface.id_M() in graph:
                total -= on_first
            elif surface.id_N() in graph:
                total += on_first
        return [float(v) for v in total]

    def graph_ids(self):
        return set(self.plant.GetCollisionGeometriesForBody(self.tool))


def yielding(friction, thickness):
    """What a rigid thing meets must yield for a patch to form."""
    properties = ProximityProperties()
    if thickness:
        AddCompliantHydroelasticPropertiesForHalfSpace(thickness, MODULUS, properties)
    else:
        AddCompliantHydroelasticProperties(0.01, MODULUS, properties)
    AddContactMaterial(DISSIPATION, None, CoulombFriction(friction, friction), properties)
    return properties
