"""The wall clock of a working service is set forward or back: jobs end right, and nothing waits for the lost hours."""

import json
from collections.abc import Iterator
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, now, pause
from tests.kit.metrics import scraped
from tests.service.campaigns import add, ended, named, run_of, start
from tests.service.client import Client
from tests.service.jumping_clock import JumpingClock

NO_MOVE = {"seed": 1, "rules": [{"verb": "turntable.move_to", "kind": "fault", "probability": 1.0}]}
JUMPS = [{"hours": 2}, {"hours": -2}, {"days": 1}, {"days": -1}]


@pytest.fixture(scope="module")
def wall() -> Iterator[JumpingClock]:
    """Where a test leaves it the next one finds it: a clock may jump more than once."""
    with pytest.MonkeyPatch.context() as patch:
        yield JumpingClock(patch)


@pytest.fixture(scope="module")
def client(wall: JumpingClock, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """A service on SQLite, at 200 times real time: a calibration lasts a few seconds."""
    url = f"sqlite:///{tmp_path_factory.mktemp('service') / 'bench.sqlite'}"
    with connect(Settings(database_url=url, real_time_factor=200), None, drive=True) as http:
        yield Client(http)


def events(client: Client, job: str) -> list[dict[str, Any]]:
    lines = client.http.get(f"/api/v1/jobs/{job}/events").text.splitlines()
    return [json.loads(line.removeprefix("data: ")) for line in lines if line.startswith("data: ")]


def moment(text: str) -> datetime:
    return datetime.fromisoformat(text)


def in_an_hour() -> str:
    return (now() + timedelta(hours=1)).isoformat()


def until(reached: Any, seconds: float = 30.0) -> None:
    deadline = monotonic_s() + seconds
    while not reached():
        assert monotonic_s() < deadline
        pause(0.03)


def tried_again(job: dict[str, Any], attempts: int) -> bool:
    """Whether it waits to be tried again after so many attempts."""
    return job["attempt"] == attempts + 1 and "tried again" in (job["waiting"] or "")


# Before any test that needs the module's service: a process has one job engine at a time.


@pytest.mark.parametrize("hours", [2, -2])
def test_a_pause_before_a_retry_does_not_become_two_hours(wall: JumpingClock, hours: int, tmp_path: Path) -> None:
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}", device_faults=json.dumps(NO_MOVE))
    with connect(settings, None, drive=True) as http:
        client = Client(http)
        job = client.submit(retries=2)["id"]
        for attempt in (1, 2):
            until(lambda n=attempt: tried_again(client.job(job), n))
            wall.jump(hours=hours)
        done = client.wait(job, "failed", seconds=25.0)  # without a jump the second pause would last 30 s
        assert done["attempt"] == 3


@pytest.mark.parametrize("by", JUMPS, ids=str)
def test_a_running_job_ends_as_if_nothing_had_happened(client: Client, wall: JumpingClock, by: dict[str, int]) -> None:
    counted = ("bench_jobs_finished_total", "calibration_12_orientations", "succeeded", "fail")
    before = scraped(client.http).get(counted, 0)
    job = client.submit(seed=3)["id"]
    behind = client.submit("no_operation")["id"]
    until(lambda: client.job(job)["progress"]["station"] >= 3)
    wall.jump(**by)
    assert client.http.get("/readyz").status_code == 200
    until(lambda: client.http.get("/api/v1/benches/sim").json()["driver_there"], 10)
    after_it = client.submit("no_operation")["id"]
    done = client.wait(job)
    assert (done["state"], done["progress"]["station"]) == ("succeeded", 12), done["error"]
    assert [client.wait(each)["state"] for each in (behind, after_it)] == ["succeeded"] * 2
    told = events(client, job)
    backwards = [e["data"]["clock_set_back_s"] for e in told if "clock_set_back_s" in e["data"]]
    jump_s = timedelta(**by).total_seconds()
    lasted_s = (moment(done["finished_at"]) - moment(done["started_at"])).total_seconds()
    assert lasted_s == pytest.approx(jump_s, abs=60), "the times of a job are what the clock said"
    assert backwards == ([] if jump_s > 0 else [pytest.approx(-jump_s, abs=30)])
    stations = [e["data"]["station"] for e in told if "station" in e["data"]]
    assert stations == list(range(12)), "the order of events is that of their sequence"
    assert scraped(client.http)[counted] == before + 1
    assert client.http.get("/api/v1/benches/sim").json()["safety"]["safe"] is True


def test_reservations_and_deadlines_follow_the_wall_clock(client: Client, wall: JumpingClock) -> None:
    kept = client.http.post("/api/v1/reservations", json={"bench": "sim", "holder": "anna", "until": in_an_hour()})
    assert kept.status_code == 201, kept.text
    waits = client.submit("no_operation")["id"]
    until(lambda: "reserved by anna" in (client.job(waits)["waiting"] or ""))
    wall.jump(hours=-2)
    pause(0.5)
    assert "reserved by anna" in client.job(waits)["waiting"], "it was said until when, and that has not come"
    wall.jump(hours=4)
    assert client.wait(waits)["state"] == "succeeded"
    job = client.submit(deadline_at=in_an_hour())["id"]
    until(lambda: client.job(job)["progress"]["station"] >= 2)
    wall.jump(hours=-2)
    reached = client.job(job)["progress"]["station"]
    until(lambda: client.job(job)["progress"]["station"] > reached)
    wall.jump(hours=4)
    done = client.wait(job)
    assert (done["state"], done["error"]["kind"], done["resumable"]) == ("failed", "DeadlinePassed", True)
    assert client.http.get("/api/v1/benches/sim").json()["safety"]["safe"] is True


def test_a_schedule_starts_once_for_hours_that_were_jumped_over_and_not_again_after_a_jump_back(
    client: Client, wall: JumpingClock
) -> None:
    add(client, named("hourly", {}))
    asked = {"cron": "0 * * * *", "campaign": "hourly", "unit": "SIM-0001", "time_zone": "UTC"}
    made = client.http.post("/api/v1/schedules", json=asked)
    assert made.status_code == 201, made.text
    path = f"/api/v1/schedules/{made.json()['id']}"
    wall.jump(hours=5)
    until(lambda: client.http.get(path).json()["last_run"] is not None)
    first = client.http.get(path).json()
    ended(client, first["last_run"])
    wall.jump(hours=-5)
    pause(2.5)  # longer than the conductor takes to look
    second = client.http.get(path).json()
    assert (second["last_run"], second["next_at"]) == (first["last_run"], first["next_at"])
    assert len(client.http.get("/api/v1/campaign-runs").json()["items"]) == 1
    client.http.delete(path).raise_for_status()


def test_a_campaign_run_goes_on_after_a_jump_back_and_its_report_has_no_negative_time(
    client: Client, wall: JumpingClock
) -> None:
    add(client, named("jumped", {"procedure": "calibration_12_orientations", "parameters": {"dwell_s": 5.0}}, {}))
    run = start(client, "jumped")["id"]
    until(lambda: run_of(client, run)["steps"][0]["job"])
    until(lambda: client.job(run_of(client, run)["steps"][0]["job"])["progress"]["station"] >= 2)
    wall.jump(hours=-2)
    assert [step["state"] for step in ended(client, run)["steps"]] == ["succeeded"] * 2
    report = client.http.get(f"/api/v1/campaign-runs/{run}/report", params={"format": "junit"}).text
    assert 'time="-' not in report
