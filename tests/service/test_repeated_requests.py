"""An idempotency key keeps what it made: the same request again gives it, also where it would be refused by now."""

from typing import Any

import pytest

from tests.service.campaigns import add, ended, named, start
from tests.service.client import FAST, Client


def repeated(client: Client, address: str, body: dict[str, Any], status: int) -> dict[str, Any]:
    """The answer to a request with a key, said once more in the same words."""
    answer = client.http.post(address, json=body, headers={"Idempotency-Key": "mine"})
    assert answer.status_code == status, answer.text
    return answer.json()


def test_a_run_whose_campaign_has_changed_since(client: Client) -> None:
    add(client, named("changes", {}, {}))
    body = {"unit": "SIM-0001", "parameters": {"b": {}}}
    first = repeated(client, "/api/v1/campaigns/changes/runs", body, 202)
    client.http.put("/api/v1/campaigns/changes", json=named("changes", {})).raise_for_status()
    assert repeated(client, "/api/v1/campaigns/changes/runs", body, 202)["id"] == first["id"]
    assert len(client.http.get("/api/v1/campaign-runs", params={"campaign": "changes"}).json()["items"]) == 1


def test_a_job_whose_reservation_was_given_back_since(client: Client) -> None:
    wanted = {"bench": "sim", "holder": "Ada", "minutes": 10.0}
    held = client.http.post("/api/v1/reservations", json=wanted)
    assert held.status_code == 201, held.text
    reservation = held.json()["id"]
    body = {"procedure": "no_operation", "unit": "SIM-0001", "reservation": reservation}
    first = repeated(client, "/api/v1/jobs", body, 202)
    client.http.delete(f"/api/v1/reservations/{reservation}").raise_for_status()
    assert repeated(client, "/api/v1/jobs", body, 202)["id"] == first["id"]
    refused = client.http.post("/api/v1/jobs", json=body)
    assert refused.status_code == 422, "without the key it is a new request"


def test_a_schedule_that_was_removed_since(client: Client) -> None:
    add(client, named("nightly", {}))
    body = {"cron": "0 1 * * *", "time_zone": "Europe/Kyiv", "campaign": "nightly", "unit": "SIM-0001"}
    first = repeated(client, "/api/v1/schedules", body, 201)
    assert repeated(client, "/api/v1/schedules", body, 201) == first
    client.http.delete(f"/api/v1/schedules/{first['id']}").raise_for_status()
    said = repeated(client, "/api/v1/schedules", body, 409)
    assert (said["type"], first["id"] in said["detail"]) == ("/problems/IdempotencyConflict", True)


@pytest.fixture
def calibration(client: Client) -> str:
    job = client.wait(client.submit(parameters=FAST, seed=8)["id"])
    made = client.http.get("/api/v1/units/SIM-0001/calibrations").json()["items"]
    assert job["state"] == "succeeded"
    return made[0]["id"]


def test_evidence_counts_once(client: Client, calibration: str) -> None:
    body = {"method": "run_to_run", "calibrations": [calibration, calibration]}
    answer = client.http.post("/api/v1/analyses", json=body)
    assert answer.status_code == 422, answer.text
    (error,) = answer.json()["errors"]
    assert (error["field"], error["value"]) == ("calibrations.1", calibration)


def test_a_run_that_ended_before_a_step_is_an_error_in_junit_too(client: Client) -> None:
    add(client, named("cut", {}))
    client.http.post("/api/v1/benches/sim/stop").raise_for_status()
    run = start(client, "cut")["id"]
    client.http.post(f"/api/v1/campaign-runs/{run}/cancel").raise_for_status()
    assert ended(client, run)["state"] == "cancelled"
    report = client.http.get(f"/api/v1/campaign-runs/{run}/report", params={"format": "junit"}).text
    assert 'errors="1"' in report
    assert "(run)" in report
    client.http.post("/api/v1/benches/sim/release").raise_for_status()
