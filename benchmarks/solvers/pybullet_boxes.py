"""PyBullet with a box on a plane: contact by sequential impulses, with one coefficient of friction.

class: time stepping, soft contact
table: default
figure: fine
The box is flat and free to turn. The normal force is its weight; where it varies, a vertical force does that. The
spring is a force on its centre. Before t = 0 the box settles for half a second.
"""
import importlib.metadata

import pybullet

import problem as shared

SETTINGS = {"default": {"dt": 1 / 240, "threshold": 1e-4}, "fine": {"dt": 0.0005, "threshold": 1e-4}}


def solve(problem, options):
    mass = problem.mass()
    mu = mass.one_coefficient()
    if mass.belt:
        raise shared.Unsupported("this adapter has no belt")
    weight = shared.value(mass.load, 0.0)
    client = pybullet.connect(pybullet.DIRECT)
    try:
        pybullet.setTimeStep(options["dt"])
        pybullet.setGravity(0, 0, -weight / mass.m)
        ground = pybullet.createMultiBody(0, pybullet.createCollisionShape(pybullet.GEOM_PLANE))
        half = [0.5, 0.5, 0.05]
        box = pybullet.createMultiBody(mass.m, pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half),
                                       basePosition=[mass.x0, 0, half[2]])
        # the coefficients of both are multiplied; PyBullet damps every body by default
        pybullet.changeDynamics(ground, -1, lateralFriction=1)
        pybullet.changeDynamics(box, -1, lateralFriction=mu, linearDamping=0, angularDamping=0)
        for _ in range(round(0.5 / options["dt"])):
            pybullet.stepSimulation()
        place, turn = pybullet.getBasePositionAndOrientation(box)
        pybullet.resetBasePositionAndOrientation(box, [mass.x0, 0, place[2]], turn)
        pybullet.resetBaseVelocity(box, [mass.v0, 0, 0], [0, 0, 0])

        def state():
            return pybullet.getBasePositionAndOrientation(box)[0], pybullet.getBaseVelocity(box)[0]

        def step(t, jump):
            place, speed = state()
            if jump:
                pybullet.resetBaseVelocity(box, [speed[0] + jump, 0, speed[2]], [0, 0, 0])
            force = [mass.applied(t, place[0], speed[0] + jump), 0, weight - shared.value(mass.load, t)]
            pybullet.applyExternalForce(box, -1, force, place, pybullet.WORLD_FRAME)
            pybullet.stepSimulation()
            place, speed = state()
            return place[0], speed[0]

        return mass.stepped(options["dt"], step), None
    finally:
        pybullet.disconnect(client)


if __name__ == "__main__":
    shared.main(solve, "PyBullet, box", importlib.metadata.version("pybullet"), SETTINGS)
