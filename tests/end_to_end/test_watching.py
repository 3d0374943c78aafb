"""A command that watches, while the real service is killed and started again: it ends with the verdict all the same."""

import json
import subprocess
import sys
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest
from junitparser import JUnitXml

from bench_service.wall_clock import pause
from tests.end_to_end.bench_process import BenchProcess
from tests.kit.command_line import Done, environment

pytestmark = pytest.mark.timeout(200)

DWELL = {"dwell_s": 20.0}
STEPS = [
    {"name": "calibration", "procedure": "calibration_12_orientations", "parameters": DWELL},
    {"name": "last", "procedure": "no_operation"},
]


@pytest.fixture
def service(tmp_path: Path, free_port: int) -> Generator[BenchProcess]:
    served = BenchProcess(f"sqlite:///{tmp_path / 'bench.sqlite'}", free_port, tmp_path, real_time_factor="200")
    served.start()
    yield served
    served.end()


def watched_through_a_kill(service: BenchProcess, folder: Path, *arguments: str) -> Done:
    """The command's end; the service is killed in the calibration's fourth orientation, and away for a second."""
    command = [sys.executable, "-m", "bench_service", *arguments, "--server", str(service.client.base_url)]
    with subprocess.Popen(
        command, env=environment(folder), cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as watching:
        service.until(lambda: any(job["progress"]["station"] >= 3 for job in jobs(service)), 60)
        service.kill()
        pause(1.0)
        assert watching.poll() is None, watching.communicate()[1]
        service.start()
        out, err = watching.communicate(timeout=120)
        return Done(watching.returncode, out, err)


def jobs(service: BenchProcess) -> list[dict[str, Any]]:
    return service.client.get("/api/v1/jobs").json()["items"]


def waited_once(done: Done) -> bool:
    told = [line for line in done.err.splitlines() if "answer" in line]
    assert len(told) == 2, done.err
    return "does not answer" in told[0] and "waiting since " in told[0] and told[1] == "the service answers again"


def test_a_campaign_is_watched_through_a_kill_of_the_service_to_its_verdict_and_report(
    service: BenchProcess, tmp_path: Path
) -> None:
    service.client.post("/api/v1/campaigns", json={"name": "night", "steps": STEPS}).raise_for_status()
    (tmp_path / "cut.xml").write_text("of yesterday")
    asked = ("campaign", "run", "night", "--unit", "SIM-0001", "--seed", "3", "--junit", "cut.xml", "--json")
    done = watched_through_a_kill(service, tmp_path, *asked)
    run = done.json()["run"]
    assert run["state"] == "succeeded", run
    assert done.code == {"pass": 0, "fail": 1}[run["verdict"]]
    assert waited_once(done)
    report = JUnitXml.fromfile(str(tmp_path / "cut.xml"))
    assert (bool(report.failures), report.errors) == (run["verdict"] == "fail", 0)
    assert [step["attempt"] for step in run["steps"]] == [1, 1]


def test_a_job_is_watched_through_a_kill_of_the_service_to_its_verdict(service: BenchProcess, tmp_path: Path) -> None:
    asked = ("run", "calibration_12_orientations", "--unit", "SIM-0001", "--seed", "3", "--json")
    done = watched_through_a_kill(service, tmp_path, *asked, "--set", f"dwell_s={json.dumps(DWELL['dwell_s'])}")
    job = done.json()["job"]
    assert job["state"] == "succeeded", job
    assert done.code == {"pass": 0, "fail": 1}[job["verdict"]]
    assert waited_once(done)
    assert [one["id"] for one in jobs(service)] == [job["id"]]
