#!/usr/bin/env python3
"""Check that docs/reference/columns.md names every variable and attribute of a result file, with its unit.

    python .ci/documented.py paper.h5

Exits with 1 if one is missing.
"""

import pathlib
import re
import sys

import h5py


def main(path):
    folder = pathlib.Path(__file__).parent.parent / "docs" / "reference"
    text = (folder / "columns.md").read_text() + (folder / "quantities.md").read_text()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line[:1] == "|"]
    units = {}
    for names, unit, *_ in rows:
        for name in re.findall(r"`([A-Za-z0-9_/]+)`", names):
            units.setdefault(name, set()).add(unit)
    words = set(re.findall(r"`([A-Za-z0-9_/]+)`", text))
    missing = []
    with h5py.File(path) as file:
        for group in ("trajectory", "events", "segments", "stick_slip"):
            for name, data in file[group].items():
                if name.endswith(("_before", "_after")) and name != "mode_after":
                    continue
                if data.attrs["units"] not in units.get(name, units.get(f"/{group}/{name}", ())):
                    missing.append(f"/{group}/{name} [{data.attrs['units']}]")
        headline = file["stick_slip"].attrs
        for name in headline:
            if name.endswith(("_units", "_long_name")):
                continue
            # A count is a whole number without a unit, or NaN.
            whole = headline[name + "_units"] == "1" and (headline[name] % 1 == 0 or headline[name] != headline[name])
            if not {headline[name + "_units"], *(["count"] if whole else [])} & units.get(name, set()):
                missing.append(f"/stick_slip attribute {name} [{headline[name + '_units']}]")
        for group in ("certificate", "sensitivity"):
            if group not in file:
                continue
            for name, data in file[group].items():
                # A channel's bands are documented as NAME; its unit is the channel's.
                name = "band_NAME" if name.startswith("band_") else "rate_NAME" if name.startswith("rate_") else name
                unit = {"band_NAME": "as NAME", "rate_NAME": "as NAME, per s"}.get(name, data.attrs["units"])
                scale = name in ("event", "rung", "stretch", "parameter")
                if name not in words if scale or group == "sensitivity" else unit not in units.get(name, ()):
                    missing.append(f"/{group}/{name} [{unit}]")
            missing += [f"{name} of /{group}" for name in file[group].attrs if name not in words]
        missing += [f"/input/{name}" for name in file["input"] if f"/input/{name}" not in words]
        missing += [f"{name} of {group}" for group in ("/", "/input", "/meta") for name in file[group].attrs if name not in words]
    for name in missing:
        print(f"NOT DOCUMENTED: {name}")
    print(f"docs/reference/columns.md: {len(missing)} missing")
    sys.exit(1 if missing else 0)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
