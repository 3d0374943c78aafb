"""Requests of a test to the service about campaigns."""

from typing import Any

from bench_service.wall_clock import monotonic_s, pause
from tests.service.client import Client

SHORT = {"dwell_s": 2.0, "settle_s": 0.5}
WIDE = {"gyro_bias_in_run_deg_h": 1.0, "accelerometer_bias_in_run_m_s2": 0.01}
DWELL = {"dwell_s": 10.0, "settle_s": 0.5, "limits": WIDE}
"""The shortest dwell whose temperatures can be read beside it, with limits that its noise does not reach."""
SCALED_DOWN: dict[str, dict[str, Any]] = {
    "static": {
        "launches": 1,
        "duration_s": 600.0,
        "off_time_s": 10.0,
        "wavelet_levels": 4,
        "noise_limits": {"gyro_random_walk_deg_sqrt_h": 0.03, **WIDE},
    },
    "thermal": {"sample_rate_hz": 1.0},
    **{f"{name}_{number}": DWELL for name in ("calibration", "verification") for number in (1, 2, 3)},
}
"""The thesis's campaign in minutes of bench time: its course is tested with it, not the numbers."""
OPEN = ("queued", "running", "paused")


def named(name: str, *steps: dict[str, Any], **more: Any) -> dict[str, Any]:
    """A campaign of steps called a, b, c … that do nothing, unless they say otherwise."""
    document = [{"name": "abcdefgh"[k], "procedure": "no_operation", **step} for k, step in enumerate(steps)]
    return {"name": name, "steps": document, **more}


def add(client: Client, campaign: dict[str, Any]) -> dict[str, Any]:
    answer = client.http.post("/api/v1/campaigns", json=campaign)
    assert answer.status_code == 201, answer.text
    return answer.json()


def start(client: Client, campaign: str, **body: Any) -> dict[str, Any]:
    answer = client.http.post(f"/api/v1/campaigns/{campaign}/runs", json={"unit": "SIM-0001", **body})
    assert answer.status_code == 202, answer.text
    assert answer.headers["Location"] == f"/api/v1/campaign-runs/{answer.json()['id']}"
    return answer.json()


def run_of(client: Client, run_id: str) -> dict[str, Any]:
    return client.http.get(f"/api/v1/campaign-runs/{run_id}").json()


def until(client: Client, run_id: str, wanted: Any, seconds: float = 60.0) -> dict[str, Any]:
    """Wait until the run is as wanted: a predicate of its view."""
    deadline, look_s = monotonic_s() + seconds, 0.02
    while not wanted(run := run_of(client, run_id)):
        assert monotonic_s() < deadline, run
        pause(look_s)
        look_s = min(1.1 * look_s, 0.25)  # a look takes the service's time, which the steps share
    return run


def ended(client: Client, run_id: str, seconds: float = 60.0) -> dict[str, Any]:
    return until(client, run_id, lambda run: run["state"] not in OPEN, seconds)
