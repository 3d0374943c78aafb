"""Batches of analyses over HTTP: a selection becomes tasks, equal content is analysed once, refusals have a way out."""

import pytest

from bench_service.evidence.batches import service as batch_service
from bench_service.wall_clock import monotonic_s, pause
from tests.service.client import Client

PATH = "/api/v1/analyses/batches"


@pytest.fixture(scope="module")
def job(sqlite_client: Client) -> dict:
    return sqlite_client.wait(sqlite_client.submit(seed=3, labels={"lot": "7"})["id"])


def submitted(client: Client, selection: dict, **more: object) -> dict:
    answer = client.http.post("/api/v1/analyses", json={"method": "allan_deviation", "selection": selection, **more})
    assert answer.status_code == 202, answer.text
    assert answer.headers["Location"] == f"{PATH}/{answer.json()['id']}"
    return answer.json()


def ended(client: Client, batch: dict) -> dict:
    deadline = monotonic_s() + 60
    while (now := client.http.get(f"{PATH}/{batch['id']}").json())["ended_at"] is None:
        assert monotonic_s() < deadline, now
        pause(0.05)
    return now


def test_a_selection_is_analysed_once_and_a_second_batch_takes_what_is_stored(sqlite_client: Client, job: dict) -> None:
    wanted = {"job": job["id"], "labels": ["lot=7"], "procedure": job["procedure"]}
    own = {"points": 37}  # no other test of the module, which may have run before this one, asks for this content
    first = ended(sqlite_client, submitted(sqlite_client, wanted, parameters=own))
    assert (first["state"], first["total"], first["counts"]["done"]) == ("succeeded", 12, 12)
    assert first["selection"] == wanted, "the query is shown as it was submitted"
    tasks = sqlite_client.http.get(f"{PATH}/{first['id']}/tasks", params={"limit": 5}).json()
    assert [task["number"] for task in tasks["items"]] == list(range(5))
    rest = sqlite_client.http.get(f"{PATH}/{first['id']}/tasks", params={"after": tasks["next"]}).json()
    assert [task["number"] for task in rest["items"]] == list(range(5, 12))
    results = {task["result"] for task in (*tasks["items"], *rest["items"])}
    assert len(results) == 12
    used = [
        record["id"]
        for result in results
        for record in sqlite_client.http.get(f"/api/v1/results/{result}").json()["lineage"]["recordings"]
    ]
    assert sorted(used) == sorted(r["id"] for r in sqlite_client.recordings(job["id"]))

    second = ended(sqlite_client, submitted(sqlite_client, wanted, parameters=own))
    assert (second["counts"]["reused"], second["counts"]["done"]) == (12, 0)
    taken = sqlite_client.http.get(f"{PATH}/{second['id']}/tasks").json()["items"]
    assert {task["result"] for task in taken} == results

    other = ended(sqlite_client, submitted(sqlite_client, wanted, parameters={"points": 38}))
    assert other["counts"]["done"] == 12, "other parameters are another content"
    assert sqlite_client.http.get(PATH).json()["items"][0]["id"] == other["id"]


def test_the_job_of_a_selection_is_named_by_its_number_too(sqlite_client: Client, job: dict) -> None:
    for name in (str(job["number"]), f"#{job['number']}"):
        batch = ended(sqlite_client, submitted(sqlite_client, {"job": name}))
        assert (batch["selection"]["job"], batch["total"]) == (job["id"], 12)
    body = {"method": "allan_deviation", "selection": {"job": "99999"}}
    answer = sqlite_client.http.post("/api/v1/analyses", json=body)
    assert (answer.status_code, "99999" in answer.text) == (404, True)


