"""Refusals of campaigns, runs, schedules and trends: each names the field, the value and what is allowed."""

import json
from pathlib import Path
from typing import Any

import pytest

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from tests.kit.registered import register_bench
from tests.service.campaigns import SHORT, add, ended, named, start
from tests.service.client import Client

CALIBRATION = {"procedure": "calibration_12_orientations"}
METHOD = {"procedure": None, "method": "run_to_run"}
NO_SUCH_LIMIT = {"limits": [{"quantity": "noise", "unit": "1", "maximum": 1.0, "source": "a test"}]}
SCHEDULE = {"cron": "0 1 * * *", "time_zone": "Europe/Kyiv", "campaign": "thesis_acceptance", "unit": "SIM-0001"}


def limits(**limit: Any) -> dict[str, Any]:
    return {**CALIBRATION, "limits": [{"quantity": "gyro condition number", "unit": "1", "source": "a test", **limit}]}


CONTRADICTORY = [
    {"quantity": "gyro.b_x", "unit": "deg/h", "minimum": 5.0, "source": "a test"},
    {"quantity": "gyro.b_x", "unit": "rad/s", "maximum": 1e-6, "source": "a test"},
]
OF_ANOTHER_KIND = [{"quantity": "gyro.b_x", "unit": "kg", "maximum": 1.0, "source": "a test"}]
BEHIND_A: dict[str, Any] = {"gates": [{"step": "a"}]}
FAIL_OF_A = {"step": "a", "verdict": "fail"}
NEVER_JUDGED = [{"quantity": "gyro.b_x", "at_least": 50, "last": 5}]


@pytest.mark.parametrize(
    ("campaign", "field", "said"),
    [
        (named("x", limits(minimum=2.0, maximum=1.0)), "steps.0.limits.0", "nothing can pass"),
        (named("x", limits()), "steps.0.limits.0", "needs a minimum"),
        (named("x", limits(maximum=float("1e999"))), "steps.0.limits.0.maximum", "finite"),
        (named("x", limits(quantity="gyro.b_w", maximum=1.0)), "steps.0.limits.0.quantity", "gyro.b_x"),
        (named("x", NO_SUCH_LIMIT), "steps.0.limits.0.quantity", "it has none"),
        (named("x", {**CALIBRATION, "trends": [{"quantity": "nothing"}]}), "steps.0.trends.0.quantity", "gyro.b_x"),
        (named("x", {"procedure": "no_such"}), "steps.0.procedure", "one of calibration_12_orientations"),
        (named("x", {**METHOD, "calibrations_of": []}), "steps.0", "calibrations_of"),
        (named("x", {}, {**METHOD, "method": "no_such", "calibrations_of": ["a"]}), "steps.1.method", "run_to_run"),
        (named("x", {}, {**METHOD, "calibrations_of": ["z"]}), "steps.1.calibrations_of.0", "earlier step"),
        (named("x", CALIBRATION, {**METHOD, "calibrations_of": ["a", "a"]}), "steps.1.calibrations_of.1", "once"),
        (named("x", {}, {**METHOD, "calibrations_of": ["a"]}), "steps.1.calibrations_of.0", "calibrates"),
        (named("x", {**CALIBRATION, "limits": CONTRADICTORY}), "steps.0.limits.1", "what passes ≥ 5 deg/h too"),
        (named("x", {**CALIBRATION, "limits": OF_ANOTHER_KIND}), "steps.0.limits.0.unit", "kg"),
        (named("x", {**CALIBRATION, "trends": NEVER_JUDGED}), "steps.0.trends.0.at_least", "at most 5"),
        (named("x", {"method": "run_to_run"}), "steps.0", "either a procedure or a method"),
        (named("x", {**CALIBRATION, "parameters": {"dwell": 5}}), "steps.0.parameters.dwell", "Extra inputs"),
        (named("x", {**CALIBRATION, "parameters": {"dwell_s": -5}}), "steps.0.parameters.dwell_s", "equal to 1"),
        (named("x", {**CALIBRATION, "parameters": {"orientations": [[0, 0]]}}), "steps.0.parameters", "rank"),
        (named("x", {}, {"name": "a"}), "steps.1.name", "a name of its own"),
        (named("x", {"procedure": "static_run"}, window_h=20.0), "window_h", "at least 28"),
        (named("x", limits(maximum=1.0, source="")), "steps.0.limits.0.source", "the origin of the limit"),
        (named("x", {}, {"gates": [{"step": "z"}]}), "steps.1.gates.0.step", "earlier step"),
        (named("x", {}, {"gates": [{"step": "b"}]}), "steps.1.gates.0.step", "earlier step"),
        (named("x", {}, {"gates": [{"step": "a"}, {"step": "a", "verdict": "fail"}]}), "steps.1.gates.1", "no run"),
        (named("x", {}, BEHIND_A, {"gates": [{"step": "b"}, FAIL_OF_A]}), "steps.2.gates.1", "a to pass and to fail"),
        (named("x", {"on_fail": "stop"}, {"gates": [FAIL_OF_A]}), "steps.1.gates.0", "which ends the run"),
        (named("x", {"retries": -1}), "steps.0.retries", "greater than or equal to 0"),
        (named("x", {"on_fail": "explode"}), "steps.0.on_fail", "'stop' or 'continue'"),
        (named("x", {}, seeds={"rule": "vary", "base": 3}), "seeds", "rule repeat"),
        (named("x"), "steps", "at least 1 item"),
        (named("Big Name", {}), "name", "pattern"),
        (named("x", {}, surprise=1), "surprise", "Extra inputs"),
        (named("x", CALIBRATION, decision={"false_alarm": 0.001}), "decision.false_alarm", "a level of 0.0005 each"),
    ],
)  # fmt: skip
def test_a_campaign_that_cannot_be(sqlite_client: Client, campaign: dict[str, Any], field: str, said: str) -> None:
    content = json.dumps(campaign)
    answer = sqlite_client.http.post("/api/v1/campaigns", content=content, headers={"Content-Type": "application/json"})
    assert answer.status_code == 422, answer.text
    (error,) = answer.json()["errors"][:1]
    assert error["field"] == field
    assert said in error["message"]
    assert sqlite_client.http.get(f"/api/v1/campaigns/{campaign['name'].lower().replace(' ', '-')}").status_code == 404


