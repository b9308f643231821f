#!/usr/bin/env python3
"""Read a result file with xarray, and print what the stick-slip comes to.

    python examples/read.py paper.h5

Needs xarray, and h5netcdf or netCDF4 to open the file with.
"""

import sys

import xarray as xr


def main(path):
    stick_slip = xr.open_dataset(path, group="stick_slip")
    events = xr.open_dataset(path, group="events")
    trajectory = xr.open_dataset(path, group="trajectory")

    for name in ("onset_time", "final_stick_time", "stick_count", "slip_count", "growth_exponent", "e_folds_gained"):
        print(f"{name:<20} {stick_slip.attrs[name]} {stick_slip.attrs.get(name + '_units', '')}")

    # Codes have their meanings with them.
    kinds = events.kind.attrs["flag_meanings"].split()
    stick = events.isel(event=events.kind == kinds.index("stick"))
    print("first sticks [s]    ", stick.time.values[:3])
    print("first durations [us]", (stick_slip.stick_duration.values[:3] * 1e6).round(3))

    # Quantities are columns over time, with their units.
    force = trajectory.normal_force
    print(f"contact force at {force.time.values[-1]} s: {force.values[-1]:.3f} {force.attrs['units']}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
