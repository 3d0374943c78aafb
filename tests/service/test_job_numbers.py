"""Short numbers of jobs: counted from 1 in each database, and good wherever a job's id is."""

import httpx
import pytest

from bench_service.model.job import job_number
from tests.service.client import Client


@pytest.fixture(scope="module")
def jobs(client: Client) -> list[dict]:
    """Three jobs, the first two ended."""
    made = [client.submit("no_operation") for _ in range(2)]
    for job in made:
        client.wait(job["id"])
    return [*made, client.submit("no_operation")]


def test_jobs_are_counted_from_one(client: Client, jobs: list[dict]) -> None:
    assert [job["number"] for job in jobs] == [1, 2, 3]
    listed = client.http.get("/api/v1/jobs").json()["items"]
    assert {job["id"]: job["number"] for job in listed} == {job["id"]: job["number"] for job in jobs}


@pytest.mark.parametrize("name", ["2", "%232"])
def test_a_number_stands_for_the_id_in_every_address(client: Client, jobs: list[dict], name: str) -> None:
    second = jobs[1]["id"]
    for path in ("", "/result", "/analyses"):
        by_number = client.http.get(f"/api/v1/jobs/{name}{path}")
        assert (by_number.status_code, by_number.content) == _answer(client.http.get(f"/api/v1/jobs/{second}{path}"))
    assert client.http.post(f"/api/v1/jobs/{name}/notes", json={"text": "seen"}).status_code == 201
    events = client.http.get(f"/api/v1/jobs/{name}/events").text
    assert '"seen"' in events
    assert client.http.get(f"/jobs/{name}").text.count(second) > 0
    assert client.http.get(f"/api/v1/jobs/{name}/samples").status_code == 404
    assert client.http.get("/api/v1/recordings", params={"job": name.replace("%23", "#")}).json()["items"] == []


def _answer(answer: httpx.Response) -> tuple[int, bytes]:
    return answer.status_code, answer.content


def test_a_number_of_no_job_is_refused_by_it(client: Client, jobs: list[dict]) -> None:
    for path in ("/api/v1/jobs/77", "/api/v1/jobs/77/samples", "/api/v1/recordings?job=77"):
        answer = client.http.get(path)
        assert (answer.status_code, "#77" in answer.text) == (404, True), answer.text
    assert client.http.post("/api/v1/jobs/77/cancel").status_code == 404
    assert client.http.get("/jobs/77").status_code == 404


def test_a_search_finds_a_job_by_its_number(client: Client, jobs: list[dict]) -> None:
    found = client.http.get("/api/v1/jobs", params={"text": "#3"}).json()["items"]
    assert [job["id"] for job in found] == [jobs[2]["id"]]


def test_a_queue_names_its_jobs_by_number(client: Client, jobs: list[dict]) -> None:
    held = client.submit("static_run", parameters={"duration_s": 36000.0})
    waiting = client.submit("no_operation", parameters={})
    client.wait(held["id"], "running")
    queue = client.http.get("/api/v1/benches/sim/queue").json()
    assert (queue["running_number"], [e["number"] for e in queue["entries"]]) == (held["number"], [waiting["number"]])
    for job in (waiting, held):
        assert client.http.post(f"/api/v1/jobs/{job['number']}/cancel").status_code == 202
        client.wait(job["id"])
    assert f"#{held['number']}" in client.http.get("/").text


def test_the_same_key_gives_the_same_number(client: Client, jobs: list[dict]) -> None:
    body = {"procedure": "no_operation", "unit": "SIM-0001", "parameters": {}}
    made = [
        client.http.post("/api/v1/jobs", json=body, headers={"Idempotency-Key": "number"}).json()["number"]
        for _ in range(2)
    ]
    assert made[0] == made[1]


def test_what_is_a_number_and_what_is_not() -> None:
    assert [job_number(text) for text in ("7", "#7", "007")] == [7, 7, 7]
    for text in ("", "#", "7a", "-7", "##7", "7 ", "١", "1234567890", "01a22b47-96a3-70eb-9f04-7c14b4ffaf00"):
        assert job_number(text) is None, text
