"""``bench campaign`` and ``bench schedule`` against one served process: what they print, and their exit codes.

The commands run in this process, but for the one that is killed; `test_command_line.py` has them as processes.
"""

import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from junitparser import JUnitXml

from tests.end_to_end.bench_process import BenchProcess
from tests.kit.command_line import Command, Done, command_here, environment, one_line

pytestmark = pytest.mark.timeout(120)

SHORT = {"dwell_s": 5.0, "settle_s": 0.5}
OUT_OF_REACH = {"quantity": "gyro.b_x", "unit": "deg/h", "minimum": 1e4, "source": "a test"}
CAMPAIGNS: dict[str, dict[str, Any]] = {
    "good": {"title": "Nothing [much]", "steps": [{"name": "a", "procedure": "no_operation"}]},
    "bad": {
        "steps": [
            {
                "name": "calibration",
                "procedure": "calibration_12_orientations",
                "parameters": SHORT,
                "limits": [OUT_OF_REACH],
            },
            {"name": "after", "procedure": "no_operation"},
        ]
    },
    "hollow": {"steps": [{"name": "spin", "procedure": "centrifuge", "optional": True}]},
    "long": {
        "steps": [
            {"name": "calibration", "procedure": "calibration_12_orientations", "parameters": {"dwell_s": 100.0}},
            {"name": "after", "procedure": "no_operation"},
        ]
    },
}


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[BenchProcess]:
    """At 200 times real time, where everything but a long recording is over at once."""
    folder = tmp_path_factory.mktemp("served")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    served = BenchProcess(f"sqlite:///{folder / 'bench.sqlite'}", port, folder, real_time_factor="200")
    served.start()
    yield served
    served.end()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the commands work, with a file of each campaign."""
    made = tmp_path_factory.mktemp("commands")
    for name, document in CAMPAIGNS.items():
        (made / f"{name}.json").write_text(json.dumps({"name": name, **document}))
    return made


@pytest.fixture(scope="module")
def bench(service: BenchProcess, folder: Path) -> Command:
    """``bench`` as a client of the service, in this process."""
    run = command_here(folder)
    return lambda *arguments: run(*arguments, "--server", str(service.client.base_url))


@pytest.fixture(scope="module")
def added(bench: Command) -> dict[str, Done]:
    """Every campaign, stored by its file."""
    return {name: bench("campaign", "add", f"{name}.json") for name in CAMPAIGNS}


def test_campaigns_are_added_listed_and_shown(bench: Command, added: dict[str, Done]) -> None:
    assert {name: done.code for name, done in added.items()} == dict.fromkeys(CAMPAIGNS, 0)
    assert "campaign good, 0.0 h of bench time" in added["good"].out
    assert "there is no procedure centrifuge yet" in added["hollow"].out, "what may not work is warned of"
    listed = bench("campaign", "list", "--json").json()
    assert {"acceptance", "calibrate_verify", "thesis_acceptance", *CAMPAIGNS} == {item["name"] for item in listed}
    table = bench("campaign", "list")
    assert (table.code, table.err) == (0, "")
    assert "Nothing [much]" in table.out
    shown = bench("campaign", "show", "bad")
    assert shown.json()["steps"][0]["limits"][0] == {**OUT_OF_REACH, "maximum": None, "rule": None}
    changed = {**shown.json(), "name": "bad-again"}
    assert changed["name"] != "bad", "what is shown is fit to be added under another name"


@pytest.mark.parametrize(
    ("campaign", "code", "verdict", "counts"),
    [("good", 0, "pass", (0, 0, 0)), ("bad", 1, "fail", None), ("hollow", 2, "error", (0, 1, 1))],
)
@pytest.mark.usefixtures("added")
def test_the_exit_code_of_a_run_is_its_verdict_and_the_report_is_for_a_ci_system(
    bench: Command, folder: Path, campaign: str, code: int, verdict: str, counts: tuple[int, int, int] | None
) -> None:
    file = folder / f"{campaign}.xml"
    done = bench("campaign", "run", campaign, "--unit", "SIM-0001", "--junit", file, "--label", "build=17", "--seed", 4)
    assert done.code == code, done.out + done.err
    run_id = done.out.split("run ")[-1].split()[0]
    assert f"verdict {verdict}, run {run_id}" in done.out
    report = JUnitXml.fromfile(str(file))
    found = (report.failures, report.errors, report.skipped)
    assert found == counts if counts is not None else found[0] > 0 == found[1]
    assert not list(folder.glob("*.part"))
    runs = bench("campaign", "runs", "--campaign", campaign, "--json").json()
    assert [(run["id"], run["verdict"], run["labels"]) for run in runs] == [(run_id, verdict, {"build": "17"})]
    if verdict == "fail":
        assert "gyro.b_x, campaign's limit" in done.out
    assert run_id in bench("campaign", "runs").out


@pytest.mark.usefixtures("added")
def test_parameters_of_steps_are_set_and_the_report_is_printed_as_json(bench: Command, service: BenchProcess) -> None:
    more = ("--set", "calibration.dwell_s=6.0", "--json")
    done = bench("campaign", "run", "bad", "--unit", "SIM-0001", "--seed", 4, *more)
    assert done.code == 1, done.err
    calibration, after = done.json()["run"]["steps"]
    assert (calibration["verdict"], after["verdict"]) == ("fail", "pass")
    assert service.job(calibration["job"])["parameters"]["dwell_s"] == 6.0
    assert done.json()["campaign"]["steps"][0]["parameters"] == {**SHORT, "dwell_s": 6.0}


@pytest.mark.usefixtures("added")
def test_a_command_that_was_killed_is_repeated_with_its_key_and_goes_on_with_the_same_run(
    bench: Command, service: BenchProcess, folder: Path
) -> None:
    asked = ("campaign", "run", "long", "--unit", "SIM-0001", "--key", "night-7", "--json")
    command = [sys.executable, "-m", "bench_service", *asked, "--server", str(service.client.base_url)]
    with subprocess.Popen(command, env=environment(folder), cwd=folder, stdout=-3, stderr=-3) as first:
        service.until(lambda: any(run["state"] == "running" for run in runs_of(service, "long")), 60)
        first.kill()
    (begun,) = runs_of(service, "long")
    assert begun["state"] == "running", "it does not need the command"
    again = bench(*asked)
    assert again.code in (0, 1), again.err
    (ended,) = runs_of(service, "long")
    assert (ended["id"], ended["state"]) == (begun["id"], "succeeded")
    assert bench(*asked).code == again.code, "and once more, when it has long ended"
    assert len(runs_of(service, "long")) == 1
    one_line(bench(*asked, "--seed", 3), "night-7")


def runs_of(service: BenchProcess, campaign: str) -> list[dict[str, Any]]:
    return service.client.get("/api/v1/campaign-runs", params={"campaign": campaign}).json()["items"]


UNIT = ("--unit", "SIM-0001")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("campaign", "run", "no-such", *UNIT), ("there is no campaign 'no-such'",)),
        (("campaign", "run", "good", "--unit", "NOBODY"), ("NOBODY",)),
        (("campaign", "run", "good", *UNIT, "--bench", "moon"), ("moon",)),
        (("campaign", "run", "good", *UNIT, "--seed", "-1"), ("seed", "-1")),
        (("campaign", "run", "bad", *UNIT, "--set", "dwell_s=5"), ("--set dwell_s=5", "step.name=value")),
        (("campaign", "run", "bad", *UNIT, "--set", "calibration.dwell_s"), ("name=value",)),
        (("campaign", "run", "bad", *UNIT, "--set", "calibration.dwell_s=-5"), ("dwell_s",)),
        (("campaign", "run", "good", *UNIT, "--set", "z.x=1"), ("parameters.z",)),
        (("campaign", "run", "good", *UNIT, "--label", "build"), ("--label build", "name=text")),
        (("campaign", "run", "good", *UNIT, "--junit", "nowhere/run.xml"), ("nowhere/run.xml", "no folder")),
        (("campaign", "run", "good", *UNIT, "--key", "x" * 1000), ("Idempotency-Key",)),
        (("campaign", "run", "good", *UNIT, "--key", "Nächte"), ("--key",)),
        (("campaign", "run", "Big? Name", *UNIT), ("name = 'Big? Name'",)),
        (("campaign", "show", "no-such"), ("there is no campaign 'no-such'",)),
        (("campaign", "add", "good.json"), ("good",)),
        (("campaign", "add", "broken.json"), ("JSON",)),
        (("campaign", "add", "list.json"), ("body",)),
        (("campaign", "add", "impossible.json"), ("steps.0.procedure", "no_such")),
        (("campaign", "runs", "--limit", "0"), ("limit",)),
        (("schedule", "add", "good", *UNIT, "--cron", "0 0 30 2 *", "--time-zone", "UTC"), ("cron",)),
        (("schedule", "add", "good", *UNIT, "--cron", "0 1 * * *", "--time-zone", "Mars"), ("time_zone",)),
        (
            ("schedule", "add", "good", *UNIT, "--cron", "0 1 * * *", "--time-zone", "UTC", "--missed", "panic"),
            ("missed", "run_once"),
        ),
        (("schedule", "add", "none", *UNIT, "--cron", "0 1 * * *", "--time-zone", "UTC"), ("none",)),
        (("schedule", "remove", "no-such"), ("no-such",)),
    ],
    ids=lambda value: " ".join(value)[:60] if isinstance(value, tuple) else None,
)
@pytest.mark.usefixtures("added")
def test_a_refusal_is_one_line(
    bench: Command, folder: Path, arguments: tuple[str, ...], words: tuple[str, ...]
) -> None:
    (folder / "broken.json").write_text("{")
    (folder / "list.json").write_text("[]")
    impossible = {"name": "impossible", "steps": [{"name": "a", "procedure": "no_such"}]}
    (folder / "impossible.json").write_text(json.dumps(impossible))
    one_line(bench(*arguments), *words)


def test_a_server_that_is_not_there_is_one_line(folder: Path, free_port: int) -> None:
    away = ("--server", f"http://127.0.0.1:{free_port}")
    export = ("export", "x", "-o", "x.csv")
    for arguments in (("campaign", "list"), ("campaign", "run", "good", *UNIT), ("schedule", "remove", "x"), export):
        one_line(command_here(folder)(*arguments, *away), "does not answer", str(free_port))
    one_line(command_here(folder)("campaign", "list", "--server", "http://x:y"), "--server http://x:y")


@pytest.mark.usefixtures("added")
def test_a_report_that_cannot_be_written_is_said_with_the_run(bench: Command, folder: Path) -> None:
    if os.geteuid() == 0:
        place = "/proc/run.xml"  # nobody writes there
    else:
        (folder / "closed").mkdir(mode=0o500, exist_ok=True)
        place = "closed/run.xml"
    done = bench("campaign", "run", "good", *UNIT, "--junit", place)
    assert done.code == 2
    assert f"{place} cannot be written" in done.err
    assert "the run is " in done.err


@pytest.mark.usefixtures("added")
def test_schedules_are_added_listed_and_removed(bench: Command) -> None:
    when = ("--cron", "0 1 * * 1-5", "--time-zone", "Europe/Kyiv", "--overlap", "queue", "--start-within-s", 60)
    made = bench("schedule", "add", "good", *UNIT, *when)
    assert made.code == 0, made.err
    schedule_id = made.out.split()[1].rstrip(",")
    (listed,) = bench("schedule", "list", "--json").json()
    wanted = {"id": schedule_id, "campaign": "good", "overlap": "queue", "missed": "run_once", "start_within_s": 60.0}
    assert wanted.items() <= listed.items()
    assert f"next start {listed['next_at']}" in made.out
    table = bench("schedule", "list")
    assert (table.code, schedule_id in table.out, "0 1 * * 1-5" in table.out) == (0, True, True)
    assert bench("schedule", "remove", schedule_id).code == 0
    assert bench("schedule", "list", "--json").json() == []
    one_line(bench("schedule", "remove", schedule_id), schedule_id)
