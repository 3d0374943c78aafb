"""Jobs over HTTP: states, idempotency, events, cancelling, what is kept."""

import json

from tests.service.client import Client


def test_a_calibration_ends_with_a_result_a_calibration_and_its_lineage(client: Client) -> None:
    job = client.wait(client.submit(seed=5)["id"])
    assert (job["state"], job["progress"]["station"], job["error"]) == ("succeeded", 12, None)
    result = client.http.get(f"/api/v1/jobs/{job['id']}/result").json()
    recordings = client.recordings(job["id"])
    assert len(recordings) == 12
    assert sorted(r["content_hash"] for r in result["lineage"]["recordings"]) == sorted(
        r["content_hash"] for r in recordings
    )
    assert result["lineage"]["seed"] == 5
    assert result["lineage"]["simulated"] is True
    assert result["lineage"]["code_version"] == job["code_version"]
    one = client.http.get(f"/api/v1/recordings/{recordings[0]['id']}").json()
    assert one["results"] == [result["id"]]
    newest = client.http.get("/api/v1/units/SIM-0001/calibrations").json()["items"][:2]
    assert {c["triad"] for c in newest} == {"gyro", "accelerometer"}
    assert [c["result"] for c in newest] == [result["id"]] * 2
    assert [c["current"] for c in newest] == [job["verdict"] == "pass"] * 2


def test_the_same_seed_gives_the_same_bytes_and_another_seed_others(client: Client) -> None:
    hashes = []
    for seed in (11, 11, 12):
        job = client.wait(client.submit(seed=seed)["id"])
        recordings = sorted(client.recordings(job["id"]), key=lambda r: r["station"]["index"])
        hashes.append([r["content_hash"] for r in recordings])
    assert hashes[0] == hashes[1]
    assert not set(hashes[0]) & set(hashes[2])


def test_a_repeated_key_gives_the_first_job_and_another_body_is_refused(client: Client) -> None:
    body = {"procedure": "no_operation", "unit": "SIM-0001"}
    first = client.http.post("/api/v1/jobs", json=body, headers={"Idempotency-Key": "night 1"})
    again = client.http.post("/api/v1/jobs", json=body, headers={"Idempotency-Key": "night 1"})
    other = client.http.post("/api/v1/jobs", json={**body, "priority": 3}, headers={"Idempotency-Key": "night 1"})
    assert first.json()["id"] == again.json()["id"]
    assert other.status_code == 409
    assert other.headers["content-type"] == "application/problem+json"
    client.wait(first.json()["id"])


def test_events_tell_the_whole_story_and_go_on_from_the_last_one_seen(client: Client) -> None:
    job = client.wait(client.submit(seed=1)["id"])
    path = f"/api/v1/jobs/{job['id']}/events"
    whole = _events(client.http.get(path).text)
    states = [e["data"]["state"] for e in whole if e["kind"] == "state"]
    assert states == ["queued", "running", "succeeded"]
    assert [e["data"]["station"] for e in whole if e["kind"] == "station"] == list(range(12))
    assert [e["sequence"] for e in whole] == list(range(1, len(whole) + 1))
    rest = _events(client.http.get(path, headers={"Last-Event-ID": "7"}).text)
    assert rest == whole[7:]


def _events(stream: str) -> list[dict]:
    return [json.loads(line.removeprefix("data: ")) for line in stream.splitlines() if line.startswith("data: ")]


def test_a_cancelled_job_leaves_the_bench_idle_and_keeps_what_was_recorded(client: Client) -> None:
    job = client.submit(parameters={"dwell_s": 3600.0})
    client.wait(job["id"], "running")
    while client.job(job["id"])["progress"]["station"] == 0:
        pass
    assert client.http.get("/api/v1/benches/sim").json()["job"] == job["id"]
    assert client.http.post(f"/api/v1/jobs/{job['id']}/cancel").status_code == 202
    ended = client.wait(job["id"])
    assert (ended["state"], ended["verdict"]) == ("cancelled", None)
    kept = client.recordings(job["id"])
    assert ended["progress"]["station"] == sum(r["state"] == "complete" for r in kept) < 12
    assert {r["state"] for r in kept} <= {"complete", "interrupted"}
    assert client.http.get("/api/v1/benches/sim").json()["state"] == "idle"
    assert client.http.post(f"/api/v1/jobs/{job['id']}/cancel").status_code == 409