def test_an_analysis_that_was_requested_alone_is_taken_by_a_batch(sqlite_client: Client, job: dict) -> None:
    recording = sqlite_client.recordings(job["id"])[0]["id"]
    alone = sqlite_client.analyse("allan_deviation", recordings=[recording], parameters={"points": 30}).json()
    batch = ended(sqlite_client, submitted(sqlite_client, {"ids": [recording]}, parameters={"points": 30}))
    assert batch["counts"]["reused"] == 1
    assert sqlite_client.http.get(f"{PATH}/{batch['id']}/tasks").json()["items"][0]["result"] == alone["id"]
    again = sqlite_client.analyse("allan_deviation", recordings=[recording], parameters={"points": 30}).json()
    assert again["id"] != alone["id"], "a request without a selection makes its own result, as before"


def test_a_refused_analysis_fails_its_task_with_the_reason_and_may_be_retried(sqlite_client: Client, job: dict) -> None:
    recording = sqlite_client.recordings(job["id"])[0]["id"]
    batch = ended(sqlite_client, submitted(sqlite_client, {"ids": [recording]}, parameters={"channels": ["nothing"]}))
    assert batch["state"] == "failed"
    (task,) = sqlite_client.http.get(f"{PATH}/{batch['id']}/tasks", params={"state": "failed"}).json()["items"]
    assert task["attempt"] == 1, "a refusal is final"
    assert "nothing" in task["failure"]["message"]
    assert sqlite_client.http.post(f"{PATH}/{batch['id']}/cancel").status_code == 409
    assert sqlite_client.http.post(f"{PATH}/{batch['id']}/retry").status_code == 202
    assert ended(sqlite_client, batch)["counts"]["failed"] == 1


def test_progress_is_streamed_to_the_end(sqlite_client: Client, job: dict) -> None:
    batch = submitted(sqlite_client, {"job": job["id"]}, parameters={"points": 25})
    text = sqlite_client.http.get(f"{PATH}/{batch['id']}/events").text
    assert text.count("event: end") == 1
    assert '"succeeded"' in text.rpartition("event: end")[2]
    assert sqlite_client.http.get(f"{PATH}/nothing/events").status_code == 404


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({"selection": {"unit": "nobody"}}, "selection"),
        ({"selection": {"ids": ["nothing"]}}, "selection.ids"),
        ({"selection": {}, "recordings": ["x"]}, "recordings"),
        ({"selection": {"since": "2026-01-01T00:00:00"}}, "selection.since"),
        ({"selection": {"colour": "red"}}, "selection.colour"),
        ({"selection": {}, "each": "bench"}, "each"),
        ({"selection": {}, "parameters": {"points": -1}}, "parameters.points"),
    ],
)
def test_a_bad_selection_is_refused_by_its_field(sqlite_client: Client, job: dict, body: dict, field: str) -> None:
    answer = sqlite_client.http.post("/api/v1/analyses", json={"method": "allan_deviation", **body})
    assert answer.status_code == 422, answer.text
    assert answer.json()["errors"][0]["field"] == field


def test_too_many_recordings_and_too_many_waiting_tasks_are_refused_with_the_way_out(
    sqlite_client: Client, job: dict, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batch_service, "MOST_RECORDINGS", 3)
    body = {"method": "allan_deviation", "selection": {"job": job["id"]}}
    answer = sqlite_client.http.post("/api/v1/analyses", json=body)
    assert answer.status_code == 422
    assert "at most 3 recordings a batch" in answer.text
    monkeypatch.setattr(batch_service, "MOST_WAITING", 0)
    answer = sqlite_client.http.post("/api/v1/analyses", json=body)
    assert (answer.status_code, answer.headers["Retry-After"]) == (503, "2")


def test_a_key_makes_one_batch_and_another_body_is_a_conflict(sqlite_client: Client, job: dict) -> None:
    body = {"method": "allan_deviation", "selection": {"job": job["id"]}, "parameters": {"points": 31}}
    key = {"Idempotency-Key": "one batch"}
    first, second = (sqlite_client.http.post("/api/v1/analyses", json=body, headers=key) for _ in range(2))
    assert first.json()["id"] == second.json()["id"]
    other = {**body, "parameters": {"points": 32}}
    assert sqlite_client.http.post("/api/v1/analyses", json=other, headers=key).status_code == 409
    ended(sqlite_client, first.json())
