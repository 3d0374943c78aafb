"""Route of the feed: benches, their jobs and live states in one stream of server-sent events."""

from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import Query, Request
from fastapi.responses import StreamingResponse

from bench_service.api.feed.news import NewsReader, frame, live_frame
from bench_service.api.feed.schemas import Beat
from bench_service.api.http.errors import problems
from bench_service.api.jobs.event_stream import HEAD, HEADERS
from bench_service.bench.live.values import BenchLive
from bench_service.routing import Routes
from bench_service.wall_clock import monotonic_s, now, pause_async

router = Routes(prefix="/api/v1/feed", tags=["benches"])

TICK_S = 0.1
"""Interval in which a listener gets the newest live state, where it changed [s]."""
BEAT_S = 1.0
"""Interval between two signs of life [s]."""
JOBS_S = 0.5
"""Interval between two looks for new events of the jobs that a listener follows [s]."""
MOST_JOBS = 16
DOCUMENTED: dict[int | str, dict[str, object]] = {
    200: {
        "description": (
            "Server-sent events. `bench`: BenchNews of each bench, at first and after each change. `live`: BenchLive "
            "of a bench that works. `job`: JobNews of the jobs asked for, from their first event. `beat`: Beat, every "
            "second."
        ),
        "content": {"text/event-stream": {"schema": {"type": "string"}}},
    }
}


@router.get("", response_class=StreamingResponse, responses={**problems(), **DOCUMENTED})
async def follow(
    request: Request, job: Annotated[list[str] | None, Query(max_length=MOST_JOBS, description="Jobs to follow")] = None
) -> StreamingResponse:
    """Stream every bench's state, and the events of some jobs, in one connection: one is enough for a browser."""
    reader: NewsReader = request.app.state.news
    return StreamingResponse(_frames(reader, job or []), media_type="text/event-stream", headers=HEADERS)


async def _frames(reader: NewsReader, jobs: list[str]) -> AsyncIterator[bytes]:
    yield HEAD
    told: dict[str, bytes] = {}
    lives: dict[str, BenchLive] = {}
    sequences = dict.fromkeys(jobs, 0)
    beat_s = jobs_s = float("-inf")
    while True:
        news = await reader.news()
        at_s = monotonic_s()
        pieces = [piece for bench, piece in news.benches.items() if told.get(bench) != piece]
        told = dict(news.benches)
        for bench in news.benches:
            live = reader.live(bench, news)
            if live is not None and live is not lives.get(bench) and live != lives.get(bench):
                lives[bench] = live
                pieces.append(live_frame(live))
        if at_s - jobs_s >= JOBS_S:
            jobs_s = at_s
            for job, after in sequences.items():
                sequences[job], piece = await reader.events(job, after)
                pieces.append(piece)
        if at_s - beat_s >= BEAT_S:
            beat_s = at_s
            pieces.append(frame("beat", Beat(at=now(), trouble=news.trouble).model_dump_json()))
        if whole := b"".join(pieces):
            yield whole
        await pause_async(TICK_S)
