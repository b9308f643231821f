#!/usr/bin/env python3
"""A virtual file over shards reads as the file that was copied from them, in the programs of others.

    .ci/virtual.py COPIED VIRTUAL
"""

import sys

import h5py
import netCDF4
import numpy as np
import xarray as xr


def rows(events):
    """The events in one order: a virtual file has them shard by shard."""
    names = ["point", "time", "kind", "mode_after", "relative_velocity", "internal_force"]
    return sorted(zip(*(np.asarray(events[name]).tolist() for name in names)))


def main(copied, virtual):
    with h5py.File(copied) as one, h5py.File(virtual) as parts:
        assert dict(one.attrs) == dict(parts.attrs)
        names = [name for name in one if isinstance(one[name], h5py.Dataset)]
        assert set(one) == set(parts)
        of_shards = 0
        for name in names:
            assert np.array_equal(one[name][...], parts[name][...], equal_nan=True), name
            of_shards += parts[name].is_virtual
            assert all(not source.file_name.startswith("/") for source in
                       (parts[name].virtual_sources() if parts[name].is_virtual else [])), name
        assert of_shards == len(names) - 3, "all variables but the three axes"
        assert (one["failures/message"][...] == parts["failures/message"][...]).all()
        assert rows(one["events"]) == rows(parts["events"])
        shape = one["status"].shape
    with netCDF4.Dataset(copied) as one, netCDF4.Dataset(virtual) as parts:
        one.set_auto_mask(False)
        parts.set_auto_mask(False)
        assert one["stick_count"].dimensions == parts["stick_count"].dimensions
        assert np.array_equal(one["onset_time"][:], parts["onset_time"][:], equal_nan=True)
    for engine in ("h5netcdf", "netcdf4"):
        with xr.open_dataset(copied, engine=engine) as one, xr.open_dataset(virtual, engine=engine) as parts:
            xr.testing.assert_identical(one.load(), parts.load())
    print(f"{len(names)} variables of {' x '.join(map(str, shape))} points: the same in h5py, netCDF4 and xarray")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
