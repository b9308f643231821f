#!/usr/bin/env python3
"""Hold the event times of a result file against those of an independent multiprecision code.

    python examples/errors.py paper.h5 data/truth/paper.json

Needs h5py. data/truth/README.md says which case belongs to which file.
"""

import json
import sys

import h5py


def main(result, truth):
    with open(truth) as file:
        expected = [(event["kind"], float(event["time"])) for event in json.load(file)["events"]]
    with h5py.File(result) as file:
        events = file["events"]
        names = events["kind"].attrs["flag_meanings"].split()
        found = [(names[kind], time) for kind, time in zip(events["kind"], events["time"])]
    # The other kinds are information, and not in the truth.
    word = ("stick", "slip", "reversal", "separation", "contact")
    found = [event for event in found if event[0] in word]
    if [kind for kind, _ in found] != [kind for kind, _ in expected]:
        sys.exit(f"another sequence of events: {len(found)}, where there should be {len(expected)}")
    error = max(abs(time - true) for (_, time), (_, true) in zip(found, expected))
    print(f"{len(found)} events, the largest error of a time is {error:.2e} s")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
