"""Opens any file of the program."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from . import _native
from ._branches import is_continuation, read_continuation
from ._case import PathLike
from ._errors import FileError
from ._run import Run, identity
from ._sweep import is_sweep, read_sweep

if TYPE_CHECKING:
    import xarray


def open(path: PathLike) -> Run | xarray.Dataset:  # noqa: A001
    """Opens a file of the program: a result, certified or not, as a :class:`Run`; a sweep or a continuation as a dataset.

    Columns are read at their first use.

    :raises FileError: a file that is missing, damaged, or of another program.
    """
    name = os.path.abspath(os.fspath(path))
    found = identity(name)
    try:
        if is_sweep(name):
            return read_sweep(name)
        if is_continuation(name):
            return read_continuation(name)
        opened = Run(_native.open_result(name))
    except FileError as error:
        # By the name that was given.
        raise FileError(str(error).replace(name, os.fspath(path))) from None
    opened._identity = found
    return opened


def open_run(path: PathLike, owner: object = None) -> Run:
    """Opens a result. The file is there as long as its ``owner``, which the run holds."""
    opened = open(path)
    assert isinstance(opened, Run)
    opened._owner = owner
    return opened
