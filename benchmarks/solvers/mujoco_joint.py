"""MuJoCo with the friction of a joint (frictionloss), a soft constraint whose softness is set by solref and solimp.

class: time stepping, soft contact
table: default rigid
figure: rigid-fine
The joint moves against a frame that goes with the belt, and the reference of its spring goes backwards. The
frictionloss is set anew before every step, from the load and the speed of the last one: so it follows any law, one
step late.
"""
import mujoco

import problem as shared



def rigid(dt):
    return {"dt": dt, "solref": f"{2 * dt:g} 1", "solimp": "0.9999 0.9999 0.001", "rest": 0.1 * dt,
            "threshold": 1e-3 * dt}


# rest: the speed up to which the static coefficient holds; the joint creeps a little while it sticks
SETTINGS = {"default": {"dt": 0.002, "solref": "0.02 1", "solimp": "0.9 0.95 0.001", "rest": 1e-3,
                        "threshold": 1e-3},      # as they come
            "rigid": rigid(0.0005), "rigid-fine": rigid(0.0001)}

MODEL = """
<mujoco>
  <option timestep="{dt}" gravity="0 0 0" integrator="implicitfast"/>
  <worldbody>
    <body>
      <joint type="slide" axis="1 0 0" stiffness="{k}" damping="{c}" frictionloss="1"
             solreffriction="{solref}" solimpfriction="{solimp}"/>
      <geom size="0.1" mass="{m}"/>
    </body>
  </worldbody>
</mujoco>
"""


def solve(problem, options):
    if problem.smooth:
        raise shared.Unsupported("the friction of a joint is a limit, not a regularised law")
    mass = problem.mass()
    if mass.c and mass.belt:
        # the joint's damper would act against the frame of the belt; this one acts against the ground, as a force
        damping, ground = 0.0, mass.c
    else:
        damping, ground = mass.c, 0.0
    model = mujoco.MjModel.from_xml_string(MODEL.format(k=mass.k, c=damping, m=mass.m, **options))
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = mass.x0, mass.v0 - mass.belt

    def step(t, jump):
        data.qvel[0] += jump
        model.qpos_spring[0] = -mass.belt * t
        model.dof_frictionloss[0] = mass.limit(t, data.qvel[0], options["rest"])
        data.qfrc_applied[0] = shared.value(mass.force, t) - ground * (data.qvel[0] + mass.belt)
        mujoco.mj_step(model, data)
        return data.qpos[0] + mass.belt * data.time, data.qvel[0] + mass.belt

    return mass.stepped(options["dt"], step), None


if __name__ == "__main__":
    shared.main(solve, "MuJoCo, joint", mujoco.__version__, SETTINGS)
