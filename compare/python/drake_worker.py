"""Steps a scene of rigid bodies in Drake on request. Frames of 64-bit floats over standard input and output, as mujoco_worker.py.

Start: 8 bytes of length and the scene as JSON; answered by one float (1: it was made) and the numbers of positions, velocities
and controls, or by 0, a length and a message. Then, each led by one byte:

    P  poses, velocities   set the state; no answer
    F  forces, torques     of each body in the steps that follow, about its centre of mass; no answer
    S                      one step; answered by CPU seconds, deepest overlap, 1 if the step failed or 0, poses, velocities
    C                      answered by the number of contacts of the last step, and of each: numbers of both shapes, place,
                           normal from the first to the second, force on the second, gap
    R  longest             play everything since the start again, for at most so many CPU seconds; answered by CPU seconds
                           per step

A pose is the place of the centre of mass and a quaternion w, x, y, z; a velocity is linear and angular, all in the world's axes.
CPU time is that of this thread around Simulator.AdvanceTo alone, less what reading the clock costs. A step that takes longer than
a run may ends this process by SIGXCPU.
"""

import json
import math
import resource
import struct
import sys
import time

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    Box,
    Capsule,
    Convex,
    Cylinder,
    DefaultProximityProperties,
    HalfSpace,
    ProximityProperties,
    SceneGraphConfig,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce, SpatialVelocity
from pydrake.multibody.plant import (
    AddMultibodyPlant,
    CoulombFriction,
    ExternallyAppliedSpatialForce,
    MultibodyPlantConfig,
)
from pydrake.multibody.tree import RotationalInertia, SpatialInertia, UnitInertia
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder

# Edge of the facets of hydroelastic surfaces, of the shape's smallest size.
RESOLUTION = 0.25
# Most steps of one call in a replay.
STRETCH = 64

clock = time.thread_time_ns


def transform(pose):
    """From a place and a quaternion w, x, y, z."""
    return RigidTransform(Quaternion(wxyz=np.array(pose[3:]) / np.linalg.norm(pose[3:])), pose[:3])


def shape_of(shape):
    kind, size = shape["kind"], shape["size"]
    if kind == "convex":
        return Convex(points=np.reshape(size, (-1, 3)).T, label="hull")
    return {"sphere": Sphere, "box": Box, "capsule": Capsule, "cylinder": Cylinder, "half_space": HalfSpace}[kind](*size)


def smallest(shape):
    """Its smallest size."""
    kind, size = shape["kind"], shape["size"]
    return min(np.ptp(np.reshape(size, (-1, 3)), axis=0)) if kind == "convex" else min(size, default=1.0)


