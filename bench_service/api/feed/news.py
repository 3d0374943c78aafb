"""State of all benches as frames of server-sent events, read once for all listeners of this process."""

import asyncio
from dataclasses import dataclass, field

from bench_service.api.benches.routes import view_of
from bench_service.api.feed.schemas import BenchNews, JobNews
from bench_service.api.jobs.event_stream import LIVE
from bench_service.api.jobs.schemas import EventView, JobView
from bench_service.bench.live.values import BenchLive
from bench_service.model.errors import NotFound, ServiceError
from bench_service.service import BenchService
from bench_service.wall_clock import monotonic_s

LOOK_S = 0.5
"""Interval between two looks at the database, shared by all listeners [s]."""
PAGE = 200
"""Maximum number of events in one frame."""


def frame(event: str, data: str | bytes) -> bytes:
    """Return a server-sent event with a name and its data, as bytes."""
    text = data.encode() if isinstance(data, str) else data
    return b"event: " + event.encode() + b"\ndata: " + text + b"\n\n"


@dataclass
class News:
    """The state of all benches at the last reading, and the trouble if the database did not answer."""

    benches: dict[str, bytes] = field(default_factory=dict[str, bytes])
    """Frame of each bench."""
    lives: dict[str, BenchLive] = field(default_factory=dict[str, BenchLive])
    trouble: str | None = None
    at_s: float = float("-inf")


class NewsReader:
    """Reads the state of all benches for the listeners of this process, at most every `LOOK_S`, whatever their
    number.
    """

    def __init__(self, service: BenchService) -> None:
        self._service = service
        self._news = News()
        self._looking = asyncio.Lock()

    async def news(self) -> News:
        """Return the benches' state, read anew after `LOOK_S`; without a database the last one and the trouble."""
        async with self._looking:
            if monotonic_s() - self._news.at_s >= LOOK_S:
                self._news = await asyncio.to_thread(self._look, self._news)
        return self._news

    def _look(self, before: News) -> News:
        try:
            lives: dict[str, BenchLive] = {}
            benches: dict[str, bytes] = {}
            for bench_id in self._service.benches.ids():
                benches[bench_id] = self._bench(bench_id)
                live = self._service.live.of_bench(bench_id)
                if live is not None:
                    lives[bench_id] = live
            return News(benches, lives, None, monotonic_s())
        except ServiceError as error:
            return News(before.benches, before.lives, str(error), monotonic_s())

    def _bench(self, bench_id: str) -> bytes:
        service = self._service
        view = view_of(service, bench_id).model_copy(update={"live": None, "driver_seen_at": None})
        running = service.jobs.running_job(bench_id)
        job = None if running is None else service.stores.jobs.get(running.id)
        shown = None if job is None else JobView.of(job, service.queues.standing([job])[job.id])
        return frame("bench", BenchNews(bench=view, job=shown).model_dump_json())

    def live(self, bench_id: str, known: News) -> BenchLive | None:
        """Return the newest live state of a bench: of the own bench from memory, of others from the last reading. None:
        it never had a driver.
        """
        own = self._service.live
        return own.own_live() if bench_id == own.own else known.lives.get(bench_id)

    async def events(self, job_id: str, after: int) -> tuple[int, bytes]:
        """Return the last sequence and the frame of a job's new events; an empty frame where there are none."""
        try:
            found = await asyncio.to_thread(self._service.stores.jobs.events, job_id, after, PAGE)
        except (NotFound, ServiceError):
            return after, b""
        if not found:
            return after, b""
        news = JobNews(job=job_id, events=[EventView.of(event) for event in found])
        return found[-1].sequence, frame("job", news.model_dump_json())


def live_frame(live: BenchLive) -> bytes:
    """Return a bench's live state as the bytes of a server-sent event."""
    return frame("live", LIVE.dump_json(live))
