#!/usr/bin/env python3
"""Check that two result files of the same run hold the same bytes.

    python .ci/identical.py paper.h5 again.h5

Compares the groups, the attributes, and the variables' stored blocks as they are in the file, compressed. Only the
attributes of /meta (when, where, how long) and the root attribute `history` may differ. Exits with 1 if more does.
"""

import sys

import h5py
import numpy as np


def attributes(item):
    """Name, type and bytes of every attribute that has to agree."""
    if item.name == "/meta":
        return sorted(item.attrs)
    kept = [name for name in sorted(item.attrs) if (item.name, name) != ("/", "history")]
    # Which variables belong to a dimension is stored as addresses, which say nothing.
    kept = [name for name in kept if name not in ("DIMENSION_LIST", "REFERENCE_LIST")]
    return [(name, str(item.attrs.get_id(name).dtype), np.asarray(item.attrs[name]).tobytes()) for name in kept]


def blocks(data):
    """The stored bytes of a variable."""
    if data.chunks is None:
        return [np.asarray(data[()]).tobytes()]
    count = data.id.get_num_chunks()
    offsets = sorted(data.id.get_chunk_info(k).chunk_offset for k in range(count))
    return [(offset, data.id.read_direct_chunk(offset)) for offset in offsets]


def contents(path):
    """Every object by its name."""
    found = {}

    def visit(item):
        found[item.name] = [attributes(item)]
        if isinstance(item, h5py.Dataset):
            found[item.name] += [str(item.dtype), item.shape, blocks(item)]

    with h5py.File(path) as file:
        visit(file["/"])
        file.visititems(lambda _, item: visit(item))
    return found


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    first, second = (contents(path) for path in sys.argv[1:])
    different = [name for name in sorted({*first, *second}) if first.get(name) != second.get(name)]
    for name in different:
        print(f"DIFFERENT: {name}")
    print(f"{len(first)} objects, {len(different)} differ")
    sys.exit(1 if different or not first else 0)


if __name__ == "__main__":
    main()
