"""Many listen to one job: none misses anything, also after losing the connection; who is too slow is let go alone."""

import asyncio
import json
import socket
import statistics
from collections.abc import Generator
from dataclasses import dataclass, field
from datetime import UTC, datetime

import httpx
import pytest

from bench_service.cli.processes.serving import serving
from bench_service.settings import Settings
from tests.service.client import Client

LISTENERS = 50
LOSSES = 2
"""How often each listener loses its connection."""
STEPS = {"dwell_s": 300.0, "settle_s": 0.5}


@pytest.fixture(scope="module")
def address(database_url: str) -> Generator[str]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    with serving(Settings(database_url=database_url, port=port)):
        yield f"http://127.0.0.1:{port}"


@dataclass
class Heard:
    """Events that one listener heard, in order."""

    sequences: list[int] = field(default_factory=list[int])
    delays_s: list[float] = field(default_factory=list[float])
    live: int = 0
    ended: bool = False


async def listen(http: httpx.AsyncClient, path: str, heard: Heard, lose_after: int | None) -> None:
    """Listen until the job ends; or only until so many events have come, and then cut the connection."""
    headers = {"Last-Event-ID": str(heard.sequences[-1])} if heard.sequences else {}
    fresh, kind = 0, ""
    async with http.stream("GET", path, headers=headers) as answer:
        async for line in answer.aiter_lines():
            if line.startswith("event: "):
                kind = line.removeprefix("event: ")
            if not line.startswith("data: "):
                continue
            if kind == "live":
                heard.live += 1
                continue
            event = json.loads(line.removeprefix("data: "))
            heard.sequences.append(event["sequence"])
            heard.delays_s.append((datetime.now(UTC) - datetime.fromisoformat(event["at"])).total_seconds())
            fresh += 1
            if fresh == lose_after:
                return
    heard.ended = True


async def listener(http: httpx.AsyncClient, path: str, heard: Heard, number: int) -> None:
    for loss in range(LOSSES):
        await listen(http, path, heard, 1 + (number + loss) % 4)
        if heard.ended:
            return
    await listen(http, path, heard, None)


async def crowd(address: str, job_id: str) -> list[Heard]:
    limits = httpx.Limits(max_connections=None, max_keepalive_connections=0)
    heard = [Heard() for _ in range(LISTENERS)]
    async with httpx.AsyncClient(base_url=address, timeout=60, limits=limits) as http:
        path = f"/api/v1/jobs/{job_id}/events"
        await asyncio.gather(*(listener(http, path, one, number) for number, one in enumerate(heard)))
    return heard


def test_none_of_many_misses_an_event_after_losing_the_connection(address: str) -> None:
    with httpx.Client(base_url=address, timeout=60) as http:
        client = Client(http)
        job = client.submit(parameters=STEPS, seed=4)
        heard = asyncio.run(crowd(address, job["id"]))
        assert client.job(job["id"])["state"] == "succeeded"
        whole = client.http.get(f"/api/v1/jobs/{job['id']}/events").text
    last = whole.count("\nid: ")
    assert last == 2 + 12 + 1
    for one in heard:
        assert one.sequences == list(range(1, last + 1))
    delays = sorted(d for one in heard for d in one.delays_s)
    p50, p95 = statistics.median(delays), delays[int(0.95 * len(delays))]
    print(
        f"{LISTENERS} listeners, {LOSSES} losses each: delay p50 {p50:.3f} s, p95 {p95:.3f} s, reconnections included"
    )
