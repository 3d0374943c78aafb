"""Jobs put aside and taken up again, deadlines, and benches that stay stopped until somebody releases them."""

from collections.abc import Generator
from datetime import UTC, datetime, timedelta

import pytest

from bench_service.wall_clock import monotonic_s, now, pause
from tests.service.client import FAST, Client

SLOW = {**FAST, "dwell_s": 600.0}
"""Twelve stations that take long enough to be met in the middle."""


def hashes(client: Client, job_id: str) -> list[str]:
    return [r["content_hash"] for r in client.recordings(job_id)]


def until_station(client: Client, job_id: str, station: int) -> None:
    deadline = monotonic_s() + 60.0
    while client.job(job_id)["progress"]["station"] < station:
        assert monotonic_s() < deadline
        pause(0.005)


@pytest.fixture(scope="module")
def undisturbed(client: Client) -> dict:
    return client.wait(client.submit(seed=5, parameters=SLOW)["id"])


def test_a_paused_job_goes_on_where_it_was_and_gives_the_same(client: Client, undisturbed: dict) -> None:
    job = client.submit(seed=5, parameters=SLOW)
    until_station(client, job["id"], 2)
    assert client.http.post(f"/api/v1/jobs/{job['id']}/pause").json()["pause_requested"]
    paused = client.wait(job["id"], "paused")
    assert 2 <= paused["progress"]["station"] < 12
    assert (paused["verdict"], paused["finished_at"]) == (None, None)
    assert len(client.recordings(job["id"])) == paused["progress"]["station"]
    other = client.wait(client.submit(seed=9)["id"])  # the bench is free meanwhile
    assert other["state"] == "succeeded"
    assert client.job(job["id"])["state"] == "paused"
    page = client.http.get(f"/jobs/{job['id']}").text
    assert "Other jobs may use it" in page
    assert "Resume" in page

    resumed = client.http.post(f"/api/v1/jobs/{job['id']}/resume").json()
    assert (resumed["state"], resumed["attempt"], resumed["pause_requested"]) == ("queued", 2, False)
    done = client.wait(job["id"])
    assert done["state"] == "succeeded"
    assert hashes(client, job["id"]) == hashes(client, undisturbed["id"])
    results = [client.http.get(f"/api/v1/jobs/{i}/result").json()["document"] for i in (job["id"], undisturbed["id"])]
    assert results[0]["triads"] == results[1]["triads"]


def test_a_queued_job_is_paused_at_once_and_a_wish_can_be_taken_back(client: Client) -> None:
    running = client.submit(seed=5, parameters=SLOW)["id"]
    waiting = client.submit("no_operation", priority=500)["id"]
    assert client.http.post(f"/api/v1/jobs/{waiting}/pause").json()["state"] == "paused"
    until_station(client, running, 1)
    client.http.post(f"/api/v1/jobs/{running}/pause")
    back = client.http.post(f"/api/v1/jobs/{running}/resume").json()
    if back["state"] == "running":  # it may have reached its next station in between
        assert not back["pause_requested"]
    assert client.wait(running)["state"] == "succeeded"
    assert client.job(waiting)["state"] == "paused"
    assert client.http.post(f"/api/v1/jobs/{waiting}/resume").json()["state"] in ("queued", "running", "succeeded")
    assert client.wait(waiting)["state"] == "succeeded"


def test_a_wish_that_is_taken_back_at_any_moment_never_strands_a_job(client: Client, undisturbed: dict) -> None:
    job = client.submit(seed=5, parameters=SLOW)["id"]
    until_station(client, job, 1)
    for round_ in range(12):
        client.http.post(f"/api/v1/jobs/{job}/pause")  # 409 once it has ended
        pause(0.02 * (round_ % 4))  # before, while and after the bench is made safe
        client.http.post(f"/api/v1/jobs/{job}/resume")  # 409 where it is queued again already
        pause(0.05)
    assert client.wait(job)["state"] == "succeeded"
    assert hashes(client, job) == hashes(client, undisturbed["id"])


def test_a_paused_job_can_be_cancelled_and_an_ended_one_neither_paused_nor_resumed(client: Client) -> None:
    running = client.submit(seed=5, parameters=SLOW)["id"]
    job = client.submit("no_operation")["id"]
    client.http.post(f"/api/v1/jobs/{job}/pause")
    assert client.http.post(f"/api/v1/jobs/{job}/cancel").json()["state"] == "cancelled"
    for verb in ("pause", "resume", "cancel"):
        answer = client.http.post(f"/api/v1/jobs/{job}/{verb}")
        assert answer.status_code == 409
        assert "cancelled" in answer.json()["detail"]
    assert client.http.post("/api/v1/jobs/none/pause").status_code == 404
    client.http.post(f"/api/v1/jobs/{running}/cancel")
    assert client.wait(running)["state"] == "cancelled"


def test_no_station_begins_after_the_deadline(client: Client) -> None:
    past = (datetime.now(UTC) - timedelta(seconds=1)).isoformat()
    late = client.wait(client.submit(seed=5, deadline_at=past)["id"])
    assert (late["state"], late["verdict"]) == ("failed", "error")
    assert late["error"]["kind"] == "DeadlinePassed"
    assert late["error"]["station"] == 0
    assert client.recordings(late["id"]) == []
    far = (now() + timedelta(hours=1)).isoformat()
    assert client.wait(client.submit(seed=5, deadline_at=far)["id"])["state"] == "succeeded"
    naive = {"procedure": "no_operation", "unit": "SIM-0001", "deadline_at": "2031-01-01T00:00:00"}
    refusal = client.http.post("/api/v1/jobs", json=naive)
    assert refusal.status_code == 422
    assert "deadline_at" in refusal.text


def test_a_stopped_bench_stays_stopped_until_it_is_released(client: Client) -> None:
    running = client.submit(seed=5, parameters=SLOW)["id"]
    until_station(client, running, 1)
    stopped = client.http.post("/api/v1/benches/sim/stop", json={"reason": "smoke from the supply"}).json()
    assert stopped["job"] == running
    assert client.wait(running)["state"] == "cancelled"
    bench = client.http.get("/api/v1/benches/sim").json()
    assert bench["state"] == "stopped"
    assert bench["stopped"].endswith("smoke from the supply")
    waiting = client.submit("no_operation")["id"]
    pause(1.0)
    assert client.job(waiting)["state"] == "queued"
    text = "".join(client.http.get(f"/jobs/{waiting}").text.split("\n"))
    assert "smoke from the supply" in client.http.get("/").text
    assert "queued" in text
    assert client.http.post("/api/v1/benches/sim/release").json()["state"] in ("idle", "busy")
    assert client.wait(waiting)["state"] == "succeeded"
    events = client.http.get(f"/api/v1/jobs/{waiting}/events").text
    assert "smoke from the supply" in events  # why it had to wait
    assert client.http.post("/api/v1/benches/none/release").status_code == 404


@pytest.fixture(scope="module", autouse=True)
def released(client: Client) -> Generator[None]:
    """Whatever a test leaves, the bench is free for the next module."""
    yield
    client.http.post("/api/v1/benches/sim/release")
