"""Diffrax on the CPU: Dopri8 in double precision, compiled by JAX for each mode, with events found by Newton's method.

class: events
table: default
"""
import functools

import diffrax
import jax
import jax.numpy as jnp
import optimistix

import hybrid
import problem as shared

jax.config.update("jax_enable_x64", True)

SETTINGS = {"default": {"rtol": 1e-10}}


@functools.lru_cache(maxsize=None)
def compiled(problem, mode, rtol):
    """A run in a mode, compiled once; times, state and parameters are arguments."""
    term = diffrax.ODETerm(lambda t, y, p: jnp.stack(
        [jnp.asarray(f, float) for f in hybrid.right_hand_side(problem, mode, t, y, p, jnp)]))

    count = len(hybrid.guards(problem, mode, 0.0, problem.y0, problem.parameters(0.0), jnp))
    ends = [lambda t, y, args, i=i, **_: hybrid.guards(problem, mode, t, y, args, jnp)[i] for i in range(count)]
    # Newton converges quadratically, so that its last iterate is far better; with a stricter test it gave up at times.
    root_finder = optimistix.Newton(rtol=1e-8, atol=3e-6 * problem.time_scale)
    event = diffrax.Event(ends, root_finder, direction=False)
    # No step may cross two ends of a mode.
    longest = problem.time_scale / (4 if mode in ("slip", "fast", "slow") else 20)
    solver = diffrax.Dopri8()
    control = diffrax.PIDController(rtol=rtol, atol=1e-3 * rtol, dtmax=longest)

    @jax.jit
    def run(t0, t1, y0, p, times):
        saved = diffrax.SubSaveAt(ts=jnp.clip(times, t0, t1)), diffrax.SubSaveAt(t1=True)
        sol = diffrax.diffeqsolve(term, solver, t0, t1, None, y0, args=p, stepsize_controller=control, event=event,
                                  saveat=diffrax.SaveAt(subs=saved), max_steps=None)
        return sol.ts[1][-1], sol.ys[1][-1], sol.ys[0], jnp.stack(sol.event_mask)

    return run


def solve(problem, options):
    # as many times in every call, so that nothing is compiled again
    width = 64

    def integrate(mode, p, t0, t1, y0, times):
        run = compiled(problem, mode, options["rtol"])
        states = []
        while True:
            # pieces of as many grid times as a compiled call takes
            piece = times[:width]
            end = t1 if len(times) <= width else piece[-1]
            padded = piece + [end] * (width - len(piece))
            t, y, rows, fallen = run(t0, end, jnp.array(y0), jnp.array(p), jnp.array(padded))
            passed = sum(x <= t for x in piece)
            states += rows[:passed].tolist()
            if any(fallen) or end == t1:
                return float(t), y.tolist(), int(jnp.argmax(fallen)) if any(fallen) else None, states
            t0, y0, times = float(t), y.tolist(), times[width:]

    return hybrid.run(problem, integrate)


if __name__ == "__main__":
    shared.main(solve, "Diffrax", diffrax.__version__, SETTINGS, compiles=True)
