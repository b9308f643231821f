"""DART with the Coulomb friction of a joint, a constraint of its LCP.

class: complementarity
table: default
figure: fine
The joint moves against a frame that goes with the belt, and the rest position of its spring goes backwards. The
friction is set anew before every step, from the load and the speed of the last one: so it follows any law, one step
late.
"""
import dartpy as dart

import problem as shared

# rest: the speed up to which the static coefficient holds
SETTINGS = {"default": {"dt": 0.001, "rest": 1e-9, "threshold": 1e-6},
            "fine": {"dt": 0.0001, "rest": 1e-9, "threshold": 1e-6}}


def solve(problem, options):
    if problem.smooth:
        raise shared.Unsupported("the friction of a joint is a limit, not a regularised law")
    mass = problem.mass()
    skeleton = dart.dynamics.Skeleton("mass")
    joint, body = skeleton.createPrismaticJointAndBodyNodePair()
    inertia = dart.dynamics.Inertia()
    inertia.setMass(mass.m)
    body.setInertia(inertia)
    joint.setAxis([1.0, 0.0, 0.0])
    joint.setPosition(0, mass.x0)
    joint.setVelocity(0, mass.v0 - mass.belt)
    joint.setSpringStiffness(0, mass.k)
    # The joint's damper would act against the frame of the belt: beside a belt, the damper is a force.
    joint.setDampingCoefficient(0, 0.0 if mass.belt else mass.c)
    world = dart.simulation.World()
    world.setGravity([0.0, 0.0, 0.0])
    world.setTimeStep(options["dt"])
    world.addSkeleton(skeleton)

    def step(t, jump):
        v = joint.getVelocity(0) + jump
        joint.setVelocity(0, v)
        joint.setRestPosition(0, -mass.belt * t)
        joint.setCoulombFriction(0, mass.limit(t, v, options["rest"]))
        joint.setForce(0, shared.value(mass.force, t) - (mass.c * (v + mass.belt) if mass.belt else 0.0))
        world.step()
        return joint.getPosition(0) + mass.belt * (t + options["dt"]), joint.getVelocity(0) + mass.belt

    return mass.stepped(options["dt"], step), None


if __name__ == "__main__":
    shared.main(solve, "DART", dart.__version__, SETTINGS)
