"""``kill -9`` of the real service in the middle of a campaign: it goes on, and no step is done twice."""

from pathlib import Path

import pytest

from bench_service.wall_clock import monotonic_s, pause
from tests.end_to_end.bench_process import BenchProcess

STEPS = [
    {"name": "first", "procedure": "no_operation"},
    {"name": "calibration", "procedure": "calibration_12_orientations", "parameters": {"dwell_s": 20.0}},
    {"name": "last", "procedure": "no_operation"},
]


@pytest.mark.timeout(200)
@pytest.mark.parametrize("backend", ["sqlite", "postgres"])
def test_a_campaign_survives_a_killed_service(
    backend: str, tmp_path: Path, request: pytest.FixtureRequest, free_port: int
) -> None:
    url = f"sqlite:///{tmp_path / 'bench.sqlite'}"
    if backend == "postgres":
        url = request.getfixturevalue("new_postgres_database")()
    service = BenchProcess(url, free_port, tmp_path, real_time_factor="200")
    service.start()
    try:
        service.client.post("/api/v1/campaigns", json={"name": "night", "steps": STEPS}).raise_for_status()
        run_id = service.client.post("/api/v1/campaigns/night/runs", json={"unit": "SIM-0001", "seed": 3}).json()["id"]
        deadline = monotonic_s() + 120
        killed = False
        while (run := service.client.get(f"/api/v1/campaign-runs/{run_id}").json())["state"] in ("queued", "running"):
            assert monotonic_s() < deadline, run
            step = run["steps"][1]
            if not killed and step["job"] and service.job(step["job"])["progress"]["station"] >= 3:
                service.kill()
                service.start()
                killed = True
            pause(0.05)
        assert killed
        assert run["state"] == "succeeded", run
        newest_first = service.client.get("/api/v1/jobs", params={"limit": 100}).json()["items"]
        assert [job["id"] for job in newest_first[::-1]] == [step["job"] for step in run["steps"]]
        assert [step["attempt"] for step in run["steps"]] == [1, 1, 1]
        assert {step["verdict"] for step in run["steps"]} <= {"pass", "fail"}
    finally:
        service.client.close()
        service.terminate()
