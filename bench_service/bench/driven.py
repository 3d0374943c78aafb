"""A bench that a thread of its own drives: its event loop, its watchdog, and the way to safety from every state."""

import asyncio
import logging
import threading
from collections.abc import Callable, Coroutine
from concurrent.futures import CancelledError, Future
from typing import Any, TypeVar

from bench_service.background import NonBlockingQuery
from bench_service.bench.held_loop import HeldLoop
from bench_service.bench.observed import ObservedBench
from bench_service.bench.watchdog import TimeLimits, Watchdog
from bench_service.model.errors import StorageFailure
from bench_service.wall_clock import monotonic_s
from procedures.bench import Bench
from procedures.bench.errors import Disconnected, Stopped

T = TypeVar("T")
log = logging.getLogger(__name__)

TIME_LIMITS = TimeLimits()
"""Time limits for the answers of devices."""
UNWIND_S = 1.0
"""Time that a procedure may take to leave a cancelled verb [s, real time]."""
LEAVE_S = 3.0
"""Time that a procedure's own ending may take before the devices are made safe all the same [s, real time]."""
STOPPED = "stopped by an operator"
STOP_CHECK_S = 0.2
"""Interval at which a move, a settle or a recording checks for a requested stop [s, real time]."""
HANGS_S = 10.0
"""Time without an answer from the database to the stop query, after which the station is given up: until then
no stop would be seen, and nothing stored [s]. A refusal is an answer.
"""
ANSWER_S = 0.1
"""Time that one check waits for the answer to the stop query; a later answer is seen by a later check [s]."""


class ShuttingDown(BaseException):
    """Raised when the service is ending; the job resumes after the next start. Not an error of the job."""


