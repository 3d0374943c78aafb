"""Reads each job's events once per process and fans them out to its listeners.

Lives on the server's event loop. While a job has a listener its events are read once, at once after a commit of this
process, and soon after a commit of another one (`WATCH_S`, `OWN_WATCH_S`), and handed to each listener's own bounded
queue. A slow listener is dropped, without effect on the others. A listener gets events in order, without gaps or
duplicates: sequences count from 1 within a job, history comes from memory or the database, and the queue continues it.
"""

import asyncio
import logging
from collections import deque
from collections.abc import AsyncIterator
from contextlib import suppress

from bench_service.bench.live.values import PUBLISH_S, BenchLive, LiveBoard
from bench_service.jobs.events.listener import Frames, Listener
from bench_service.jobs.stores import JobStore
from bench_service.model.errors import ServiceError
from bench_service.model.job import FINAL, Event, Job, JobState
from bench_service.wall_clock import monotonic_s

WATCH_S = 0.1
"""Interval between two looks at a watched job for events of other processes [s]."""
OWN_WATCH_S = 0.5
"""Interval for a job of the bench that this process drives: nearly all its events are made here [s]."""
AGAIN_S = 1.0
"""Time to wait after a failure of the database [s]."""
HEARTBEAT_S = 15.0
"""Maximum time between two messages: comments keep the connection open through proxies [s]."""
LAG = 256
"""Maximum number of events that a listener may be behind before it is dropped."""
RECENT = 256
"""Number of last events kept per watched job: many listeners that join at once do not each read the database."""
PAGE = 1000
LIVE_PER_S = 100.0
"""Live states sent per second, over all listeners of a job: the more listeners, the less often each gets one,
except for live states that are sent along with an event.
"""
OVER = FINAL | {JobState.INTERRUPTED}

log = logging.getLogger(__name__)


class _Watch:
    """A job that has listeners."""

    def __init__(self, job: Job, sequence: int, state: JobState, recent: deque[tuple[int, bytes]]) -> None:
        self.job_id, self.bench = job.id, job.bench
        self.sequence = sequence
        self.state = state
        self.recent = recent
        self.listeners: set[Listener] = set()
        self.woken = asyncio.Event()
        self.loop = asyncio.get_running_loop()
        self.closed = False
        self.live_told: BenchLive | None = None
        self.live_at_s = 0.0
        self.beat_at_s = monotonic_s()


