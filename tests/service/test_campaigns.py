"""Campaigns through HTTP on both databases: started, watched, cancelled, waiting for a stopped bench."""

from typing import Any

import pytest

from bench_service.wall_clock import pause
from tests.service.campaigns import add, ended, named, run_of, start, until
from tests.service.client import Client

LONG = {"procedure": "calibration_12_orientations", "parameters": {"dwell_s": 3600.0}}


@pytest.fixture(scope="module")
def plain(client: Client) -> str:
    """A campaign of two steps that do nothing."""
    return add(client, named("plain", {}, {}))["name"]


def test_a_run_from_queue_to_verdict(client: Client, plain: str) -> None:
    run = ended(client, start(client, plain, labels={"build": "17"}, seed=40)["id"])
    assert (run["state"], run["verdict"], run["reason"]) == ("succeeded", "pass", "")
    assert [(s["state"], s["verdict"], s["seed"]) for s in run["steps"]] == [
        ("succeeded", "pass", 40),
        ("succeeded", "pass", 41),
    ]
    job = client.job(run["steps"][1]["job"])
    assert job["labels"] == {"build": "17", "campaign": plain, "campaign_run": run["id"], "step": "b"}
    assert job["seed"] == 41


def test_the_same_key_gives_the_same_run(client: Client, plain: str) -> None:
    body = {"unit": "SIM-0001", "labels": {"night": "1"}}
    address, headers = f"/api/v1/campaigns/{plain}/runs", {"Idempotency-Key": "night-1"}
    first, second = (client.http.post(address, json=body, headers=headers) for _ in range(2))
    assert (first.status_code, second.status_code) == (202, 202)
    assert first.json()["id"] == second.json()["id"]
    other = client.http.post(address, json={**body, "seed": 3}, headers=headers)
    assert (other.status_code, other.json()["type"]) == (409, "/problems/IdempotencyConflict")


def test_lists_are_paged_and_filtered(client: Client, plain: str) -> None:
    made = [start(client, plain)["id"] for _ in range(3)]
    for run_id in made:
        ended(client, run_id)
    query: dict[str, Any] = {"campaign": plain, "unit": "SIM-0001", "state": "succeeded", "limit": 2}
    first = client.http.get("/api/v1/campaign-runs", params=query).json()
    assert [run["id"] for run in first["items"]] == made[:0:-1]
    second = client.http.get("/api/v1/campaign-runs", params={**query, "after": first["next"]}).json()
    assert second["items"][0]["id"] == made[0]
    assert client.http.get("/api/v1/campaign-runs", params={"campaign": "none"}).json()["items"] == []
    names = [c["name"] for c in client.http.get("/api/v1/campaigns").json()["items"]]
    assert names == sorted(names)
    assert {plain, "thesis_acceptance"} <= set(names)


def test_a_change_leaves_old_runs_as_they_were(client: Client) -> None:
    add(client, named("changing", {}))
    run_id = start(client, "changing")["id"]
    changed = client.http.put("/api/v1/campaigns/changing", json=named("changing", {}, {}, title="two"))
    assert changed.status_code == 200, changed.text
    assert len(ended(client, run_id)["steps"]) == 1
    assert client.http.get("/api/v1/campaigns/changing").json()["campaign"]["title"] == "two"


def test_a_cancelled_run_ends_once_its_bench_is_safe(client: Client) -> None:
    add(client, named("long", LONG, {}))
    run = until(client, start(client, "long")["id"], lambda r: r["steps"][0]["state"] == "running")
    answer = client.http.post(f"/api/v1/campaign-runs/{run['id']}/cancel")
    assert (answer.status_code, answer.json()["cancel_requested"]) == (202, True)
    run = ended(client, run["id"])
    assert (run["state"], run["verdict"]) == ("cancelled", None)
    assert [s["state"] for s in run["steps"]] == ["cancelled", "skipped"]
    assert client.job(run["steps"][0]["job"])["state"] == "cancelled"
    again = client.http.post(f"/api/v1/campaign-runs/{run['id']}/cancel")
    assert (again.status_code, again.json()["type"]) == (409, "/problems/IllegalTransition")


def test_a_run_waits_for_a_stopped_bench_and_says_so(client: Client, plain: str) -> None:
    client.http.post("/api/v1/benches/sim/stop", json={"reason": "smoke"}).raise_for_status()
    run_id = start(client, plain)["id"]
    run = until(client, run_id, lambda r: r["waiting"])
    assert "smoke" in run["waiting"]
    pause(0.5)
    assert run_of(client, run_id)["steps"][0]["job"] is None
    assert "smoke" in client.http.get(f"/campaign-runs/{run_id}").text
    client.http.post("/api/v1/benches/sim/release").raise_for_status()
    assert ended(client, run_id)["verdict"] == "pass"


def test_a_schedule_is_kept_by_the_service(client: Client, plain: str) -> None:
    body = {"cron": "* * * * *", "time_zone": "Europe/Kyiv", "campaign": plain, "unit": "SIM-0001"}
    made = client.http.post("/api/v1/schedules", json=body)
    assert made.status_code == 201, made.text
    address = made.headers["Location"]
    assert client.http.get(address).json() == made.json()
    off = client.http.patch(address, json={"enabled": False}).json()
    assert (off["enabled"], off["next_at"]) == (False, None)
    assert client.http.patch(address, json={"enabled": True}).json()["next_at"] is not None
    assert [s["id"] for s in client.http.get("/api/v1/schedules").json()["items"]] == [made.json()["id"]]
    assert "* * * * *" in client.http.get("/campaigns").text
    assert client.http.delete(address).status_code == 204
    assert client.http.get(address).status_code == 404


def test_a_schedule_of_one_moment_needs_its_zone_and_is_shown_with_its_date(client: Client, plain: str) -> None:
    body = {"campaign": plain, "unit": "SIM-0001"}
    refused = client.http.post("/api/v1/schedules", json={**body, "at": "2071-01-01T22:30:00"})
    assert (refused.status_code, "at" in refused.text, "timezone" in refused.text) == (422, True, True)
    refused = client.http.post(
        "/api/v1/schedules", json={**body, "cron": "0 1 * * *", "time_zone": "UTC", "once": True}
    )
    assert refused.status_code == 422
    made = client.http.post("/api/v1/schedules", json={**body, "at": "2071-01-01T22:30:00+02:00"})
    assert made.status_code == 201, made.text
    view = made.json()
    assert view["at"] == view["next_at"] == "2071-01-01T20:30:00Z"
    assert view["cron"] is None
    assert "2071-01-01T20:30" in client.http.get("/campaigns").text
    assert client.http.delete(made.headers["Location"]).status_code == 204