class Scene:
    """A plant with its simulator."""

    def __init__(self, described):
        self.dt, self.limit_s, self.steps = described["step_s"], described["limit_s"], 0
        self.allow()
        builder = DiagramBuilder()
        # A plant with an integrator is continuous.
        self.integrated = bool(described["simulator"])
        plant = MultibodyPlantConfig(time_step=0.0 if self.integrated else self.dt, **described["plant"])
        # The type is given to each shape below.
        self.hydroelastic = described["proximity"].pop("compliance_type", "undefined") != "undefined"
        shapes = DefaultProximityProperties(**described["proximity"])
        self.modulus = shapes.hydroelastic_modulus
        graph = SceneGraphConfig(default_proximity_properties=shapes)
        self.plant, _ = AddMultibodyPlant(plant, graph, builder)
        self.plant.mutable_gravity_field().set_gravity_vector(described["gravity"])
        self.numbers = {}
        for collider in described["fixed"]:
            self.add(self.plant.world_body(), collider)
        self.bodies = []
        for k, each in enumerate(described["bodies"]):
            mass, inertia = each["mass"], np.reshape(each["inertia"], (3, 3))
            turning = RotationalInertia(*(inertia[i, i] for i in range(3)), inertia[0, 1], inertia[0, 2], inertia[1, 2])
            unit = UnitInertia(*(turning.get_moments() / mass), *(turning.get_products() / mass))
            body = self.plant.AddRigidBody(f"body{k}", SpatialInertia(mass, np.zeros(3), unit))
            self.bodies.append(body)
            for collider in each["colliders"]:
                self.add(body, collider)
        self.plant.Finalize()
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        if self.integrated:
            ApplySimulatorConfig(SimulatorConfig(max_step_size=self.dt, **described["simulator"]), self.simulator)
        self.root = self.simulator.get_mutable_context()
        self.context = self.plant.GetMyMutableContextFromRoot(self.root)
        self.simulator.Initialize()

    def add(self, body, collider):
        properties, shape = ProximityProperties(), collider["shape"]
        friction = CoulombFriction(collider["friction"], collider["friction"])
        AddContactMaterial(properties=properties, friction=friction)
        # Facets would keep a ball from rolling: what touches in a point keeps point contact, the fallback.
        if self.hydroelastic and shape["kind"] not in ("sphere", "capsule"):
            edge = RESOLUTION * smallest(shape)
            if body is self.plant.world_body():
                AddRigidHydroelasticProperties(resolution_hint=edge, properties=properties)
            else:
                AddCompliantHydroelasticProperties(
                    resolution_hint=edge, hydroelastic_modulus=self.modulus, properties=properties
                )
        name = f"g{collider['number']}"
        geometry = self.plant.RegisterCollisionGeometry(
            body, transform(collider["pose"]), shape_of(shape), name, properties
        )
        self.numbers[geometry] = collider["number"]

    def push(self, poses, velocities):
        for k, body in enumerate(self.bodies):
            self.plant.SetFreeBodyPose(self.context, body, transform(poses[7 * k : 7 * k + 7]))
            v = velocities[6 * k : 6 * k + 6]
            self.plant.SetFreeBodySpatialVelocity(self.context, body, SpatialVelocity(w=v[3:], v=v[:3]))

    def force(self, loads):
        """Forces and torques of the bodies."""
        rows = []
        for body, load in zip(self.bodies, np.reshape(loads, (-1, 6))):
            row = ExternallyAppliedSpatialForce()
            row.body_index, row.p_BoBq_B = body.index(), np.zeros(3)
            row.F_Bq_W = SpatialForce(tau=load[3:], f=load[:3])
            rows.append(row)
        self.plant.get_applied_spatial_force_input_port().FixValue(self.context, rows)

    def pull(self):
        poses, velocities = [], []
        for body in self.bodies:
            pose = self.plant.EvalBodyPoseInWorld(self.context, body)
            velocity = self.plant.EvalBodySpatialVelocityInWorld(self.context, body)
            poses += [*pose.translation(), *pose.rotation().ToQuaternion().wxyz()]
            velocities += [*velocity.translational(), *velocity.rotational()]
        return poses, velocities

    def start(self):
        """Back to time zero."""
        self.root.SetTime(0.0)
        self.steps = 0
        self.simulator.Initialize()

    def allow(self):
        """Ends this process if it goes on for longer than a run may."""
        if self.limit_s is not None:
            until = math.ceil(time.process_time() + self.limit_s) + 1
            resource.setrlimit(resource.RLIMIT_CPU, (until, resource.getrlimit(resource.RLIMIT_CPU)[1]))

    def advance(self, steps):
        """CPU time of steps, ns."""
        self.allow()
        self.steps += steps
        # Drake updates a discrete plant at the begin of each step.
        until = (self.steps if self.integrated else self.steps - 0.5) * self.dt
        begin = clock()
        self.simulator.AdvanceTo(until, interruptible=False)
        return clock() - begin - OVERHEAD_NS

    def overlap(self):
        """The deepest of a pair of shapes."""
        pairs = self.plant.get_geometry_query_input_port().Eval(self.context).ComputePointPairPenetration()
        return max((pair.depth for pair in pairs), default=0.0)

    def contacts(self):
        """Every contact of the last step, with its force on the second shape."""
        results = self.plant.get_contact_results_output_port().Eval(self.context)
        rows = []
        for i in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(i)
            pair = info.point_pair()
            # Its normal points from the second shape to the first.
            numbers = self.numbers[pair.id_A], self.numbers[pair.id_B]
            rows.append([*numbers, *info.contact_point(), *-pair.nhat_BA_W, *info.contact_force(), -pair.depth])
        for i in range(results.num_hydroelastic_contacts()):
            info = results.hydroelastic_contact_info(i)
            surface = info.contact_surface()
            # Its normal points into the first shape, its force acts on the first at the surface's centroid.
            numbers = self.numbers[surface.id_M()], self.numbers[surface.id_N()]
            force = -info.F_Ac_W().translational()
            normal = force / max(np.linalg.norm(force), 1e-300)
            rows.append([*numbers, *surface.centroid(), *normal, *force, 0.0])
        return np.array(rows)


def overhead_ns():
    spent = []
    for _ in range(2000):
        begin = clock()
        spent.append(clock() - begin)
    return sorted(spent)[len(spent) // 2]


def read(stream, count):
    data = stream.read(count)
    if len(data) != count:
        sys.exit(0)
    return data


def floats(stream, count):
    return np.frombuffer(read(stream, 8 * count))


def replay(scene, log, longest_ns):
    """CPU seconds per step of the same run."""
    scene.start()
    total = count = 0
    for op, values in log:
        if op != b"S":
            (scene.push if op == b"P" else scene.force)(*values)
            continue
        for done in range(0, values, STRETCH):
            steps = min(STRETCH, values - done)
            total += scene.advance(steps)
            count += steps
            if total > longest_ns:
                return total * 1e-9 / count
    return total * 1e-9 / max(count, 1)


def main():
    source, sink = sys.stdin.buffer, sys.stdout.buffer

    def answer(*parts):
        sink.write(np.concatenate([np.atleast_1d(part) for part in parts]).astype(float).tobytes())
        sink.flush()

    (length,) = struct.unpack("<Q", read(source, 8))
    try:
        scene = Scene(json.loads(read(source, length)))
    except (RuntimeError, ValueError, TypeError) as error:
        message = str(error).encode()
        sink.write(struct.pack("<dd", 0.0, len(message)) + message)
        sink.flush()
        return
    nq, nv = 7 * len(scene.bodies), 6 * len(scene.bodies)
    log, reported = [], False
    answer(1.0, nq, nv, 0)
    while True:
        op = read(source, 1)
        if op == b"P":
            values = floats(source, nq + nv)
            values = values[:nq], values[nq:]
            scene.push(*values)
            log.append((op, values))
        elif op == b"F":
            values = (floats(source, nv),)
            scene.force(*values)
            log.append((op, values))
        elif op == b"S":
            if log and log[-1][0] == b"S":
                log[-1] = (op, log[-1][1] + 1)
            else:
                log.append((op, 1))
            failed = spent = overlap = 0.0
            try:
                spent = scene.advance(1) * 1e-9
                overlap = scene.overlap()
            except RuntimeError as error:
                if not reported:
                    print(f"a step of Drake failed: {error}", file=sys.stderr)
                    reported = True
                failed = 1.0
            answer(spent, overlap, failed, *scene.pull())
        elif op == b"C":
            found = scene.contacts()
            answer(len(found), found.ravel())
        elif op == b"R":
            (longest,) = floats(source, 1)
            answer(replay(scene, log, longest * 1e9))


OVERHEAD_NS = overhead_ns()
main()
