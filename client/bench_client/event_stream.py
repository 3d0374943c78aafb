"""Server-sent events of a job, over as many connections as it takes: none is missed, none comes twice."""

import json
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from typing import Any

import httpx

from bench_client.refusals import Unavailable
from bench_client.transport import FIRST_PAUSE_S, LONGEST_PAUSE_S, Transport
from bench_client.views import Event


def follow(
    transport: Transport, job_id: str, after: int, patience_s: float, pause: Callable[[float], None] = time.sleep
) -> Generator[Event]:
    """Yield the events of a job from after a sequence until it has ended; a lost connection is made again.

    Raises `Refused`, and `Unavailable` where the service is away for longer than `patience_s`.
    """
    pause_s, lost_s = FIRST_PAUSE_S, None
    while True:
        try:
            with transport.stream(f"/api/v1/jobs/{job_id}/events", {"Last-Event-ID": str(after)}) as answer:
                for event in frames(answer.iter_lines()):
                    pause_s, lost_s = FIRST_PAUSE_S, None
                    after = after if event.sequence is None else event.sequence
                    yield event
            if _ended(transport, job_id):
                return
        except (Unavailable, httpx.TransportError) as error:
            lost_s = time.monotonic() if lost_s is None else lost_s
            if time.monotonic() - lost_s > patience_s:
                raise Unavailable(f"the events of job {job_id} cannot be read: {error}") from error
        pause(pause_s)
        pause_s = min(2.0 * pause_s, LONGEST_PAUSE_S)


def frames(lines: Iterable[str]) -> Iterator[Event]:
    """Read events from the lines of a stream; comments and blocks without data are no events."""
    block: dict[str, str] = {}
    for line in lines:
        if not line:
            if "data" in block:
                yield _event(block)
            block = {}
        elif not line.startswith(":"):
            name, _, value = line.partition(":")
            value = value.removeprefix(" ")
            block[name] = f"{block[name]}\n{value}" if name == "data" and name in block else value


def _event(block: dict[str, str]) -> Event:
    data: dict[str, Any] = json.loads(block["data"])
    if "id" not in block:
        return Event(kind=block.get("event", "message"), data=data)
    return Event.model_validate(data)


def _ended(transport: Transport, job_id: str) -> bool:
    """Return whether a stream that is over was whole: the service lets slow listeners go, which come back."""
    return transport.get(f"/api/v1/jobs/{job_id}")["state"] in ("succeeded", "failed", "cancelled", "interrupted")
