"""Newton (Warp) on the CPU: a box on a plane, in single precision, with one coefficient of friction.

class: time stepping, soft contact
table: xpbd semi-implicit
The box is flat and free to turn. The normal force is its weight; where it varies, a vertical force does that. The
spring is a force on its centre, that of the beginning of a step. Before t = 0 the box settles for half a second.
"""
import importlib.metadata

import problem as shared

# kf: slope of the friction of the semi-implicit solver near rest; iterations as in the examples of Newton
SETTINGS = {"xpbd": {"dt": 1 / 240, "solver": "SolverXPBD", "iterations": 10, "threshold": 1e-3},
            "semi-implicit": {"dt": 0.001, "solver": "SolverSemiImplicit", "ke": 1e4, "kd": 200.0, "kf": 1000.0,
                              "threshold": 1e-3}}
MOST_STEPS = 13000


def solve(problem, options):
    mass, dt = problem.mass(), options["dt"]
    mu = mass.one_coefficient()
    if mass.belt:
        raise shared.Unsupported("this adapter has no belt")
    if problem.end_time / dt > MOST_STEPS:
        raise shared.Unsupported(f"not run: {problem.end_time / dt:.0f} steps of about 1 ms of wall time each on a CPU")
    import newton                           # late, as it takes seconds, and most problems are not for this adapter
    import numpy as np
    import warp as wp
    weight = shared.value(mass.load, 0.0)
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, -weight / mass.m))
    material = {k: options[k] for k in ("ke", "kd", "kf") if k in options}
    shape = newton.ModelBuilder.ShapeConfig(density=mass.m / (1.0 * 1.0 * 0.1), mu=mu, **material)
    builder.add_ground_plane(cfg=shape)
    body = builder.add_body(xform=wp.transform(wp.vec3(mass.x0, 0.0, 0.05), wp.quat_identity()))
    builder.add_shape_box(body, hx=0.5, hy=0.5, hz=0.05, cfg=shape)
    model = builder.finalize(device="cpu")
    arguments = {"iterations": options["iterations"]} if "iterations" in options else {"angular_damping": 0.0}
    solver = getattr(newton.solvers, options["solver"])(model, **arguments)
    states, control = [model.state(), model.state()], model.control()
    pipeline = newton.CollisionPipeline(model)
    contacts = pipeline.contacts()

    def advance(force):
        now, then = states
        now.clear_forces()
        now.body_f.numpy()[0, :3] = force           # on the CPU a view
        pipeline.collide(now, contacts)
        solver.step(now, then, control, contacts, dt)
        states.reverse()

    for _ in range(round(0.5 / dt)):
        advance((0.0, 0.0, 0.0))
    states[0].body_q.numpy()[0, 0] = mass.x0
    states[0].body_qd.numpy()[0] = np.array([mass.v0, 0, 0, 0, 0, 0], np.float32)

    def step(t, jump):
        states[0].body_qd.numpy()[0, 0] += jump
        x, v = float(states[0].body_q.numpy()[0, 0]), float(states[0].body_qd.numpy()[0, 0])
        advance((mass.applied(t, x, v), 0.0, weight - shared.value(mass.load, t)))
        return float(states[0].body_q.numpy()[0, 0]), float(states[0].body_qd.numpy()[0, 0])

    return mass.stepped(dt, step), None


if __name__ == "__main__":
    shared.main(solve, "Newton", importlib.metadata.version("newton"), SETTINGS, compiles=True)
