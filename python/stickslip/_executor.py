"""Points of a sweep in other processes, by any executor."""

from __future__ import annotations

import queue
from typing import Any, Protocol

from . import _native
from ._errors import InputError


class Future(Protocol):
    """What :class:`concurrent.futures.Future` has, as far as it is used here."""

    def add_done_callback(self, function: Any, /) -> object: ...
    def cancel(self) -> object: ...
    def result(self) -> Any: ...


class Executor(Protocol):
    """What :class:`concurrent.futures.Executor` has, as far as it is used here."""

    def submit(self, function: Any, /, *arguments: Any) -> Any: ...


def evaluate(study: str, points: str) -> bytes:
    """Runs some points of a study: in a worker, which imports this module and needs no files."""
    return _native.evaluate(study, points)


class Tasks:
    """The tasks of a sweep: submitted and waited for by the thread that sweeps."""

    def __init__(self, executor: Executor) -> None:
        if isinstance(executor, type) or not callable(getattr(executor, "submit", None)):
            what = f"{executor.__name__} is a class" if isinstance(executor, type) else f"{executor!r:.80} has no submit"
            raise InputError(
                f"executor: {what}; give an executor of concurrent.futures, such as "
                "ProcessPoolExecutor(), mpi4py.futures.MPIPoolExecutor() or client.get_executor() of dask.distributed"
            )
        self._executor = executor
        #: What the executor raised.
        self.failure: BaseException | None = None
        self._under_way: set[Future] = set()
        self._done: queue.SimpleQueue[Future] = queue.SimpleQueue()

    def submit(self, study: str, points: str) -> None:
        try:
            future: Future = self._executor.submit(evaluate, study, points)
        except BaseException as error:
            self.failure = error
            raise
        self._under_way.add(future)
        future.add_done_callback(self._done.put)

    def finished(self, wait: float) -> bytes | None:
        """The result of the next task, or its exception; None if no task ends within ``wait`` (s)."""
        try:
            future = self._done.get(timeout=wait) if wait else self._done.get_nowait()
        except queue.Empty:
            return None
        self._under_way.discard(future)
        try:
            result: bytes = future.result()
        except BaseException as error:
            self.failure = error
            raise
        return result

    def cancel(self) -> None:
        """Drops the tasks that have not begun; those under way end by themselves."""
        for future in self._under_way:
            future.cancel()
