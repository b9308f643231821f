"""SUNDIALS CVODE through scikit-SUNDAE, with its root finding for every end of a mode.

class: events
table: default
figure: coarse
Adams in the modes of dry friction, BDF for contacts without stick, which are stiff.
"""
import numpy as np
import sksundae
from sksundae.cvode import CVODE

import hybrid
import problem as shared
from problem import Numbers

SETTINGS = {"default": {"rtol": 1e-10}, "coarse": {"rtol": 1e-6}}


def solve(problem, options):
    def integrate(mode, p, t0, t1, y0, times):
        def rhs(t, y, rate):
            rate[:] = hybrid.right_hand_side(problem, mode, t, y.tolist(), p, Numbers)

        def events(t, y, values):
            values[:] = hybrid.guards(problem, mode, t, y.tolist(), p, Numbers)

        count = len(hybrid.guards(problem, mode, t0, y0, p, Numbers))
        events.terminal, events.direction = [True] * count, [-1] * count
        # no step may cross two ends of a mode
        longest = problem.time_scale / (4 if mode in ("slip", "fast", "slow") else 20)
        solver = CVODE(rhs, eventsfn=events, num_events=count, method="BDF" if problem.smooth else "Adams",
                       rtol=options["rtol"], atol=1e-3 * options["rtol"], max_step=longest, max_num_steps=1000000)
        stops = [t0] + times + ([] if times and times[-1] == t1 else [t1])
        run = solver.solve(np.array(stops if len(stops) > 2 else [t0, (t0 + t1) / 2, t1]), np.array(y0))
        if not run.success:
            raise RuntimeError(run.message)
        states = dict(zip(run.t.tolist(), run.y.tolist()))
        if run.t_events is None:
            return t1, states[t1], None, [states[x] for x in times]
        t, fallen = float(run.t_events[0]), int(np.flatnonzero(run.i_events[0])[0])
        return t, run.y_events[0].tolist(), fallen, [states[x] for x in times if x <= t]

    return hybrid.run(problem, integrate)


if __name__ == "__main__":
    shared.main(solve, "CVODE of SUNDIALS by scikit-SUNDAE", sksundae.__version__, SETTINGS)