class DrivenBench:
    """Runs work on a bench in a thread of its own, and leaves the bench safe.

    `stop_wanted` is called every `STOP_CHECK_S` of real time; True raises `Stopped` in the work under way.
    """

    def __init__(
        self,
        name: str,
        bench: Bench,
        stop_wanted: Callable[[], bool],
        stop_stands: Callable[[], bool] = lambda: False,
    ) -> None:
        """Set up and start the thread; `name`: names the job or lease in log lines.

        `stop_stands`: returns whether a stop stands on the bench's channel, without waiting: no work begins then.
        """
        self._stop_stands = stop_stands
        self._name = name
        simulated = bench.description.origin == "simulated"
        self._watchdog = Watchdog(bench.clock, simulated, TIME_LIMITS, bench.safe_s)
        self._bench = ObservedBench(bench, self._watchdog)
        self._stop_wanted = NonBlockingQuery("stop", stop_wanted)
        self._unanswered_s = 0.0
        self._unwinding: set[asyncio.Task[Any]] = set()
        self._before_safe: frozenset[asyncio.Task[Any]] | None = None
        """Tasks that were there when making safe began; None: it is not under way."""
        self._shutting_down = threading.Event()
        self._stopped = threading.Event()
        self._under_way: Future[Any] | None = None
        """The work that is under way."""
        self._beginning = threading.Lock()
        """Held while work begins and while a stop looks for it: none begins after a stop has looked."""
        self._safety = threading.Lock()
        """Held while the bench is made safe or the session ended, by the job's own thread or by a stopping one."""
        self._is_safe = False
        self._closed = False
        self._lost: str | None = None
        """The reason why the bench's thread does not come back, if it does not."""
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._drive, name=f"bench {bench.description.id}", daemon=True)
        self._thread.start()

    def _run(self, work: Coroutine[Any, Any, T]) -> T:
        """Run work in the bench's thread and wait for its end. Raises `Stopped`, `Disconnected`, `ShuttingDown`."""
        with self._beginning:
            if self._stopped.is_set() or self._stop_stands():
                work.close()
                raise Stopped(STOPPED)
            under_way = asyncio.run_coroutine_threadsafe(work, self._loop)
            self._under_way = under_way
        try:
            return self._wait(under_way)
        except CancelledError:  # by `stop`
            raise Stopped(STOPPED) from None
        finally:
            self._under_way = None

    async def _leave(self) -> None:
        """Leave the work, before the devices are made safe."""

    async def _end(self) -> None:
        """Called in the bench's thread before it ends."""

    def stop(self) -> None:
        """Leave the work under way, with `Stopped` for its waiting caller; nothing more is begun. From any thread.

        It waits only for the work to unwind, at most `UNWIND_S`: neither for a database nor for the job's own
        thread, which may hang in one.
        """
        with self._beginning:
            self._stopped.set()
            under_way = self._under_way
        if under_way is not None:
            self._cancel(under_way, "a stop came while a device or the database did not answer")

    def shut_down(self) -> None:
        """Make the waiting call leave with `ShuttingDown`; called from another thread."""
        self._shutting_down.set()

    def make_safe(self) -> None:
        """Leave the work, then stop the table and switch the unit off. Raises an `ExceptionGroup` of failures,
        and `Disconnected` where a device does not answer. Once it is safe a second call does nothing.
        """
        with self._safety:
            if self._is_safe:
                return
            if self._lost is not None or self._closed:
                raise Disconnected(self._lost or "the session ended before its devices were safe")
            try:
                self._wait(asyncio.run_coroutine_threadsafe(self._make_safe(), self._loop), stoppable=False)
            except ExceptionGroup:
                self._leave_late_drivers()
                raise
            self._is_safe = True

    def _leave_late_drivers(self) -> None:
        """Count the bench's thread as lost where a driver that was late does not return: a new link avoids it."""
        if self._lost is None and not self._unwinds():
            self._lose("a device was not safe in time")

    def close(self) -> None:
        """End the thread, and give the devices' links back: later requests to them are refused.

        A thread that does not come back is left alone; it holds no resource that is needed. A second call does nothing.
        """
        with self._safety:
            if not self._closed:
                self._closed = True
                self._close()

    def _close(self) -> None:
        if self._lost is None:
            asyncio.run_coroutine_threadsafe(self._end(), self._loop).result()
        self._bench.close()
        self._loop.call_soon_threadsafe(self._loop.stop)
        if self._lost is None:
            self._thread.join()

    def _drive(self) -> None:
        """Run the bench's thread to its end, also when it was given up as lost and came back after all."""
        self._loop.run_forever()
        left = asyncio.all_tasks(self._loop)
        for task in left:
            task.cancel()
        if left:
            self._loop.run_until_complete(asyncio.wait(left))
        self._loop.run_until_complete(self._loop.shutdown_asyncgens())
        self._loop.close()

    def _wait(self, future: "Future[T]", stoppable: bool = True) -> T:
        looked_s = monotonic_s()
        held = None if stoppable or not self._bench.safe_s else HeldLoop(self._loop)
        while True:
            try:
                return future.result(timeout=STOP_CHECK_S)
            except TimeoutError:
                if future.done():  # it ended this moment, or its own error is a TimeoutError
                    return future.result()
            now_s = monotonic_s()
            passed_s = now_s - looked_s
            silence = self._watchdog.silence(passed_s, 2 * STOP_CHECK_S)
            if held is not None and held.for_s(min(passed_s, 2 * STOP_CHECK_S)) > TIME_LIMITS.verb_s:
                silence = f"a driver has held the thread of all devices for {TIME_LIMITS.verb_s:g} s"
            looked_s = now_s
            if silence is not None:
                self._cancel(future, silence)
                raise Disconnected(silence)
            if stoppable and self._stopped.is_set():
                self._cancel(future, "a stop came while a device or the database did not answer")
                raise Stopped(STOPPED)
            if stoppable and self._shutting_down.is_set():
                self._cancel(future, "the service ended while a device did not answer")
                raise ShuttingDown
            if stoppable:
                self._look_for_stop(future, min(passed_s, 2 * STOP_CHECK_S))

    def _look_for_stop(self, future: "Future[Any]", passed_s: float) -> None:
        """Check for a requested stop. Raises `Stopped`, and `StorageFailure` where the query stays unanswered."""
        wanted = self._stop_wanted.ask(ANSWER_S)
        if wanted:
            self._cancel(future, "a stop came while a device did not answer")
            raise Stopped(STOPPED)
        self._unanswered_s = 0.0 if wanted is not None else self._unanswered_s + passed_s
        if self._unanswered_s > HANGS_S:
            why = f"the database has not answered for {HANGS_S:g} s"
            self._cancel(future, why)
            raise StorageFailure(why)

    def _cancel(self, future: "Future[Any]", why: str) -> None:
        """Cancel a coroutine on the bench's loop and wait until it has unwound, or is lost."""
        future.cancel()
        if not self._unwinds():
            self._lose(why)

    def _lose(self, why: str) -> None:
        self._lost = why
        log.error("%s, bench %s: %s, and its driver does not return", self._name, self._bench.description.id, why)

    def _unwinds(self) -> bool:
        """Wait until the work has unwound, as it also has once another thread has ended the session; False: lost."""
        unwound = self._unwound()
        try:
            asyncio.run_coroutine_threadsafe(unwound, self._loop).result(UNWIND_S)
        except RuntimeError:  # the session's loop is closed
            unwound.close()
        except CancelledError:  # it has ended meanwhile
            return True
        except TimeoutError:  # it has stopped meanwhile, and takes nothing more; or the work does not return
            return self._closed
        return True

    async def _unwound(self) -> None:
        """Wait for every task of the bench's loop but those that wait here, or that make safe.

        Two stops would wait for each other, and braking may take longer than work takes to unwind. Real devices brake
        in tasks of their own: once making safe has begun, tasks that were not there before belong to it.
        """
        own = asyncio.current_task(self._loop)
        assert own is not None
        self._unwinding.add(own)
        try:
            left = asyncio.all_tasks(self._loop) - self._unwinding
            await asyncio.gather(
                *(left if self._before_safe is None else left & self._before_safe), return_exceptions=True
            )
        finally:
            self._unwinding.discard(own)

    async def _make_safe(self) -> None:
        own = asyncio.current_task(self._loop)
        assert own is not None
        self._unwinding.add(own)
        self._before_safe = frozenset(asyncio.all_tasks(self._loop) - self._unwinding)
        try:
            await self._leave_in_time()
        finally:
            try:
                await self._bench.make_safe()
            finally:
                self._unwinding.discard(own)
                self._before_safe = None

    async def _leave_in_time(self) -> None:
        """Leave the work, for `LEAVE_S` at the most; a defect in a procedure's own ending says nothing of devices."""
        leaving = asyncio.ensure_future(self._leave())
        try:
            await asyncio.wait((leaving,), timeout=LEAVE_S)
            late = not leaving.done()
        finally:
            leaving.cancel()
        if late:
            log.error("%s: its procedure's step could not be left within %g s", self._name, LEAVE_S)
        elif not leaving.cancelled() and (failure := leaving.exception()) is not None:
            log.error("%s: its procedure's step could not be left in order", self._name, exc_info=failure)
