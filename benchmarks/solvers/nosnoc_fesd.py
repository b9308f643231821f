"""nosnoc in Python: Filippov systems by finite elements with switch detection (FESD), a programme for each step.

class: complementarity
table: default
Two regions, by the sign of the relative velocity, with the law of friction in each; stick is their sliding mode, in
which the friction is at most that at zero speed. Time and the distance that has been slipped are states. An event is
where the elements change between slip and sliding.
"""
import contextlib
import importlib.metadata
import io
import math

import casadi as ca
import nosnoc
import numpy as np

import problem as shared

# step: of a nonlinear programme, in parts of the time scale, but not below half of the grid's; its elements have free
# lengths, and are of the Radau type
SETTINGS = {"default": {"step": 0.1, "elements": 3, "stages": 3, "comp_tol": 1e-10}}
MOST_STEPS = 500


def solve(problem, options):
    if problem.smooth:
        raise shared.Unsupported("no stick in this problem: it is a smooth equation, not a Filippov system")
    if problem.static != shared.coefficient(problem.friction, 0.0):
        raise shared.Unsupported("static friction above kinetic is no Filippov system")
    if problem.opens():
        raise shared.Unsupported("the contact opens, which this adapter does not state")
    size = max(options["step"] * problem.time_scale, 0.5 * problem.grid[0]["step"])
    pieces = np.diff([0.0] + problem.corners + [problem.end_time])
    steps = [math.ceil(d / size - 1e-9) for d in pieces]
    if sum(steps) > MOST_STEPS:
        raise shared.Unsupported(f"not run: {sum(steps)} programmes, of some 50 ms of wall time each")
    x = ca.SX.sym("x", len(problem.state) + 2)
    p = ca.SX.sym("p", len(problem.parameters(0.0)))
    t, y, lines = x[-1], [x[i] for i in range(len(problem.state))], [p[i] for i in range(p.shape[0])]
    slips = [ca.vertcat(*problem.rate("slip", t, y, [s] + lines[1:], ca), problem.slip_speed(y), 1.0)
             for s in (1.0, -1.0)]
    state, now, elements = np.array(problem.y0 + [0.0, 0.0]), 0.0, [(0.0, problem.y0 + [0.0, 0.0])]
    for length, count in zip(pieces, steps):
        opts = nosnoc.NosnocOpts()
        opts.N_finite_elements, opts.n_s, opts.comp_tol = options["elements"], options["stages"], options["comp_tol"]
        opts.terminal_time, opts.sigma_N, opts.max_iter_homotopy = length / count, options["comp_tol"], 20
        parameters = np.array(problem.parameters(now))
        model = nosnoc.NosnocModel(x=x, F=[ca.horzcat(*slips)], c=[problem.slip_speed(y)], S=[np.array([[1], [-1]])],
                                   x0=state, p_global=p, p_global_val=parameters)
        with contextlib.redirect_stdout(io.StringIO()):         # it reports every programme
            loop = nosnoc.NosnocSimLooper(nosnoc.NosnocSolver(opts, model), state, count)
            loop.run()
        found = loop.get_results()
        elements += [(now + h, s.tolist()) for h, s in zip(found["t_grid"][1:], found["X_sim"][1:])]
        state, now = found["X_sim"][-1], now + length
    return [[t] + problem.row(s) for t, s in elements], events(problem, elements)


def events(problem, elements):
    """Where the kind of motion of an element differs from that of the one before: stick (0), or slip of either sign."""
    found, before = [], None
    tiny = 1e-6 * max(abs(problem.slip_speed(s)) for _, s in elements)
    for (t0, s0), (t1, s1) in zip(elements, elements[1:]):
        if t1 - t0 < 1e-9 * problem.time_scale:
            continue                        # an element that has shrunk to nothing
        mean = (s1[-2] - s0[-2]) / (t1 - t0)
        kind = 0 if abs(mean) < tiny else (1 if mean > 0 else -1)
        if before is not None and kind != before:
            found.append((t0, "stick" if kind == 0 else "slip" if before == 0 else "reversal"))
        before = kind
    return found


if __name__ == "__main__":
    shared.main(solve, "nosnoc", importlib.metadata.version("nosnoc"), SETTINGS)
