"""One reader of a job's events for everybody of this process who listens to it.

Lives on the server's event loop. While a job has a listener its events are read once, at most `WATCH_S` after they were
committed anywhere and at once after a commit of this process, and handed to each listener's own bounded queue. Who does
not take what is his is dropped, and nobody else notices. What a listener has is in order, without gaps or doubles:
sequences count from 1 within a job, history comes from the database, and the queue goes on where history ends.
"""

import asyncio
import logging
from collections import deque
from collections.abc import AsyncIterator
from typing import Protocol

from bench_service.jobs.errors import ServiceError
from bench_service.jobs.job import FINAL, Event, Job, JobState
from bench_service.jobs.live import PUBLISH_S, BenchLive, LiveBoard
from bench_service.jobs.store import JobStore
from bench_service.wall_clock import monotonic_s

WATCH_S = 0.1
"""How often a watched job is looked at for events that other processes made [s]."""
AGAIN_S = 1.0
"""How long to wait after the database failed [s]."""
HEARTBEAT_S = 15.0
"""A comment at least this often, so that proxies keep the connection [s]."""
LAG = 256
"""Events that a listener may be behind before it is dropped."""
RECENT = 256
"""Events of a watched job that are kept for who comes next: many who reconnect at once do not read the database."""
PAGE = 1000
LIVE_PER_S = 100.0
"""Live words sent in a second, over all listeners of a job: the more they are, the less often each one hears."""
OVER = FINAL | {JobState.INTERRUPTED}

log = logging.getLogger(__name__)


class Frames(Protocol):
    """How what listeners are told is written."""

    @property
    def quiet(self) -> bytes:
        """Nothing has happened for a while."""
        ...

    @property
    def dropped(self) -> bytes:
        """The listener was too slow; this is the last it hears."""
        ...

    def event(self, event: Event) -> bytes: ...

    def live(self, live: BenchLive) -> bytes: ...


class Listener:
    """One who listens: what waits for him, and whether it ends."""

    def __init__(self, watch: "_Watch", after: int, lag: int) -> None:
        self.watch = watch
        self.after = after
        self.joined_at = watch.sequence
        self.ended = False
        self.dropped = False
        self._lag = lag
        self._frames: deque[tuple[int, bytes]] = deque()
        self._live: bytes | None = None
        self._woken = asyncio.Event()

    def put(self, sequence: int, frame: bytes) -> bool:
        """Queue an event. False where too many wait already: the listener is dropped, and its queue let go."""
        if len(self._frames) >= self._lag:
            self.dropped = self.ended = True
            self._frames.clear()
        else:
            self._frames.append((sequence, frame))
        self._woken.set()
        return not self.dropped

    def put_live(self, frame: bytes) -> None:
        """Only the newest live word waits."""
        self._live = frame
        self._woken.set()

    def end(self) -> None:
        """Nothing more will come."""
        self.ended = True
        self._woken.set()

    async def next(self) -> bytes | None:
        """What is next; None: nothing for `HEARTBEAT_S`, or the end (see `ended`)."""
        while True:
            while self._frames:
                sequence, frame = self._frames.popleft()
                if sequence > self.after:
                    self.after = sequence
                    return frame
            if self.ended:
                return None
            if self._live is not None:
                frame, self._live = self._live, None
                return frame
            self._woken.clear()
            if not await _comes(self._woken, HEARTBEAT_S):
                return None


class _Watch:
    """A job that somebody listens to."""

    def __init__(self, job: Job, sequence: int, state: JobState) -> None:
        self.job_id, self.bench = job.id, job.bench
        self.sequence = sequence
        self.state = state
        self.recent: deque[tuple[int, bytes]] = deque(maxlen=RECENT)
        self.listeners: set[Listener] = set()
        self.woken = asyncio.Event()
        self.loop = asyncio.get_running_loop()
        self.task: asyncio.Task[None] | None = None
        self.live_told: BenchLive | None = None
        self.live_at_s = 0.0


