"""SciPy's LSODA with friction as a smooth function of the speed: mu(|v|) tanh(v/eps), the usual way around events.

class: regularised
table: default
figure: narrow wide
Where the static coefficient is above that of slow sliding, the law has a peak of the width 10 eps, as that of
Stribeck. Contacts that are smooth by themselves are taken as they are. No events: what is rest is a matter of a
threshold.
"""
import bisect
import math

import numpy as np
import scipy
from scipy.integrate import solve_ivp

import problem as shared

SETTINGS = {"default": {"eps": 1e-4, "rtol": 1e-8, "threshold": 5e-4},
            "wide": {"eps": 1e-3, "rtol": 1e-8, "threshold": 5e-3},
            "narrow": {"eps": 1e-5, "rtol": 1e-8, "threshold": 5e-5}}


def solve(problem, options):
    eps, law = options["eps"], problem.friction
    peak = 0.0 if problem.smooth else problem.static - shared.coefficient(law, 0.0)

    def rhs(t, y, p):
        y = y.tolist()
        v = problem.slip_speed(y)
        if problem.smooth:
            return problem.rate("smooth", t, y, [math.copysign(1.0, v)] + p[1:])
        f, x = problem.free(t, y, p), abs(v)
        mu = shared.coefficient(law, x) + peak * math.exp(-min(x / (10 * eps), 20.0) ** 2)
        torque = mu * math.tanh(v / eps) * problem.radius * max(0.0, problem.normal_force(t, y, p))
        for i, share in problem.d.items():
            f[i] += share * torque
        return f

    times, t, y, rows = problem.dense_times(), 0.0, np.array(problem.y0), []
    # A restart at every corner and kick. The step is bound: in stick LSODA may step over a whole slip.
    for end in problem.corners + [problem.end_time]:
        wanted = times[bisect.bisect_left(times, t):bisect.bisect_left(times, end)] + [end]
        run = solve_ivp(rhs, (t, end), y, method="LSODA", t_eval=wanted, rtol=options["rtol"],
                        atol=1e-3 * options["rtol"], args=(problem.parameters(t),), max_step=problem.time_scale / 4)
        if not run.success:
            raise RuntimeError(run.message)
        states = run.y.T
        rows += [[x] + problem.row(s) for x, s in zip(run.t.tolist(), states.tolist())]
        t, y = end, states[-1].copy()
        for i, share in problem.d.items():
            y[i] -= share * problem.kicks.get(end, 0.0) / problem.compliance
    rows = {r[0]: r for r in rows}          # after a kick, not before
    return list(rows.values()), None


if __name__ == "__main__":
    shared.main(solve, "SciPy, tanh", scipy.__version__, SETTINGS)
