"""Queues and reservations over HTTP: where my job stands, who goes first, who waits for whom, and what is refused."""

from collections.abc import Generator
from datetime import timedelta

import pytest

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from bench_service.wall_clock import now
from tests.service.client import Client
from tests.service.jumping_clock import JumpingClock


@pytest.fixture
def stopped(client: Client) -> Generator[Client]:
    """The bench stands still, so that jobs stay in the queue."""
    client.http.post("/api/v1/benches/sim/stop", json={"reason": "lunch"})
    yield client
    for kept in client.http.get("/api/v1/reservations", params={"active": True}).json()["items"]:
        client.http.delete(f"/api/v1/reservations/{kept['id']}")
    assert client.http.post("/api/v1/benches/sim/release").is_success
    for job in client.http.get("/api/v1/jobs", params={"state": "queued"}).json()["items"]:
        client.wait(job["id"])


def reserve(client: Client, status: int = 201, **body: object) -> dict:
    answer = client.http.post("/api/v1/reservations", json={"holder": "Ann", **body})
    assert answer.status_code == status, answer.text
    return answer.json()


def order(client: Client) -> list[str]:
    queue = client.http.get("/api/v1/benches/sim/queue").json()
    assert [entry["position"] for entry in queue["entries"]] == list(range(1, len(queue["entries"]) + 1))
    return [entry["job"] for entry in queue["entries"]]


def test_one_call_tells_where_a_job_stands_and_a_priority_changes_it(stopped: Client) -> None:
    first, second, urgent = (stopped.submit("no_operation", priority=p) for p in (10, 10, 1))
    assert first["queue"] == {"position": 1, "ahead": 0}
    assert first["waiting"] == "bench sim is stopped: lunch"
    assert order(stopped) == [urgent["id"], first["id"], second["id"]]
    assert stopped.job(second["id"])["queue"]["position"] == 3
    moved = stopped.http.patch(f"/api/v1/jobs/{second['id']}", json={"priority": 1})
    assert (moved.json()["priority"], moved.json()["queue"]["position"]) == (1, 1)  # it was queued before the other
    assert stopped.http.patch(f"/api/v1/jobs/{second['id']}", json={"priority": 0}).status_code == 422
    listed = stopped.http.get("/api/v1/jobs", params={"state": "queued"}).json()["items"]
    assert {job["id"]: job["queue"]["position"] for job in listed} == {
        job: number for number, job in enumerate(order(stopped), start=1)
    }
    bench = stopped.http.get("/api/v1/benches/sim").json()
    assert (bench["queued"], bench["state"]) == (3, "stopped")
    assert "process" in bench["driven_by"]
    expected = order(stopped)
    stopped.http.post("/api/v1/benches/sim/release")
    done = [stopped.wait(job) for job in expected]
    starts = [job["started_at"] for job in done]
    assert starts == sorted(starts)
    assert (done[0]["queue"], done[0]["waiting"]) == (None, None)
    late = stopped.http.patch(f"/api/v1/jobs/{expected[0]}", json={"priority": 5})
    assert late.status_code == 409
    assert "succeeded" in late.json()["detail"]


@pytest.mark.parametrize("what", [{"bench": "sim"}, {"unit": "SIM-0001"}])
def test_jobs_of_others_wait_for_the_holder(client: Client, what: dict[str, str]) -> None:
    kept = reserve(client, **what, minutes=5, note="night run")
    assert (kept["active"], kept["holder"], kept["note"]) == (True, "Ann", "night run")
    again = reserve(client, 409, **what, minutes=5)
    assert "reserved by Ann until" in again["detail"]
    theirs = client.submit("no_operation", priority=1)
    assert "reserved by Ann until" in theirs["waiting"]
    hers = client.wait(client.submit("no_operation", reservation=kept["id"])["id"])
    assert (hers["state"], hers["reservation"]) == ("succeeded", kept["id"])
    assert client.job(theirs["id"])["state"] == "queued"
    ended = client.http.delete(f"/api/v1/reservations/{kept['id']}").json()
    assert ended["active"] is False
    assert ended["ended_at"] is not None
    assert client.wait(theirs["id"])["state"] == "succeeded"
    assert "reserved by Ann" in client.http.get(f"/api/v1/jobs/{theirs['id']}/events").text


