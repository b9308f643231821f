"""MuJoCo with a box on a plane: the soft contact of its documentation, with one coefficient of friction.

class: time stepping, soft contact
table: default rigid
figure: rigid-fine
The box has two sliding joints, along the ground and upwards. The normal force is its weight; where it varies, a
vertical force does that. Before t = 0 the box settles for half a second.
"""
import mujoco

import problem as shared

SOFT = {"solref": "0.02 1", "solimp": "0.9 0.95 0.001", "cone": "pyramidal", "impratio": 1,     # as they come
        "threshold": 1e-3}


def rigid(dt):
    # the documentation asks for a time constant of at least two steps; with two the box trembles, with four it does not
    return {"dt": dt, "solref": f"{4 * dt:g} 1", "solimp": "0.9999 0.9999 0.001", "cone": "elliptic",
            "impratio": 10, "threshold": 0.1 * dt}


SETTINGS = {"default": {"dt": 0.002, **SOFT}, "rigid": rigid(0.0005), "rigid-fine": rigid(0.0001)}

MODEL = """
<mujoco>
  <option timestep="{dt}" gravity="0 0 -{g}" integrator="implicitfast" cone="{cone}" impratio="{impratio}"/>
  <default><geom friction="{mu} 0 0" solref="{solref}" solimp="{solimp}" condim="3"/></default>
  <worldbody>
    <geom type="plane" size="100 1 1"/>
    <body pos="0 0 0.1">
      <joint name="along" type="slide" axis="1 0 0" stiffness="{k}" damping="{c}"/>
      <joint name="up" type="slide" axis="0 0 1"/>
      <geom type="box" size="0.1 0.1 0.1" mass="{m}"/>
    </body>
  </worldbody>
</mujoco>
"""


def solve(problem, options):
    mass = problem.mass()
    mu = mass.one_coefficient()
    if mass.belt:
        raise shared.Unsupported("this adapter has no belt")
    weight = shared.value(mass.load, 0.0)
    text = MODEL.format(g=weight / mass.m, mu=mu, k=mass.k, c=mass.c, m=mass.m, **options)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    while data.time < 0.5:                  # the box settles, where it starts, at rest
        mujoco.mj_step(model, data)
    data.time, data.qpos[0], data.qvel[0] = 0.0, mass.x0, mass.v0

    def step(t, jump):
        data.qvel[0] += jump
        data.qfrc_applied[:] = shared.value(mass.force, t), weight - shared.value(mass.load, t)
        mujoco.mj_step(model, data)
        return data.qpos[0], data.qvel[0]

    return mass.stepped(options["dt"], step), None


if __name__ == "__main__":
    shared.main(solve, "MuJoCo, contact", mujoco.__version__, SETTINGS)
