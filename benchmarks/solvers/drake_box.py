"""Drake's MultibodyPlant: a mass with a spherical foot on a half space, by point contact.

class: time stepping, soft contact
table: lagged sap tamsi continuous
figure: fine
The mass slides along the ground and upwards, and settles for a second before t = 0; its weight is the normal force.
With a belt, the frame goes with the belt, and a growing force moves the reference of the spring. Discrete plants know
the kinetic coefficient only; the continuous one has Stribeck's curve, with a speed of stiction.
"""
import importlib.metadata

import numpy as np
from pydrake.geometry import HalfSpace, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
from pydrake.multibody.tree import PrismaticJoint, PrismaticSpring, SpatialInertia
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import Adder, ConstantVectorSource, Integrator, LogVectorOutput, Sine

import problem as shared

STEP = {"time_step": 0.001, "threshold": 1e-4}
SETTINGS = {name: {**STEP, "discrete_contact_approximation": name} for name in ("lagged", "sap", "tamsi")}
for name, speed, accuracy in ("continuous", 1e-4, 1e-5), ("fine", 1e-5, 1e-6):
    SETTINGS[name] = {"time_step": 0.0, "stiction_tolerance": speed, "integrator": "radau3", "accuracy": accuracy}


def sources(builder, mass):
    """The forces on the mass but for spring, damper and friction."""
    found = [builder.AddSystem(ConstantVectorSource([-mass.c * mass.belt]))]
    for s in shared.parts(mass.force):
        found.append(builder.AddSystem(ConstantVectorSource([s["value"] if s["kind"] == "constant" else s["mean"]])))
        if s["kind"] == "harmonic":
            phase = s["phase"] + (np.pi / 2 if s["shape"] == "cosine" else 0.0)
            found.append(builder.AddSystem(Sine(s["amplitude"], s["angular_frequency"], phase, 1)))
    ports = [f.get_output_port(0) for f in found]
    if mass.belt:
        drift = builder.AddSystem(Integrator(1))
        rate = builder.AddSystem(ConstantVectorSource([-mass.k * mass.belt]))
        builder.Connect(rate.get_output_port(), drift.get_input_port())
        ports.append(drift.get_output_port())
    return ports


def built(mass, options, friction, weight, forces):
    builder = DiagramBuilder()
    config = {k: v for k, v in options.items() if k not in ("integrator", "accuracy", "threshold")}
    plant, _ = AddMultibodyPlant(MultibodyPlantConfig(contact_model="point", **config), builder)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, -weight / mass.m])
    carriage = plant.AddRigidBody("carriage", SpatialInertia.Zero())
    body = plant.AddRigidBody("mass", SpatialInertia.SolidSphereWithMass(mass.m, 0.1))
    middle = carriage.body_frame()
    along = plant.AddJoint(PrismaticJoint("along", plant.world_frame(), middle, [1, 0, 0], damping=mass.c))
    up = plant.AddJoint(PrismaticJoint("up", middle, body.body_frame(), [0, 0, 1]))
    plant.AddForceElement(PrismaticSpring(along, 0.0, mass.k))
    plant.AddJointActuator("motor", along)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", friction)
    plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(0.1), "foot", friction)
    plant.Finalize()
    if forces:
        ports = sources(builder, mass)
        total = builder.AddSystem(Adder(len(ports), 1))
        for i, port in enumerate(ports):
            builder.Connect(port, total.get_input_port(i))
        builder.Connect(total.get_output_port(), plant.get_actuation_input_port())
    log = LogVectorOutput(plant.get_state_output_port(), builder, max(0.001, mass.end_time / 20000))
    simulator = Simulator(builder.Build())
    if options["time_step"] == 0:
        ApplySimulatorConfig(SimulatorConfig(integration_scheme=options["integrator"], accuracy=options["accuracy"],
                                             max_step_size=0.01, use_error_control=True), simulator)
    return simulator, log, plant.GetMyMutableContextFromRoot(simulator.get_mutable_context()), along, up


def solve(problem, options):
    mass = problem.mass()
    weight = mass.constant_load("the normal force is the weight, and the adapter adds none")
    static, kinetic = mass.two_coefficients()
    if options["time_step"] and static != kinetic:
        raise shared.Unsupported("a discrete plant knows the kinetic coefficient only")
    friction = CoulombFriction(static, kinetic)
    simulator, _, context, _, up = built(mass, options, friction, weight, forces=False)     # to settle
    up.set_translation(context, 0.1)
    simulator.AdvanceTo(1.0)
    height = up.get_translation(context)
    simulator, log, context, along, up = built(mass, options, friction, weight, forces=True)
    up.set_translation(context, height)
    along.set_translation(context, mass.x0)
    along.set_translation_rate(context, mass.v0 - mass.belt)
    simulator.Initialize()
    for t, jump in sorted(mass.kicks.items()) + [(problem.end_time, 0.0)]:
        simulator.AdvanceTo(t)
        along.set_translation_rate(context, along.get_translation_rate(context) + jump)
    record = log.FindLog(simulator.get_context())
    t, data = record.sample_times(), record.data()
    return np.column_stack([t, data[0] + mass.belt * t, data[2] + mass.belt]).tolist(), None


if __name__ == "__main__":
    shared.main(solve, "Drake", importlib.metadata.version("drake"), SETTINGS)
