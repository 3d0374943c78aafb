"""The audit trail over HTTP: who asked what and what became of it; nothing about who only looked."""

import sqlite3
from pathlib import Path

import pytest

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from tests.kit.registered import register_bench
from tests.service.client import Client

BODY = {"procedure": "no_operation", "unit": "SIM-0001", "labels": {"lot": "7"}}


def entries(client: Client, **query: object) -> list[dict]:
    answer = client.http.get("/api/v1/audit", params=query)
    assert answer.status_code == 200, answer.text
    return answer.json()["items"]


def test_a_job_is_in_the_trail_with_who_asked_what_was_asked_and_what_became_of_it(client: Client) -> None:
    headers = {"X-Requested-By": "Ada, night shift", "X-Request-ID": "night/7"}
    answer = client.http.post("/api/v1/jobs", json=BODY, headers=headers)
    assert answer.headers["X-Request-ID"] == "night/7"
    job = answer.json()
    assert job["requested_by"] == "Ada, night shift"
    refused = client.http.post(f"/api/v1/jobs/{client.wait(job['id'])['id']}/cancel")
    assert refused.status_code == 409
    cancelled, submitted = entries(client, target=job["id"])
    assert (submitted["who"], submitted["action"], submitted["outcome"]) == ("Ada, night shift", "submit", "202")
    assert submitted["target"] == f"/api/v1/jobs/{job['id']}"
    assert submitted["detail"]["body"] == BODY
    assert submitted["detail"]["request"] == "night/7"
    assert (cancelled["action"], cancelled["outcome"]) == ("cancel", "409")
    assert cancelled["who"] not in ("", "Ada, night shift")
    assert entries(client, who="Ada, night shift", limit=1) == [submitted]


def test_who_only_looks_or_asks_for_what_is_not_there_leaves_no_entry(client: Client) -> None:
    before = entries(client)
    client.http.get("/api/v1/jobs")
    client.http.post("/api/v1/nothing")
    client.http.delete("/api/v1/jobs")
    assert entries(client) == before


def test_a_bench_stop_is_in_the_trail_and_so_is_a_body_that_was_refused(client: Client) -> None:
    client.http.post("/api/v1/benches/sim/stop", json={"reason": "smoke"}, headers={"X-Requested-By": "Bo"})
    client.http.post("/api/v1/benches/sim/release", headers={"X-Requested-By": "Bo"})
    no_json, by = b'{"a": 1e999, "b": ' + b"[" * 3000, {"X-Requested-By": "Bo", "Content-Type": "application/json"}
    client.http.post("/api/v1/jobs", content=no_json, headers=by)
    client.http.post("/api/v1/jobs", json={"seed": "x" * 10_000}, headers={"X-Requested-By": "Bo"})
    found = entries(client, who="Bo")[::-1]
    assert [(e["action"], e["outcome"]) for e in found] == [
        ("stop", "202"),
        ("release", "200"),
        ("submit", "422"),
        ("submit", "422"),
    ]
    assert found[0]["detail"]["body"] == {"reason": "smoke"}
    assert found[3]["detail"]["bytes"] > 10_000


def test_files_are_never_part_of_an_entry(client: Client) -> None:
    description = {
        "unit": "FILE-1",
        "channels": [{"name": "gyro_x", "quantity": "angular_rate", "unit": "count"}],
        "rate_hz": 100.0,
    }
    made = client.import_files(description, b"gyro_x\n1\n2\n3\n")
    assert made.status_code == 201
    (entry,) = entries(client, target=made.json()["id"])
    assert entry["action"] == "import_recording"
    assert set(entry["detail"]) == {"request", "path", "bytes"}


@pytest.mark.parametrize("who", ["", "x" * 201, "a\tb"])
def test_a_name_that_cannot_be_kept_is_refused_and_nothing_is_done(client: Client, who: str) -> None:
    before = client.stored()
    answer = client.http.post("/api/v1/jobs", json=BODY, headers={"X-Requested-By": who})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "X-Requested-By"
    assert client.stored() == before


def test_the_trail_is_paged(client: Client) -> None:
    for number in range(5):
        client.http.post("/api/v1/benches/none/stop", headers={"X-Requested-By": f"page {number % 2}"})
    first = client.http.get("/api/v1/audit", params={"limit": 2, "who": "page 0"}).json()
    second = client.http.get("/api/v1/audit", params={"limit": 2, "who": "page 0", "after": first["next"]}).json()
    assert len(first["items"]) == 2
    assert len(second["items"]) == 1
    assert {e["outcome"] for e in first["items"]} == {"404"}


def test_where_the_entry_cannot_be_written_the_outcome_is_told_all_the_same(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "bench.sqlite"
    settings = Settings(database_url=f"sqlite:///{file}")
    register_bench(settings)
    with connect(settings, None, drive=False) as http:
        other = sqlite3.connect(file)
        other.execute("CREATE TRIGGER full BEFORE INSERT ON audit BEGIN SELECT RAISE(ABORT, 'no room'); END")
        other.commit()
        other.close()
        assert http.post("/api/v1/benches/sim/stop").status_code == 202
        assert http.get("/api/v1/benches/sim").json()["state"] == "stopped"
        assert http.get("/api/v1/audit").json()["items"] == []
    assert "no room" in caplog.text
    assert "/api/v1/benches/sim/stop" in caplog.text