def test_a_limit_that_the_plan_cannot_resolve_is_a_warning(sqlite_client: Client) -> None:
    narrow = {"quantity": "gyro.b_x", "unit": "deg/h", "minimum": -1e-6, "maximum": 1e-6, "source": "a test"}
    made = add(sqlite_client, named("narrow", {**CALIBRATION, "parameters": SHORT, "limits": [narrow]}))
    assert any("gyro.b_x cannot be resolved: ±1e-06 deg/h" in warning for warning in made["warnings"])
    wide = {**narrow, "minimum": -1e3, "maximum": 1e3}
    made = add(sqlite_client, named("wide", {**CALIBRATION, "parameters": SHORT, "limits": [wide]}))
    assert not any("gyro.b_x cannot" in warning for warning in made["warnings"])


def test_names_are_taken_once(sqlite_client: Client) -> None:
    add(sqlite_client, named("once", {}))
    for name in ("once", "thesis_acceptance"):
        answer = sqlite_client.http.post("/api/v1/campaigns", json=named(name, {}))
        assert (answer.status_code, answer.json()["type"]) == (409, "/problems/NameTaken")
    assert (
        sqlite_client.http.put("/api/v1/campaigns/thesis_acceptance", json=named("thesis_acceptance", {})).status_code
        == 409
    )
    assert sqlite_client.http.put("/api/v1/campaigns/never", json=named("never", {})).status_code == 404
    other = sqlite_client.http.put("/api/v1/campaigns/once", json=named("twice", {}))
    assert other.json()["errors"][0]["field"] == "name"


