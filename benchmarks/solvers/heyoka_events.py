"""heyoka: Taylor series compiled for each mode, with terminal events found on the polynomials of every step.

class: events
table: default
figure: coarse
"""
import heyoka as hy
import numpy as np

import hybrid
import problem as shared

SETTINGS = {"default": {"tol": 2.2e-16}, "coarse": {"tol": 1e-8}}


class Symbols:
    exp, sin, cos, tanh = hy.exp, hy.sin, hy.cos, hy.tanh
    arctan = hy.atan


compiled = {}


def integrators(problem, mode, tol):
    """The compiled integrators of a mode, without and with its events, and which guards these are."""
    if (problem.problem, mode, tol) not in compiled:
        y = [hy.make_vars(name) for name in problem.state]
        p = [hy.par[i] for i in range(len(problem.parameters(0.0)))]    # what is constant between two restarts
        rates = [hy.expression(0.0) + f for f in hybrid.right_hand_side(problem, mode, hy.time, y, p, Symbols)]
        guards = [hy.expression(0.0) + g for g in hybrid.guards(problem, mode, hy.time, y, p, Symbols)]
        # heyoka takes no constant for an event
        falls = [i for i, g in enumerate(guards) if hy.get_variables(hy.subs(g, {hy.time: hy.make_vars("t")}))]
        ends = [hy.t_event(guards[i], direction=hy.event_direction.negative) for i in falls]

        def compiled_with(events):
            system = list(zip(y, rates))
            return hy.taylor_adaptive(system, np.zeros(len(y)), t_events=events, tol=tol, compact_mode=True)

        compiled[problem.problem, mode, tol] = compiled_with([]), compiled_with(ends), falls
    return compiled[problem.problem, mode, tol]


def solve(problem, options):
    def integrate(mode, p, t0, t1, y0, times):
        leave, go, falls = integrators(problem, mode, options["tol"])
        states, outcome = [], hy.taylor_outcome.time_limit
        # A mode begins where a guard is zero, at which heyoka would stop again: the first bit goes without events.
        for ta, end in ((leave, min(t1, t0 + 1e-6 * problem.time_scale)), (go, t1)):
            ta.time, ta.state[:], ta.pars[:] = t0, y0, p[:len(ta.pars)]
            if ta.with_events:
                ta.reset_cooldowns()
            outcome, _, _, _, path, _ = ta.propagate_until(end, c_output=True)
            passed = [x for x in times if t0 < x <= ta.time]
            states += [y.tolist() for y in path(passed)] if passed else []
            t0, y0 = ta.time, ta.state.tolist()
        # a terminal event that stops has a negative outcome, -1 for the first one
        fallen = None if outcome == hy.taylor_outcome.time_limit else falls[-int(outcome) - 1]
        return t0, y0, fallen, states

    return hybrid.run(problem, integrate)


if __name__ == "__main__":
    shared.main(solve, "heyoka", hy.__version__, SETTINGS, compiles=True)
