"""The feed: every bench and the events of chosen jobs in one stream, with a sign of life every second."""

import json
from collections.abc import Generator, Iterator
from typing import Any

import httpx
import pytest

from bench_service.wall_clock import monotonic_s
from tests.kit.served import served
from tests.service.client import FAST, Client


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[Client]:
    with served(tmp_path_factory.mktemp("fed")) as at, httpx.Client(base_url=at, timeout=60) as http:
        yield Client(http)


def frames(answer: httpx.Response) -> Iterator[tuple[str, dict[str, Any]]]:
    kind = ""
    for line in answer.iter_lines():
        if line.startswith("event: "):
            kind = line.removeprefix("event: ")
        elif line.startswith("data: "):
            yield kind, json.loads(line.removeprefix("data: "))


def test_a_listener_gets_the_bench_at_once_and_after_each_change(client: Client) -> None:
    with client.http.stream("GET", "/api/v1/feed") as answer:
        assert answer.headers["content-type"].startswith("text/event-stream")
        told = frames(answer)
        kind, first = next(told)
        assert (kind, first["bench"]["id"], first["bench"]["state"], first["job"]) == ("bench", "sim", "idle", None)
        stop = client.http.post("/api/v1/benches/sim/stop", json={"reason": "look"}).json()["stop"]
        changed = next(news for kind, news in told if kind == "bench" and news["bench"]["stops"])
        assert [one["id"] for one in changed["bench"]["stops"]] == [stop]
        said = {"by": "t", "remark": "t"}
        client.http.post(f"/api/v1/benches/sim/stops/{stop}/release", json=said)
        assert next(news for kind, news in told if kind == "bench")["bench"]["stops"] == []


def test_a_listener_gets_all_events_of_its_jobs_in_order_and_their_live_state(client: Client) -> None:
    before = client.wait(client.submit(parameters=FAST)["id"])["id"]
    running = client.submit(parameters={"dwell_s": 86_400.0})["id"]
    wanted = {"bench", "live", "job", "beat"}
    seen: set[str] = set()
    events: dict[str, list[int]] = {before: [], running: []}
    with client.http.stream("GET", "/api/v1/feed", params={"job": [before, running, "none"]}) as answer:
        for kind, news in frames(answer):
            seen.add(kind)
            if kind == "job":
                events[news["job"]] += [event["sequence"] for event in news["events"]]
            if kind == "live" and news["job"] is not None:
                assert news["job"]["id"] == running
            if seen >= wanted and events[running]:
                break
    client.http.post(f"/api/v1/jobs/{running}/cancel")
    client.wait(running)
    assert events[before] == list(range(1, len(events[before]) + 1))
    assert len(events[before]) >= 14, "queued, running, twelve stations"


def test_it_beats_every_second(client: Client) -> None:
    beats: list[float] = []
    with client.http.stream("GET", "/api/v1/feed") as answer:
        for kind, _ in frames(answer):
            if kind == "beat":
                beats.append(monotonic_s())
            if len(beats) == 3:
                break
    assert 1.8 < beats[2] - beats[0] < 3.5


def test_too_many_jobs_are_refused(client: Client) -> None:
    answer = client.http.get("/api/v1/feed", params={"job": [str(k) for k in range(17)]})
    assert answer.status_code == 422
