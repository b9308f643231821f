"""Dry friction as a hybrid system, for codes that locate events: what holds in a mode, and what follows an event.

The mode is slip, stick, open (no normal force) or smooth (a contact without stick); the sign of the relative velocity
belongs to it, so that no right-hand side has a jump. Every guard is positive in its mode and ends it as it falls
through zero. A code gives `integrate(mode, parameters, t0, t1, y0, times)`, which returns the time and state at t1 or
at the first event before, the number of the guard that has fallen (or None), and the states at those of the given
times that it has passed.
"""
from problem import TINY, Unsupported


def guards(problem, mode, t, y, p, lib):
    v = p[0] * problem.slip_speed(y)
    if mode == "slip":                      # stop; contact opens
        varies = problem.load["kind"] != "constant"
        return [v] + ([problem.normal_force(t, y, p, lib)] if varies else [])
    if mode == "stick":                     # breakaway forwards, backwards
        limit, torque = problem.limit(t, y, p, lib), problem.holding(t, y, p, lib)
        return [limit - torque, limit + torque]
    if mode == "open":                      # contact closes
        return [-problem.normal_force(t, y, p, lib)]
    if mode == "fast":                      # |v_rel| falls below the threshold
        return [v - problem.threshold]
    return [problem.threshold - v, v]       # slow: it rises above; v_rel changes its sign


def right_hand_side(problem, mode, t, y, p, lib):
    return problem.rate("smooth" if mode in ("fast", "slow") else mode, t, y, p, lib)


def at_rest(problem, t, y):
    """The mode after the relative velocity has become zero, and its sign."""
    p = problem.parameters(t)
    if problem.smooth:                      # where v_rel turns to, after a step of Euler: its derivative may be zero
        p[0] = 1.0
        h = 1e-6 * problem.time_scale
        there = [a + h * b for a, b in zip(y, problem.rate("smooth", t, y, p))]
        change = problem.slip_speed(problem.rate("smooth", t + h, there, p)) - problem.g0
        return "slow", 1.0 if change > 0 else -1.0
    torque, limit = problem.holding(t, y, p), problem.limit(t, y, p)
    if abs(torque) <= limit * (1 + TINY):
        return "stick", 0.0
    return "slip", 1.0 if torque > 0 else -1.0


def moving(problem, t, y, closed=False):
    """The mode at a state, whatever it was before."""
    v = problem.slip_speed(y)
    sign = (v > 0) - (v < 0)
    if not problem.smooth and not closed and problem.normal_force(t, y, problem.parameters(t)) < 0:
        return "open", float(sign)
    if abs(v) < TINY:
        return at_rest(problem, t, y)
    return ("slip" if not problem.smooth else "fast" if abs(v) > problem.threshold else "slow"), float(sign)


def still(problem, y):
    """The state with the relative velocity exactly zero: both surfaces share the rest by momentum."""
    y, excess = list(y), problem.slip_speed(y) / problem.compliance
    for i, x in problem.d.items():
        y[i] += x * excess
    return y


def run(problem, integrate):
    t, y, events = 0.0, list(problem.y0), []
    rows, waiting = [[0.0] + problem.row(y)], [x for x in problem.grid_times if x > 0]
    mode, sign = moving(problem, t, y)
    while t < problem.end_time:
        while waiting and waiting[0] <= t + 1e-14 * max(t, 1.0):     # as near as rounding
            rows.append([waiting.pop(0)] + problem.row(y))
        end = next((c for c in problem.corners if c > t), problem.end_time)
        times = [x for x in waiting if x <= end]
        t, y, fallen, states = integrate(mode, problem.parameters(t, sign), t, end, y, times)
        rows += [[x] + problem.row(s) for x, s in zip(times, states)]
        waiting = waiting[len(states):]
        if len(events) > 5000:
            raise Unsupported("more than 5000 events: the run was given up")
        if fallen is None:                  # a corner, a kick, or the end
            if t in problem.kicks:
                before, was = mode, sign
                for i, x in problem.d.items():
                    y[i] -= x * problem.kicks[t] / problem.compliance
                mode, sign = moving(problem, t, y)
                if before == "stick" and mode == "slip":
                    events.append((t, "slip"))
                elif before == "slip" and mode == "slip" and sign != was:
                    events.append((t, "reversal"))
                elif before == "slip" and mode == "stick":
                    events.append((t, "stick"))
        elif mode == "slip" and fallen == 0:
            y, was = still(problem, y), sign
            mode, sign = at_rest(problem, t, y)
            events.append((t, "stick" if mode == "stick" else "reversal"))
            if mode == "slip" and sign == was:      # v_rel touches zero and goes on: no event
                events.pop()
        elif mode == "stick":
            mode, sign = "slip", 1.0 if fallen == 0 else -1.0
            events.append((t, "slip"))
        elif mode == "slip":
            mode = "open"
        elif mode == "open":
            mode, sign = moving(problem, t, y, closed=True)
        elif mode == "slow" and fallen == 1:
            sign = -sign
        else:
            events.append((t, "stick" if mode == "fast" else "slip"))
            mode = "slow" if mode == "fast" else "fast"
    return rows, events
