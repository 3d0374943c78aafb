"""A bench while a job drives it: one thread with its own event loop, and the way to safety from every state."""

import asyncio
import logging
import threading
from collections.abc import AsyncIterator, Callable
from concurrent.futures import CancelledError, Future
from contextlib import aclosing
from typing import Any, TypeVar

from bench_service.background import NonBlockingQuery
from bench_service.bench.device_log import DeviceLog, made_by
from bench_service.bench.live.tap import LiveTap
from bench_service.bench.live.values import PUBLISH_S
from bench_service.bench.observed import ObservedBench
from bench_service.bench.streams import require_end, stream_of
from bench_service.bench.watchdog import TimeLimits, Watchdog
from bench_service.evidence.recordings import RecordingStore
from bench_service.model.errors import StorageFailure
from bench_service.model.job import Job
from bench_service.model.records import NewRecording
from bench_service.wall_clock import monotonic_s
from procedures.bench import Bench
from procedures.bench.errors import Disconnected, Stopped
from procedures.bench.imu import Stream
from procedures.core.recording import RecordingInfo, Station
from procedures.procedure import Outcome, Parameters, Procedure

T = TypeVar("T")
log = logging.getLogger(__name__)

TIME_LIMITS = TimeLimits()
"""Time limits for the answers of devices."""
UNWIND_S = 1.0
"""Time that a procedure may take to leave a cancelled verb [s, real time]."""
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