def test_a_software_stop_ends_the_running_job(client: Client) -> None:
    job = client.submit(parameters={"dwell_s": 3600.0})
    client.wait(job["id"], "running")
    while client.http.get("/api/v1/benches/sim").json()["state"] == "idle":
        pass
    answer = client.http.post("/api/v1/benches/sim/stop")
    assert answer.status_code == 202
    assert answer.json()["job"] == job["id"]
    assert "hardware" in answer.json()["note"]
    assert client.wait(job["id"])["state"] == "cancelled"
    assert client.http.post("/api/v1/benches/sim/release").json()["stopped"] is None


def test_a_queued_job_is_cancelled_at_once_and_never_runs(client: Client) -> None:
    running = client.submit(parameters={"dwell_s": 3600.0})
    waiting = client.submit()
    assert client.http.post(f"/api/v1/jobs/{waiting['id']}/cancel").json()["state"] == "cancelled"
    client.http.post(f"/api/v1/jobs/{running['id']}/cancel")
    client.wait(running["id"])
    after = client.wait(client.submit("no_operation")["id"])
    assert after["state"] == "succeeded"
    assert client.job(waiting["id"])["progress"]["station"] == 0
    assert client.recordings(waiting["id"]) == []


def test_jobs_of_smaller_priority_number_run_first(client: Client) -> None:
    blocker = client.submit(parameters={"dwell_s": 600.0})
    late = client.submit("no_operation", priority=20)
    soon = client.submit("no_operation", priority=2)
    ended = [client.wait(job["id"]) for job in (blocker, late, soon)]
    assert ended[2]["started_at"] < ended[1]["started_at"]


def test_analysing_again_needs_no_bench_and_leaves_the_first_result(client: Client) -> None:
    job = client.wait(client.submit(seed=3)["id"])
    first = client.http.get(f"/api/v1/jobs/{job['id']}/result").json()
    again = client.http.post(f"/api/v1/jobs/{job['id']}/analyses", json={"parameters": {"gravity_m_s2": 9.8}})
    assert again.status_code == 201, again.text
    assert again.json()["document"] != first["document"]
    assert client.http.get(f"/api/v1/jobs/{job['id']}/result").json() == first
    listed = client.http.get(f"/api/v1/jobs/{job['id']}/analyses").json()["items"]
    assert [r["id"] for r in listed] == [again.json()["id"], first["id"]]


def test_a_result_read_twice_is_not_sent_twice(client: Client) -> None:
    job = client.wait(client.submit("no_operation")["id"])
    path = f"/api/v1/jobs/{job['id']}/result"
    etag = client.http.get(path).headers["ETag"]
    again = client.http.get(path, headers={"If-None-Match": etag})
    assert (again.status_code, again.content) == (304, b"")


def test_verification_names_the_calibration_that_it_rests_on(client: Client) -> None:
    current = client.calibrate(seed=21)
    job = client.wait(client.submit("verification_9_orientations", seed=22)["id"])
    result = client.http.get(f"/api/v1/jobs/{job['id']}/result").json()
    assert result["lineage"]["calibrations"] == list(current.values())


def test_lists_are_paged_newest_first(client: Client) -> None:
    made = [client.wait(client.submit("no_operation")["id"])["id"] for _ in range(3)]
    first = client.http.get("/api/v1/jobs", params={"limit": 2, "procedure": "no_operation"}).json()
    second = client.http.get("/api/v1/jobs", params={"limit": 2, "procedure": "no_operation", "after": first["next"]})
    ids = [job["id"] for job in first["items"] + second.json()["items"]]
    assert ids[:3] == made[::-1]
