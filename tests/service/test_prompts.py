"""A person at the bench is asked over REST, and the job goes on when the work is done, or ends when it is refused."""

import json
from collections.abc import Generator
from pathlib import Path

import pytest

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause
from tests.service.client import Client

LEGS = [{"target_c": target, "ramp_c_min": 5.0, "least_s": 600.0} for target in (30.0, 25.0, 20.0)]


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[Client]:
    url = f"sqlite:///{Path(tmp_path_factory.mktemp('asked')) / 'bench.sqlite'}"
    with connect(Settings(database_url=url, ask_operator=True), None, drive=True) as http:
        yield Client(http)


def asked(client: Client, job_id: str) -> dict:
    deadline = monotonic_s() + 60.0
    while (job := client.job(job_id))["prompt"] is None:
        assert job["state"] in ("queued", "running")
        assert monotonic_s() < deadline
        pause(0.02)
    return job


def answer(client: Client, job_id: str, **body: object) -> int:
    headers = {"X-Requested-By": "Olena"}
    return client.http.post(f"/api/v1/jobs/{job_id}/answer", json=body, headers=headers).status_code


def events_of(client: Client, job_id: str) -> list[dict]:
    lines = client.http.get(f"/api/v1/jobs/{job_id}/events").text.splitlines()
    found = [json.loads(line.removeprefix("data: ")) for line in lines if line.startswith("data: ")]
    return [event for event in found if "kind" in event]


def test_a_job_waits_for_the_person_and_a_refusal_ends_it_with_the_bench_safe(client: Client) -> None:
    job = client.submit("thermal_cycle", parameters={"legs": LEGS, "power_off_s": 60.0}, seed=3)
    first = asked(client, job["id"])
    assert first["state"] == "running"
    assert first["prompt"]["text"]
    assert "a person at the bench is asked" in first["waiting"]
    assert first["prompt"]["text"] in client.http.get(f"/jobs/{job['id']}").text.replace("&#39;", "'")
    asks = first["prompt"]["id"]
    assert answer(client, job["id"], done="perhaps", remark=[]) == 422
    assert answer(client, job["id"], done=True, remark="x axis up") == 422, "an answer names the prompt it answers"
    assert answer(client, job["id"], prompt=asks, done=True, remark="x axis up") == 202

    while (again := asked(client, job["id"]))["progress"]["station"] == 0:  # the next run asks anew
        pause(0.05)
    assert again["progress"]["station"] == 1
    assert again["prompt"]["id"] != asks
    assert answer(client, job["id"], prompt=asks, done=True) == 409, "a question that is over"
    assert client.job(job["id"])["prompt"] == again["prompt"]
    assert answer(client, job["id"], prompt=again["prompt"]["id"], done=False, remark="no time") == 202
    ended = client.wait(job["id"])
    assert ended["state"] == "cancelled"
    assert ended["prompt"] is None
    assert len(client.recordings(job["id"])) == 1
    assert client.http.get("/api/v1/benches/sim").json()["safety"]["safe"] is True
    assert answer(client, job["id"], prompt=asks, done=True) == 409
    events = [(e["kind"], e["data"]) for e in events_of(client, job["id"])]
    refusal = {"done": False, "remark": "no time", "by": "Olena", "prompt": again["prompt"]["id"]}
    assert ("answer", {"done": True, "remark": "x axis up", "by": "Olena", "prompt": asks}) in events
    assert ("answer", refusal) in events
    assert sum(kind == "prompt" for kind, _ in events) == 2


def test_a_cancel_ends_the_waiting(client: Client) -> None:
    job = client.submit("thermal_cycle", parameters={"legs": LEGS, "power_off_s": 60.0}, seed=4)
    asked(client, job["id"])
    said = {"by": "Olena", "reason": "the wrong unit"}
    client.http.post(f"/api/v1/jobs/{job['id']}/cancel", json=said)
    ended = client.wait(job["id"])
    assert (ended["state"], ended["prompt"]) == ("cancelled", None)
    assert {"cancel_requested": True, **said} in [event["data"] for event in events_of(client, job["id"])]
    assert client.http.post(f"/api/v1/jobs/{job['id']}/notes", json={"text": "again tomorrow"}).status_code == 201
    assert events_of(client, job["id"])[-1]["data"]["text"] == "again tomorrow"
