"""A process that works out parts of an analysis together with a second one, which it forks from itself.

Imports take a process longer than its part of an analysis of some hours. The fork is safe here: the first process has
imported modules and done nothing else. It has no other thread of Python; those of OpenBLAS and of Arrow's allocator are
idle, and both libraries see to a fork themselves. The second process ends with the first.
"""

import ctypes
import multiprocessing
import os
from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from importlib import import_module
from typing import TypeVar

from bench_service.collector import no_collection
from bench_service.evidence.work_processes import Refusal, begin_process
from bench_service.model.errors import ServiceError
from procedures.core.errors import DomainError

A = TypeVar("A")
R = TypeVar("R")

MODULES = (
    "procedures.launches",
    "procedures.analysis.thermal.cycle.series",
    "scipy.fft",
    "bench_service.persistence.evidence.recording_store",
    "pyarrow.parquet",
)
"""Modules that the first process imports before the fork: it has the time while a job records."""

FREED_BYTES = 32 << 20
"""Blocks up to this size, the greatest that glibc allows, come from the heap, and so much of it stays when freed."""
_MMAP_THRESHOLD, _TRIM_THRESHOLD = -3, -1
"""Numbers of the two parameters in glibc's `malloc.h`."""

_second: list[ProcessPoolExecutor] = []


def begin_both() -> None:
    """Set up the first process, and fork the second."""
    from threadpoolctl import threadpool_limits

    _keep_freed_memory()
    with no_collection():  # frozen then: a collection would also unshare the pages of both
        for name in MODULES:
            import_module(name)
    threadpool_limits(1)
    second = ProcessPoolExecutor(1, multiprocessing.get_context("fork"), begin_process)
    second.submit(os.getpid)  # forks, before this process has a thread of its own
    _second.append(second)
    begin_process()


def _keep_freed_memory() -> None:
    """Have the allocator use freed blocks again instead of mapping new ones, in a process that lives for seconds.

    Otherwise a sixth of an analysis goes into fresh pages, 4 kB at a time; the peak is the same. Another C library than
    glibc is left alone.
    """
    with suppress(OSError, AttributeError):
        set_parameter = ctypes.CDLL(None).mallopt
        for number in (_MMAP_THRESHOLD, _TRIM_THRESHOLD):
            set_parameter(number, FREED_BYTES)


def both_numbers() -> list[int]:
    """Return the process ids of both."""
    try:
        return [os.getpid(), _second[0].submit(os.getpid).result()]
    except BrokenProcessPool:
        return [os.getpid()]


def shared_parts(work: Callable[[A], R], items: Sequence[A]) -> list[R | Refusal]:
    """Compute the parts in both processes, and return their results in order, a refused one as a `Refusal`.

    Each takes the next part when it has done its last. Where the second one dies, the first does them all. Raises an
    error of either that is no refusal.
    """
    left, found = deque(enumerate(items)), dict[int, R | Refusal]()

    def by_the_second() -> None:
        for at, item in _taken_from(left):
            try:
                found[at] = _second[0].submit(_part, work, item).result()
            except BrokenProcessPool:
                left.append((at, item))
                return

    def by_the_first() -> None:
        for at, item in _taken_from(left):
            found[at] = _part(work, item)

    with ThreadPoolExecutor(1, "parts of the second process") as thread:
        second = thread.submit(by_the_second)
        try:
            by_the_first()
            second.result()  # raises an error that is no refusal
            by_the_first()  # what one that died has left
        finally:
            left.clear()  # after such an error nobody wants the rest
    return [found[at] for at in range(len(items))]


def _taken_from(left: "deque[tuple[int, A]]") -> Generator[tuple[int, A]]:
    while True:
        try:
            yield left.popleft()
        except IndexError:
            return


def _part(work: Callable[[A], R], item: A) -> R | Refusal:
    try:
        return work(item)
    except (DomainError, ServiceError, ArithmeticError, ValueError) as refused:
        return Refusal.of(refused)