@pytest.mark.parametrize(
    ("body", "status", "field"),
    [
        ({"unit": "NOBODY"}, 422, None),
        ({"unit": "SIM-0001", "bench": "moon"}, 404, None),
        ({"unit": "SIM-0001", "seed": -1}, 422, "seed"),
        ({"unit": "SIM-0001", "parameters": {"nothing": {}}}, 422, "parameters.nothing"),
        ({"unit": "SIM-0001", "parameters": {"static": {"launches": 0}}}, 422, "parameters.static.launches"),
        ({}, 422, "unit"),
    ],
)
def test_a_run_that_cannot_begin(sqlite_client: Client, body: dict[str, Any], status: int, field: str | None) -> None:
    before = sqlite_client.http.get("/api/v1/campaign-runs").json()["items"]
    answer = sqlite_client.http.post("/api/v1/campaigns/thesis_acceptance/runs", json=body)
    assert answer.status_code == status, answer.text
    assert [e["field"] for e in answer.json()["errors"]] == ([field] if field else [])
    assert sqlite_client.http.get("/api/v1/campaign-runs").json()["items"] == before


def test_a_verification_without_a_calibration_is_refused_before_anything_moves(sqlite_client: Client) -> None:
    made = add(sqlite_client, named("blind", {"procedure": "verification_9_orientations"}))
    assert any("is not there yet" in warning for warning in made["warnings"])
    answer = sqlite_client.http.post("/api/v1/campaigns/blind/runs", json={"unit": "RANDOM-4"})
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "steps.0")
    assert "calibrate it first" in answer.json()["detail"]


def test_a_campaign_of_nothing_but_left_out_steps_judges_nothing(sqlite_client: Client) -> None:
    made = add(sqlite_client, named("hollow", {"procedure": "centrifuge", "optional": True}))
    assert any("there is no procedure centrifuge yet" in warning for warning in made["warnings"])
    run = ended(sqlite_client, start(sqlite_client, "hollow")["id"])
    assert (run["state"], run["verdict"]) == ("failed", "error")
    assert "nothing was judged" in run["reason"]


@pytest.mark.parametrize(
    ("changes", "status", "field"),
    [
        ({"cron": "0 0 30 2 *"}, 422, "cron"),
        ({"cron": "every night"}, 422, "cron"),
        ({"time_zone": "Mars/Olympus"}, 422, "time_zone"),
        ({"missed": "panic"}, 422, "missed"),
        ({"start_within_s": 0}, 422, "start_within_s"),
        ({"campaign": "nothing"}, 404, None),
        ({"unit": "NOBODY"}, 422, None),
    ],
)
def test_a_schedule_that_cannot_be(
    sqlite_client: Client, changes: dict[str, Any], status: int, field: str | None
) -> None:
    answer = sqlite_client.http.post("/api/v1/schedules", json={**SCHEDULE, **changes})
    assert answer.status_code == status, answer.text
    assert [e["field"] for e in answer.json()["errors"]] == ([field] if field else [])
    assert sqlite_client.http.get("/api/v1/schedules").json()["items"] == []


@pytest.mark.parametrize(
    ("query", "status"),
    [
        ({"quantity": "gyro.b_x"}, 422),
        ({"quantity": "gyro.b_x", "procedure": "centrifuge"}, 404),
        ({"quantity": "x", "procedure": "no_operation", "limit": 1}, 422),
    ],
)
def test_a_trend_that_cannot_be(sqlite_client: Client, query: dict[str, Any], status: int) -> None:
    assert sqlite_client.http.get("/api/v1/units/SIM-0001/trend", params=query).status_code == status
    assert (
        sqlite_client.http.get("/api/v1/units/NOBODY/trend", params={"quantity": "x", "procedure": "y"}).status_code
        == 404
    )


def test_where_benches_have_other_names_than_this_process_expects_a_campaign_is_examined_on_one_of_them(
    tmp_path: Path,
) -> None:
    """An HTTP process without a bench of its own; a run must still name its bench."""
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}")
    for bench in ("east", "west"):
        register_bench(settings.model_copy(update={"bench_id": bench}))
    with connect(settings, None, drive=False) as http:
        add(Client(http), named("somewhere", {}))
        refused = http.post("/api/v1/campaigns/somewhere/runs", json={"unit": "SIM-0001"})
        assert refused.status_code == 404, refused.text
        assert "there is no bench 'sim': there is east, west" in refused.json()["detail"]
        assert http.post("/api/v1/campaigns/somewhere/preview", json={"unit": "SIM-0001", "bench": "west"}).is_success
