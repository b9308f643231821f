"""SciPy's solve_ivp with an event for every end of a mode: the reference for times.

class: events
table: default
figure: coarse fine
One right-hand side for each mode (hybrid.py), DOP853, terminal events with a direction, restarts after each.
"""
import numpy as np
import scipy
from scipy.integrate import solve_ivp

import hybrid
import problem as shared
from problem import Numbers

# atol is a thousandth of rtol, for states of the order of millimetres
SETTINGS = {"default": {"rtol": 1e-10}, "coarse": {"rtol": 1e-6}, "fine": {"rtol": 1e-12}}


def solve(problem, options):
    def integrate(mode, p, t0, t1, y0, times):
        def rhs(t, y):
            return hybrid.right_hand_side(problem, mode, t, y.tolist(), p, Numbers)

        def event(i):
            def g(t, y):
                return hybrid.guards(problem, mode, t, y.tolist(), p, Numbers)[i]
            g.terminal, g.direction = True, -1
            return g

        events = [event(i) for i in range(len(hybrid.guards(problem, mode, t0, y0, p, Numbers)))]
        method = "Radau" if problem.smooth else "DOP853"        # contacts without stick are stiff
        # Nothing bounds the steps in stick, and in slip little: no step may cross two ends of a mode.
        longest = problem.time_scale / (4 if mode in ("slip", "fast", "slow") else 20)
        run = solve_ivp(rhs, (t0, t1), np.array(y0), events=events, t_eval=times if t1 in times else times + [t1],
                        method=method, rtol=options["rtol"], atol=1e-3 * options["rtol"], max_step=longest)
        if run.status < 0:
            raise RuntimeError(run.message)
        states = [y.tolist() for y in np.transpose(run.y)]
        if run.status == 0:
            return t1, states[-1], None, states[:len(times)]
        fallen = next(i for i, e in enumerate(run.t_events) if len(e))
        return run.t_events[fallen][0], run.y_events[fallen][0].tolist(), fallen, states

    return hybrid.run(problem, integrate)


if __name__ == "__main__":
    shared.main(solve, "SciPy solve_ivp", scipy.__version__, SETTINGS)
