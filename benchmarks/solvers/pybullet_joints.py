"""PyBullet with the friction of a joint: a velocity motor whose largest force is that of friction.

class: complementarity
table: default
figure: fine
The target of the motor is the speed of the belt. Its largest force is set anew before every step, from the load and
the speed of the last one: so it follows any law, one step late. Spring and damper are forces of the last step as
well.
"""
import importlib.metadata

import pybullet

import problem as shared

# rest: the speed up to which the static coefficient holds
SETTINGS = {"default": {"dt": 0.001, "rest": 1e-6, "threshold": 1e-6},
            "fine": {"dt": 0.0001, "rest": 1e-6, "threshold": 1e-6}}


def solve(problem, options):
    if problem.smooth:
        raise shared.Unsupported("the force of a motor is a limit, not a regularised law")
    mass = problem.mass()
    client = pybullet.connect(pybullet.DIRECT)
    try:
        pybullet.setTimeStep(options["dt"])
        shape = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=0.1)
        body = pybullet.createMultiBody(
            baseMass=0, linkMasses=[mass.m], linkCollisionShapeIndices=[shape], linkVisualShapeIndices=[-1],
            linkPositions=[[0, 0, 0]], linkOrientations=[[0, 0, 0, 1]], linkInertialFramePositions=[[0, 0, 0]],
            linkInertialFrameOrientations=[[0, 0, 0, 1]], linkParentIndices=[0],
            linkJointTypes=[pybullet.JOINT_PRISMATIC], linkJointAxis=[[1, 0, 0]])
        # PyBullet damps every link by default
        pybullet.changeDynamics(body, 0, linearDamping=0, angularDamping=0, jointDamping=0)
        pybullet.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
        pybullet.resetJointState(body, 0, mass.x0, mass.v0)
        state = [mass.x0, mass.v0]

        def step(t, jump):
            if jump:
                state[1] += jump
                pybullet.resetJointState(body, 0, *state)
            limit = mass.limit(t, state[1] - mass.belt, options["rest"])
            pybullet.setJointMotorControl2(body, 0, pybullet.VELOCITY_CONTROL, targetVelocity=mass.belt, force=limit)
            pybullet.setJointMotorControl2(body, 0, pybullet.TORQUE_CONTROL, force=mass.applied(t, *state))
            pybullet.stepSimulation()
            state[:] = pybullet.getJointState(body, 0)[:2]
            return state

        return mass.stepped(options["dt"], lambda t, jump: tuple(step(t, jump))), None
    finally:
        pybullet.disconnect(client)


if __name__ == "__main__":
    shared.main(solve, "PyBullet, joint", importlib.metadata.version("pybullet"), SETTINGS)
