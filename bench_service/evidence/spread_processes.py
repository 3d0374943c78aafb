"""Two processes that share the analysis of a long recording: both processors work, and the service's memory stays
small.

The second is forked from the first when that has imported what both need; see `two_processes`. They begin when a job
that will need them begins, so that nobody waits for their imports, and they end when they have had nothing to do for a
while. Where one of them dies, its parts are worked out in the other, or in the caller's thread.
"""

import logging
import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, ExitStack
from threading import Lock, Timer
from typing import TypeVar

from bench_service.evidence.two_processes import begin_both, both_numbers, shared_parts
from bench_service.evidence.work_processes import Refusal
from procedures.bench.imu import Imu
from procedures.core.recording import Recording, Station
from procedures.core.spread import Spread, spread_over

A = TypeVar("A")
R = TypeVar("R")

log = logging.getLogger(__name__)

AT_ONCE = 2
"""Number of processes, and so of parts at one time."""
MANY_VALUES = 5_000_000
"""Number of samples of all channels from which an analysis takes longer than handing its parts over."""
IDLE_S = 10.0
"""Time without work after which the processes end [s, real time]."""


class SpreadProcesses:
    """Processes of one service that compute parts of analyses at the same time. Implements
    `procedures.core.spread.Spread`. For any thread.
    """

    width = AT_ONCE

    def __init__(self, idle_s: float = IDLE_S) -> None:
        self._idle_s = idle_s
        self._mutex = Lock()
        self._pool: ProcessPoolExecutor | None = None
        self._numbers: Future[list[int]] | None = None
        self._users = 0
        self._timer: Timer | None = None
        self._expected = False
        self._closed = False

    def over(self, values: int) -> Spread | None:
        """Return these processes for an analysis of that many values, None for one too small to be shared."""
        return self if values >= MANY_VALUES and not self._closed else None

    def used_for(self, recordings: Sequence[Recording]) -> AbstractContextManager[None]:
        """Run the block so that the analysis of these recordings is shared among the processes, where its size is worth
        it.
        """
        return spread_over(self.over(sum(r.info.count * len(r.info.channels) for r in recordings)))

    def begin_for(self, stations: Sequence[Station], imu: Imu) -> None:
        """Begin the processes where the recordings of these stations will need them; they wait until `done`."""
        seconds = sum(station.record_s for station in stations)
        rate_hz = next((s.sample_rate_hz for s in stations if s.sample_rate_hz is not None), imu.rate_hz)
        self.begin(round(seconds * rate_hz) * len(imu.channels))

    def begin(self, values: int) -> None:
        """Begin the processes for an analysis of so many values; it does not wait for them, they wait until `done`."""
        if self.over(values) is not None and not self._expected:
            self._expected = True
            self._taken()

    def done(self) -> None:
        """Let the processes end when they are idle: the analysis that was expected is done, or will not come."""
        if self._expected:
            self._expected = False
            self._given_back()

    def each(self, work: Callable[[A], R], items: Sequence[A]) -> list[R]:
        """Compute the parts in these processes, wait, and return their results in order; see `Spread.each`. Raises the
        first error of a part.
        """
        pool = self._taken()
        try:
            if pool is None:
                return [work(item) for item in items]
            found = pool.submit(shared_parts, work, items).result()
        except BrokenProcessPool:
            log.warning("a process that analysed a recording ended before it was done: the service does it itself")
            self._forget(pool)
            return [work(item) for item in items]
        finally:
            self._given_back()
        results: list[R] = []
        for part in found:
            if isinstance(part, Refusal):
                raise part.error()
            results.append(part)
        return results

    def processes(self) -> list[int]:
        """Return the process ids of the processes that run now, once they have begun."""
        with self._mutex:
            numbers = self._numbers
        try:
            return [] if numbers is None else numbers.result()
        except (BrokenProcessPool, CancelledError):
            return []

    def close(self) -> None:
        """End the processes for good; parts that are under way are cut off."""
        self._closed = True
        self._end()

    def _taken(self) -> ProcessPoolExecutor | None:
        with self._mutex:
            self._users += 1
            if self._timer is not None:
                self._timer.cancel()
                self._timer = None
            if self._pool is None and not self._closed:
                context = multiprocessing.get_context("spawn")
                self._pool = ProcessPoolExecutor(1, context, begin_both)
                self._numbers = self._pool.submit(both_numbers)
            return self._pool

    def _given_back(self) -> None:
        with self._mutex:
            self._users -= 1
            if self._users == 0 and self._pool is not None:
                self._timer = Timer(self._idle_s, self._end_if_idle)
                self._timer.daemon = True
                self._timer.start()

    def _forget(self, pool: ProcessPoolExecutor | None) -> None:
        with self._mutex:
            if self._pool is pool:
                self._pool = self._numbers = None

    def _end_if_idle(self) -> None:
        with self._mutex:
            idle = self._users == 0
        if idle:
            self._end()

    def _end(self) -> None:
        with self._mutex:
            pool, self._pool, self._numbers = self._pool, None, None
            if self._timer is not None:
                self._timer.cancel()
        if pool is not None:
            for process in list(getattr(pool, "_processes", {}).values()):
                process.terminate()
            pool.shutdown(wait=True, cancel_futures=True)


def spread_processes(closing: ExitStack) -> SpreadProcesses:
    """Return processes for analyses, which `closing` ends; none is started yet."""
    processes = SpreadProcesses()
    closing.callback(processes.close)
    return processes