class EventHub:
    """Fan-out of jobs' events to the listeners of this process (event streams, pages): the events of each job are read
    once.
    """

    def __init__(self, jobs: JobStore, board: LiveBoard, frames: Frames, lag: int = LAG, recent: int = RECENT) -> None:
        self.dropped = 0
        """Number of listeners dropped so far."""
        self._jobs = jobs
        self._board = board
        self._frames = frames
        self._lag = lag
        self._recent = recent
        self._watches: dict[str, _Watch] = {}
        self._opening: dict[str, asyncio.Task[_Watch]] = {}
        self._running: set[asyncio.Task[None]] = set()
        jobs.on_event(self.wake)

    @property
    def listeners(self) -> int:
        """Number of listeners now."""
        return sum(len(watch.listeners) for watch in tuple(self._watches.values()))

    def wake(self, job_id: str) -> None:
        """Have a job's events read now, because one was committed; from any thread, never waits."""
        watch = self._watches.get(job_id)
        if watch is not None and not watch.loop.is_closed():
            watch.loop.call_soon_threadsafe(watch.woken.set)

    async def require(self, job_id: str) -> None:
        """Check that a job exists. Raises `NotFound` for one that does not, `StorageFailure`."""
        await self._watch(job_id)

    async def follow(self, job_id: str, after: int) -> AsyncIterator[bytes]:
        """Yield all events after a sequence number until the job has ended, or the listener is dropped.

        It also ends where the database does not answer: a client that reconnects with its last id misses nothing.
        """
        try:
            watch = await self._watch(job_id)
        except ServiceError as error:
            log.warning("the events of job %s cannot be followed now: %s", job_id, error)
            return
        listener = Listener(after, watch.sequence, self._lag)
        watch.listeners.add(listener)
        if watch.closed:
            listener.end()
        try:
            async for frame in self._history(watch, listener):
                yield frame
            while piece := await listener.next():
                yield piece
            if listener.dropped:
                yield self._frames.dropped
        except ServiceError as error:
            log.warning("a listener to job %s is disconnected, past events cannot be read now: %s", job_id, error)
        finally:
            watch.listeners.discard(listener)

    async def _watch(self, job_id: str) -> _Watch:
        """The watch of a job; it waits `WATCH_S` for its first listener. Concurrent listeners share one look at the
        database. Raises as `require`.
        """
        watch = self._watches.get(job_id)
        while watch is None or (watch.closed and watch.state not in OVER):
            if job_id not in self._opening:
                self._opening[job_id] = asyncio.create_task(self._open(job_id), name=f"open the watch of {job_id}")
            watch = await asyncio.shield(self._opening[job_id])  # one that leaves does not cancel it for the others
        return watch

    async def _open(self, job_id: str) -> _Watch:
        try:
            job, (sequence, state), page = await asyncio.to_thread(self._found, job_id)
        finally:
            del self._opening[job_id]
        recent = ((event.sequence, self._frames.event(event)) for event in page if event.sequence <= sequence)
        watch = self._watches[job_id] = _Watch(job, sequence, state, deque(recent, self._recent))
        running = asyncio.create_task(self._run(watch), name=f"events of {job_id}")
        self._running.add(running)
        running.add_done_callback(self._running.discard)
        return watch

    def _found(self, job_id: str) -> tuple[Job, tuple[int, JobState], tuple[Event, ...]]:
        job, last = self._jobs.get(job_id), self._jobs.last_event(job_id)
        return job, last, self._jobs.events(job_id, max(0, last[0] - self._recent), self._recent)

    async def _history(self, watch: _Watch, listener: Listener) -> AsyncIterator[bytes]:
        """The events before the listener joined: from memory, or from the database."""
        kept = tuple(watch.recent)
        if kept and kept[0][0] <= listener.after + 1:
            for sequence, frame in kept:
                if listener.after < sequence <= listener.joined_at:
                    listener.after = sequence
                    yield frame
        while listener.after < listener.joined_at and not listener.dropped:
            page = await asyncio.to_thread(self._jobs.events, watch.job_id, listener.after, PAGE)
            for event in page:
                if event.sequence <= listener.joined_at:
                    listener.after = event.sequence
                    yield self._frames.event(event)

    async def _run(self, watch: _Watch) -> None:
        """Read and fan out events while the job has listeners and has not ended."""
        look_s = OWN_WATCH_S if watch.bench == self._board.own else WATCH_S
        wait_s = look_s
        try:
            while watch.state not in OVER:
                await _comes(watch.woken, wait_s)
                if not watch.listeners:
                    return
                watch.woken.clear()
                self._beat(watch)
                try:
                    alone_s = len(watch.listeners) / LIVE_PER_S
                    await self._tell_live(watch, 0.0 if await self._read(watch) else alone_s)
                    wait_s = look_s
                except ServiceError as error:
                    log.warning("events of job %s cannot be read now: %s", watch.job_id, error)
                    wait_s = AGAIN_S
        finally:
            watch.closed = True
            if self._watches.get(watch.job_id) is watch:
                del self._watches[watch.job_id]
            for listener in tuple(watch.listeners):
                listener.end()

    async def _read(self, watch: _Watch) -> bool:
        """Fan out new events; True where there were any. Afterwards `state` is that of the newest event."""
        before = watch.sequence
        newest, state = await asyncio.to_thread(self._jobs.last_event, watch.job_id)
        while watch.sequence < newest:
            page = await asyncio.to_thread(self._jobs.events, watch.job_id, watch.sequence, PAGE)
            for event in page:
                self._hand_out(watch, event)
            newest = max(newest, watch.sequence)
        watch.state = state
        return watch.sequence > before

    def _hand_out(self, watch: _Watch, event: Event) -> None:
        frame = self._frames.event(event)
        watch.sequence = event.sequence
        watch.recent.append((event.sequence, frame))
        for listener in tuple(watch.listeners):
            if not listener.put(event.sequence, frame):
                watch.listeners.discard(listener)
                self.dropped += 1
                log.info("a listener to job %s was %d events behind and is dropped", watch.job_id, self._lag)

    async def _tell_live(self, watch: _Watch, rest_s: float) -> None:
        """Fan out the bench's live state while it works on this job; `rest_s` at least after the last time."""
        at_s = monotonic_s()
        if watch.state in OVER or at_s - watch.live_at_s < max(PUBLISH_S, rest_s):
            return
        own = watch.bench == self._board.own
        live = self._board.own_live() if own else await asyncio.to_thread(self._board.of_bench, watch.bench)
        watch.live_at_s = at_s
        if live is None or live.job is None or live.job.id != watch.job_id or live == watch.live_told:
            return
        watch.live_told = live
        frame = self._frames.live(live)
        for listener in watch.listeners:
            listener.put_word(frame)

    def _beat(self, watch: _Watch) -> None:
        """Send each listener a heartbeat at least every `HEARTBEAT_S`."""
        at_s = monotonic_s()
        if at_s - watch.beat_at_s < HEARTBEAT_S / 2:
            return
        watch.beat_at_s = at_s
        for listener in watch.listeners:
            listener.beat(self._frames.quiet)


async def _comes(event: asyncio.Event, seconds: float) -> None:
    """Wait for the event, but no longer than `seconds`."""
    with suppress(TimeoutError):
        async with asyncio.timeout(seconds):
            await event.wait()