def test_a_reservation_ends_by_itself_and_its_job_becomes_an_ordinary_one(
    stopped: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    wall = JumpingClock(monkeypatch)
    kept = reserve(stopped, unit="SIM-0001", until=(now() + timedelta(minutes=2)).isoformat())
    job = stopped.submit("no_operation", reservation=kept["id"])
    wall.jump(minutes=2, seconds=1)
    expired = stopped.http.post(
        "/api/v1/jobs", json={"procedure": "no_operation", "unit": "SIM-0001", "reservation": kept["id"]}
    )
    assert expired.status_code == 422
    (error,) = expired.json()["errors"]
    assert error["field"] == "reservation"
    assert "ended at " + kept["until"][:19] in error["message"]
    stopped.http.post("/api/v1/benches/sim/release")
    assert stopped.wait(job["id"])["state"] == "succeeded"
    assert "ordinary job" in stopped.http.get(f"/api/v1/jobs/{job['id']}/events").text
    assert not stopped.http.get(f"/api/v1/reservations/{kept['id']}").json()["active"]


def test_what_cannot_be_reserved_or_used_is_refused_by_field(client: Client) -> None:
    past = (now() - timedelta(seconds=1)).isoformat()
    assert reserve(client, 422, bench="sim", until=past)["errors"][0]["field"] == "until"
    assert "exactly one of bench and unit" in reserve(client, 422, minutes=5)["detail"]
    assert "exactly one of until and minutes" in reserve(client, 422, bench="sim", minutes=5, until=past)["detail"]
    assert "there is sim" in reserve(client, 404, bench="moon", minutes=5)["detail"]
    assert reserve(client, 404, unit="NOBODY-1", minutes=5)["detail"]
    for reservation, words in (("none", "the id of a reservation"),):
        body = {"procedure": "no_operation", "unit": "SIM-0001", "reservation": reservation}
        answer = client.http.post("/api/v1/jobs", json=body)
        assert answer.status_code == 422
        assert answer.json()["errors"][0]["field"] == "reservation"
        assert words in answer.text
    client.wait(client.submit("no_operation", unit="RANDOM-7")["id"])
    other = reserve(client, unit="RANDOM-7", minutes=1)
    wrong = client.http.post(
        "/api/v1/jobs", json={"procedure": "no_operation", "unit": "SIM-0001", "reservation": other["id"]}
    )
    assert wrong.status_code == 422
    assert "this one is of unit RANDOM-7" in wrong.text
    client.http.delete(f"/api/v1/reservations/{other['id']}")


def test_a_repeated_key_makes_one_reservation_and_another_body_is_refused(client: Client) -> None:
    headers = {"Idempotency-Key": "keep the bench"}
    body = {"unit": "SIM-0001", "holder": "Ann", "minutes": 1}
    first, again = (client.http.post("/api/v1/reservations", json=body, headers=headers) for _ in range(2))
    assert first.json()["id"] == again.json()["id"]
    other = client.http.post("/api/v1/reservations", json={**body, "holder": "Bob"}, headers=headers)
    assert other.status_code == 409
    client.http.delete(f"/api/v1/reservations/{first.json()['id']}")


def test_an_api_alone_queues_for_a_bench_that_somebody_else_drives(client: Client, database_url: str) -> None:
    """No second driving service: the fixture's one is the worker here."""
    with connect(Settings(database_url=database_url), None, drive=False) as http:
        alone = Client(http)
        assert [bench["id"] for bench in http.get("/api/v1/benches").json()] == ["sim"]
        job = alone.submit("no_operation", unit="RANDOM-3")
        assert alone.wait(job["id"])["state"] == "succeeded"
        assert http.get("/readyz").is_success
        assert http.get("/").is_success
        unknown = http.post("/api/v1/jobs", json={"procedure": "no_operation", "unit": "SIM-0001", "bench": "moon"})
        assert unknown.status_code == 404
        assert "there is sim" in unknown.json()["detail"]
        nobody = http.post("/api/v1/jobs", json={"procedure": "no_operation", "unit": "NOBODY-1"})
        assert nobody.status_code == 422
        assert "SIM-0001" in nobody.json()["detail"]
        assert client.job(job["id"]) == alone.job(job["id"])
