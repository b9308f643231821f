"""What users write, for the type checker; it is not run."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor

import numpy as np
from numpy.typing import NDArray

import stickslip

run: stickslip.Run = stickslip.run("paper", {"friction.decay": "4.8 s/rad", "torsion.damping": 22.6}, method="series")
force: NDArray[np.float64] = run.trajectory["normal_force"]
unit: str = run.units["normal_force"]
onset = run.summary["onset_time"]
certificate = stickslip.certify(run, digits=9)
digits: int | None = certificate.digits
comparison = stickslip.compare(run, time=np.arange(3.0), relative_velocity=np.zeros(3))
verdict: str = comparison.verdict
opened = stickslip.open("paper.h5")
if isinstance(opened, stickslip.Run):
    opened.events_table()
counted: list[int] = []
stickslip.sweep("paper-decay", output="map.h5", resume=True, progress=lambda done, total: counted.append(done))
stickslip.sweep("paper-decay", progress=True)
stickslip.sweep("paper-decay", executor=ProcessPoolExecutor(2))
names: list[str] = [case.name for case in stickslip.cases()]
cycle: stickslip.Cycle = stickslip.cycle("belt-exponential", {"rotor.speed": 0.3}, start="end")
multipliers: NDArray[np.complex128] = cycle.multipliers
period: float = cycle.period
axes = run.plot("normal_force", window=(6.9, 7.0), sticks=False)
cycle.plot("slip_displacement")
comparison.plot()
stickslip.plot(stickslip.sweep("paper-decay"), "stick_count")
merged: dict[str, NDArray[np.float64]] = run.trajectory_with_events()
run.to_xarray(events=True), run.to_pandas(events=True)
stickslip.run("paper", progress=True)
stickslip.follow("belt-branches", progress=lambda done, total: None)
stickslip.continue_({"rotor.speed": {"from": 0.2, "to": 0.8}}, "belt-exponential", of=("steady", "cycle"), output="b.h5")