class EventHub:
    """Everybody of this process who listens to a job."""

    def __init__(self, jobs: JobStore, board: LiveBoard, frames: Frames, lag: int = LAG) -> None:
        self.dropped = 0
        """How many listeners were dropped so far."""
        self._jobs = jobs
        self._board = board
        self._frames = frames
        self._lag = lag
        self._watches: dict[str, _Watch] = {}
        jobs.on_event(self.wake)

    @property
    def listeners(self) -> int:
        """How many listen now."""
        return sum(len(watch.listeners) for watch in tuple(self._watches.values()))

    def wake(self, job_id: str) -> None:
        """Look for new events of a job now; from any thread."""
        watch = self._watches.get(job_id)
        if watch is not None and not watch.loop.is_closed():
            watch.loop.call_soon_threadsafe(watch.woken.set)

    async def require(self, job_id: str) -> None:
        """Raises `NotFound` for a job that there is not, `StorageFailure`."""
        if job_id not in self._watches:
            await asyncio.to_thread(self._jobs.get, job_id)

    async def follow(self, job_id: str, after: int) -> AsyncIterator[bytes]:
        """Everything after an event's sequence until the job has ended, or the listener is dropped.

        It also ends where the database does not answer: who comes back with the last id he saw misses nothing.
        """
        try:
            listener = await self._join(job_id, after)
        except ServiceError as error:
            log.warning("nobody can listen to job %s now: %s", job_id, error)
            return
        try:
            async for frame in self._history(listener):
                yield frame
            while (frame := await listener.next()) is not None or not listener.ended:
                yield self._frames.quiet if frame is None else frame
            if listener.dropped:
                yield self._frames.dropped
        except ServiceError as error:
            log.warning("a listener to job %s is let go, the past cannot be read now: %s", job_id, error)
        finally:
            listener.watch.listeners.discard(listener)

    async def _join(self, job_id: str, after: int) -> Listener:
        watch = self._watches.get(job_id)
        if watch is None:
            job, (sequence, state) = await asyncio.to_thread(
                lambda: (self._jobs.get(job_id), self._jobs.last_event(job_id))
            )
            watch = self._watches.setdefault(job_id, _Watch(job, sequence, state))
        listener = Listener(watch, after, self._lag)
        watch.listeners.add(listener)
        if watch.task is None:
            watch.task = asyncio.create_task(self._run(watch), name=f"events of {job_id}")
        return listener

    async def _history(self, listener: Listener) -> AsyncIterator[bytes]:
        """What had happened when the listener came: from what is kept, or from the database."""
        kept = tuple(listener.watch.recent)
        if kept and kept[0][0] <= listener.after + 1:
            for sequence, frame in kept:
                if listener.after < sequence <= listener.joined_at:
                    listener.after = sequence
                    yield frame
        while listener.after < listener.joined_at and not listener.dropped:
            page = await asyncio.to_thread(self._jobs.events, listener.watch.job_id, listener.after, PAGE)
            for event in page:
                if event.sequence <= listener.joined_at:
                    listener.after = event.sequence
                    yield self._frames.event(event)

    async def _run(self, watch: _Watch) -> None:
        """Read and hand out while somebody listens and the job goes on."""
        try:
            while watch.listeners:
                watch.woken.clear()
                try:
                    await self._read(watch)
                    if watch.state in OVER:
                        return
                    await self._tell_live(watch)
                    wait_s = WATCH_S
                except ServiceError as error:
                    log.warning("events of job %s cannot be read now: %s", watch.job_id, error)
                    wait_s = AGAIN_S
                await _comes(watch.woken, wait_s)
        finally:
            if self._watches.get(watch.job_id) is watch:
                del self._watches[watch.job_id]
            for listener in tuple(watch.listeners):
                listener.end()

    async def _read(self, watch: _Watch) -> None:
        """Hand out what is new; afterwards `state` is that of the newest event."""
        newest, state = await asyncio.to_thread(self._jobs.last_event, watch.job_id)
        while watch.sequence < newest:
            page = await asyncio.to_thread(self._jobs.events, watch.job_id, watch.sequence, PAGE)
            for event in page:
                self._hand_out(watch, event)
            newest = max(newest, watch.sequence)
        watch.state = state

    def _hand_out(self, watch: _Watch, event: Event) -> None:
        frame = self._frames.event(event)
        watch.sequence = event.sequence
        watch.recent.append((event.sequence, frame))
        for listener in tuple(watch.listeners):
            if not listener.put(event.sequence, frame):
                watch.listeners.discard(listener)
                self.dropped += 1
                log.info("a listener to job %s was %d events behind and is dropped", watch.job_id, self._lag)

    async def _tell_live(self, watch: _Watch) -> None:
        """Hand out what the bench does now, where it works on this job."""
        at_s = monotonic_s()
        if at_s - watch.live_at_s < max(PUBLISH_S, len(watch.listeners) / LIVE_PER_S):
            return
        own = watch.bench == self._board.own
        live = self._board.said() if own else await asyncio.to_thread(self._board.of_bench, watch.bench)
        watch.live_at_s = at_s
        if live is None or live.job is None or live.job.id != watch.job_id or live == watch.live_told:
            return
        watch.live_told = live
        frame = self._frames.live(live)
        for listener in watch.listeners:
            listener.put_live(frame)


async def _comes(event: asyncio.Event, seconds: float) -> bool:
    """Whether it comes within so long."""
    try:
        async with asyncio.timeout(seconds):
            return await event.wait()
    except TimeoutError:
        return False
