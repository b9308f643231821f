"""Draws datasets, and whatever else can be drawn."""

from __future__ import annotations

from typing import Any

from ._comparison import Comparison
from ._cycle import Cycle
from ._errors import InputError
from ._plot import plot_branches, plot_sweep
from ._run import Run


def plot(what: Any, quantity: str | None = None, *, ax: Any = None, at: dict[str, Any] | None = None, **style: Any) -> Any:
    """Draws a sweep or branches, or anything of this module that has a method ``plot``; returns the axes.

        study = stickslip.sweep({"friction.decay": {"from": 3, "to": 8, "count": 30}}, "paper")
        stickslip.plot(study, "stick_count")

    :param what: a dataset of :func:`sweep`, of :func:`follow` or of their files; or a run, a cycle or a comparison.
    :param quantity: what is drawn: of a sweep the number of sticks if it has any, of branches the amplitude.
    :param ax: axes of matplotlib to draw into.
    :param at: of a sweep with more than two axes the values of the others, ``{"rotor_speed": 0.3}``; the nearest points are taken.
    :param style: passed to matplotlib.
    :raises InputError: no such quantity; matplotlib is not installed.
    """
    if isinstance(what, (Run, Cycle, Comparison)):
        if at:
            raise InputError(f"at chooses points of a sweep, and this is a {type(what).__name__}; leave it out")
        if quantity is not None:
            raise InputError(f"quantity is one of a dataset, and this is a {type(what).__name__}; use its method plot")
        return what.plot(ax=ax, **style)
    if not hasattr(what, "data_vars"):
        raise InputError(f"a {type(what).__name__} cannot be drawn; give a dataset of sweep or follow, a run, a cycle or a comparison")
    if "number" in what.attrs and "special" in what:
        return plot_branches(what, quantity, ax, **style)
    return plot_sweep(what, quantity, ax, at or {}, **style)
