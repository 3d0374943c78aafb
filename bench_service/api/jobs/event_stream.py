"""Server-sent events of a job: the format in which its events are sent.

An event's `id` is its sequence: a client that reconnects sends it as `Last-Event-ID` and misses nothing. The bench's
current activity (`event: live`) has no id, because it is not part of what is kept.
"""

from pydantic import TypeAdapter

from bench_service.api.jobs.schemas import EventView
from bench_service.bench.live.values import BenchLive
from bench_service.model.job import Event

RETRY_MS = 1000
"""Time after which a browser that lost the connection reconnects [ms]."""
HEAD = f"retry: {RETRY_MS}\n\n".encode()
HEADERS = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
LIVE = TypeAdapter(BenchLive)
DOCUMENTED: dict[int | str, dict[str, object]] = {
    200: {
        "description": (
            "Server-sent events; `id` is the sequence, `event` the kind, `data` an EventView. While the job runs also "
            "`event: live` without an id, its `data` a BenchLive: progress, devices, a few samples; at most twice a "
            "second, less often for many listeners. A comment says that the connection lives, or that the listener was "
            "too slow and is let go: it comes back with `Last-Event-ID`."
        ),
        "content": {"text/event-stream": {"schema": {"type": "string"}}},
    }
}


class ServerSentEvents:
    """Format of a job's events as server-sent events. Implements `bench_service.jobs.events.hub.Frames`."""

    quiet = b": still here\n\n"
    dropped = b": too slow, and let go; come back with Last-Event-ID\n\n"

    def event(self, event: Event) -> bytes:
        """Return an event as the bytes of a server-sent event, with its sequence as id."""
        data = EventView.of(event).model_dump_json()
        return f"id: {event.sequence}\nevent: {event.kind}\ndata: {data}\n\n".encode()

    def live(self, live: BenchLive) -> bytes:
        """Return the bench's current activity as the bytes of a server-sent event, without id."""
        return b"event: live\ndata: " + LIVE.dump_json(live) + b"\n\n"


FRAMES = ServerSentEvents()