class BenchSession:
    """Drives one job's stations in order. `record` may begin at any of them: the procedure is opened there.

    `stop_wanted` is called every `STOP_CHECK_S` of real time; True raises `Stopped` in the procedure's step under way.
    """

    def __init__(
        self,
        job: Job,
        procedure: Procedure[Parameters, Outcome],
        bench: Bench,
        recordings: RecordingStore,
        stop_wanted: Callable[[], bool],
        tap: LiveTap | None = None,
    ) -> None:
        self.job = job
        self._procedure = procedure
        self._watchdog = Watchdog(bench.clock, bench.description.origin == "simulated", TIME_LIMITS)
        self._bench = ObservedBench(bench, self._watchdog)
        self._recordings = recordings
        self._stop_wanted = NonBlockingQuery("stop", stop_wanted)
        self._unanswered_s = 0.0
        self._unwinding: set[asyncio.Task[Any]] = set()
        self._streams: AsyncIterator[Stream] | None = None
        self._next = -1
        self._shutting_down = threading.Event()
        self._stopped = threading.Event()
        self._under_way: Future[Any] | None = None
        """The procedure's step that is under way."""
        self._safety = threading.Lock()
        """Held while the bench is made safe or the session ended, by the job's own thread or by a stopping one."""
        self._is_safe = False
        self._closed = False
        self._lost: str | None = None
        """The reason why the bench's thread does not come back, if it does not."""
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._drive, name=f"bench {bench.description.id}", daemon=True)
        self._thread.start()
        self._tap = tap
        self._telling: asyncio.TimerHandle | None = None
        self._told: asyncio.Task[None] | None = None

    def record(self, index: int) -> RecordingInfo:
        """Record one station and store it. Raises `BenchError`, `ProcedureDefect`, `StorageFull`,
        `StorageFailure`, `ShuttingDown`.

        A device that does not answer is `Disconnected`, whatever its driver's own error handling does.
        """
        if self._stopped.is_set():
            raise Stopped(STOPPED)
        self._under_way = asyncio.run_coroutine_threadsafe(self._record(index), self._loop)
        try:
            return self._wait(self._under_way)
        except CancelledError:  # by `stop`
            raise Stopped(STOPPED) from None
        finally:
            self._under_way = None

    def stop(self) -> None:
        """Leave the step under way, with `Stopped` for its waiting caller; nothing more is recorded. From any thread.

        It waits only for the procedure to unwind, at most `UNWIND_S`: neither for a database nor for the job's own
        thread, which may hang in one.
        """
        self._stopped.set()
        under_way = self._under_way
        if under_way is not None:
            self._cancel(under_way, "a stop came while a device or the database did not answer")

    def shut_down(self) -> None:
        """Make the waiting `record` call leave with `ShuttingDown`; called from another thread."""
        self._shutting_down.set()

    def make_safe(self) -> None:
        """Close the procedure, then stop the table and switch the unit off. Raises an `ExceptionGroup` of failures,
        and `Disconnected` where a device does not answer. Once it is safe a second call does nothing.
        """
        with self._safety:
            if self._is_safe or self._closed:
                return
            if self._lost is not None:
                raise Disconnected(self._lost)
            self._wait(asyncio.run_coroutine_threadsafe(self._make_safe(), self._loop), stoppable=False)
            self._is_safe = True

    def close(self) -> None:
        """End the thread, and give the devices' links back: later requests to them are refused.

        A thread that does not come back is left alone; it holds no resource that is needed. A second call does nothing.
        """
        with self._safety:
            if not self._closed:
                self._closed = True
                self._close()

    def _close(self) -> None:
        if self._tap is not None and self._lost is None:
            asyncio.run_coroutine_threadsafe(self._stop_telling(self._tap), self._loop).result()
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
        while True:
            try:
                return future.result(timeout=STOP_CHECK_S)
            except TimeoutError:
                if future.done():  # it ended this moment, or its own error is a TimeoutError
                    return future.result()
            now_s = monotonic_s()
            passed_s = now_s - looked_s
            silence = self._watchdog.silence(passed_s, 2 * STOP_CHECK_S)
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
        try:
            asyncio.run_coroutine_threadsafe(self._unwound(), self._loop).result(UNWIND_S)
        except TimeoutError:
            self._lost = why
            log.error("job %s, bench %s: %s, and its driver does not come back", self.job.id, self.job.bench, why)

    async def _unwound(self) -> None:
        """Wait for every task of the bench's loop but those that wait here: two stops would wait for each other."""
        own = asyncio.current_task(self._loop)
        assert own is not None
        self._unwinding.add(own)
        try:
            await asyncio.gather(*(asyncio.all_tasks(self._loop) - self._unwinding), return_exceptions=True)
        finally:
            self._unwinding.discard(own)

    async def _record(self, index: int) -> RecordingInfo:
        station = self.job.stations[index]
        if self._tap is not None:
            self._tap.station(index)
            if self._telling is None:
                self._tell(self._tap)
        if self._streams is None or self._next != index:
            await self._close_streams()
            self._streams = self._procedure.acquire(self._bench, self.job.stations[index:])
        stream = await stream_of(self._streams, self._procedure.name, station)
        info = await self._store(stream, station)
        self._next = index + 1
        if self._next == len(self.job.stations):
            await require_end(self._streams, self._procedure.name, self.job.stations)
        return info

    async def _store(self, stream: Stream, station: Station) -> RecordingInfo:
        writer = self._recordings.open(
            NewRecording(
                unit=self.job.unit,
                channels=stream.channels,
                rate_hz=stream.rate_hz,
                start_s=stream.start_s,
                simulated=self.job.simulated,
                job_id=self.job.id,
                bench=self.job.bench,
                station=station,
                launched_s=stream.launched_s,
                source=made_by(self._bench.description),
            )
        )
        tap, begins_s = self._tap, stream.start_s
        devices = DeviceLog(self._bench, station)
        if tap is not None:
            tap.stream(stream)
        try:
            async for block in stream.blocks:
                writer.write(block)
                await devices.look()
                if tap is not None:
                    tap.block(begins_s, block)
                    begins_s += len(block) / stream.rate_hz
                await asyncio.sleep(0)  # noqa: TID251  lets a cancel land; no time passes
            return writer.seal(self._bench.checkpoint(), devices.measured())
        except BaseException:
            writer.abandon()
            raise

    async def _close_streams(self) -> None:
        if self._streams is not None and hasattr(self._streams, "aclose"):
            async with aclosing(self._streams):  # pyright: ignore[reportArgumentType]  an async generator
                pass
        self._streams = None

    def _tell(self, tap: LiveTap) -> None:
        """Publish the live state, now and every `PUBLISH_S`: between two steps of the procedure, in their thread."""
        if self._told is None or self._told.done():
            self._told = self._loop.create_task(tap.publish())
        self._telling = self._loop.call_later(PUBLISH_S, self._tell, tap)

    async def _stop_telling(self, tap: LiveTap) -> None:
        if self._telling is not None:
            self._telling.cancel()
        if self._told is not None:
            self._told.cancel()
            await asyncio.wait([self._told])
        tap.end()

    async def _make_safe(self) -> None:
        try:
            await self._close_streams()
        finally:
            await self._bench.make_safe()
