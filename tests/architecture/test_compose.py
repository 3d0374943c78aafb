"""The topology in `docker-compose.yml`, against the real command line and settings: there is no Docker in a test.

The same processes, without containers, are run and killed by `tests.chaos`.
"""

from pathlib import Path
from typing import Any

import pytest
import typer
import yaml

from bench_service.api.http.door import may_listen
from bench_service.bench.stop.messages import split_address
from bench_service.bench.worker_time_limits import ENDING_S
from bench_service.cli.commands import app, run_command_line
from bench_service.settings import Settings

FILE = Path(__file__).resolve().parents[2] / "docker-compose.yml"
SERVICES: dict[str, dict[str, Any]] = yaml.safe_load(FILE.read_text())["services"]
OURS = {name: service for name, service in SERVICES.items() if name != "database"}


def parsed(command: list[str]) -> tuple[str, dict[str, Any]]:
    """Name and options of a command, as the command line itself reads them. Raises a usage error."""
    assert command[0] == "bench"
    group: Any = typer.main.get_command(app)
    context = group.make_context("bench", list(command[1:]), resilient_parsing=True)
    name, found, rest = group.resolve_command(context, command[1:])
    assert name is not None
    assert found is not None
    return name, found.make_context(name, rest, parent=context).params


def of_bench(command: str) -> dict[str, dict[str, Any]]:
    """The services that run a command, by their bench."""
    found: dict[str, dict[str, Any]] = {}
    for service in OURS.values():
        name, options = parsed(service["command"])
        if name == command:
            assert options["bench"] not in found, "a bench has one"
            found[options["bench"]] = service
    return found


@pytest.mark.parametrize("name", OURS)
def test_commands_and_settings_are_those_that_there_are(name: str) -> None:
    service = OURS[name]
    assert parsed(service["command"])[0] in ("serve", "worker", "supervise")
    assert set(service["environment"]) <= set(Settings.variables())
    assert service["restart"] == "unless-stopped"
    assert service["depends_on"]["database"]["condition"] == "service_healthy"


@pytest.mark.parametrize("wrong", [["work"], ["worker", "--name", "east"], ["worker", "--bench"]])
def test_a_command_that_there_is_not_would_be_found(wrong: list[str]) -> None:
    assert run_command_line(Settings(), wrong) == 2


def test_two_benches_have_a_worker_each_and_a_supervisor_that_outlives_it() -> None:
    workers, supervisors = of_bench("worker"), of_bench("supervise")
    assert set(workers) == set(supervisors) == {"east", "west"}
    names = {id(service): name for name, service in SERVICES.items()}
    for bench, worker in workers.items():
        supervisor = supervisors[bench]
        Settings.from_environ({"BENCH_ID": bench})
        assert worker["pid"] == f"service:{names[id(supervisor)]}", "else nobody sees whether the other lives"
        assert worker["hostname"] == supervisor["hostname"]
        assert worker["volumes"] == supervisor["volumes"], "the devices' registers"
        assert worker["volumes"] == [f"{bench}:{worker['environment']['BENCH_DEVICE_FOLDER']}"]
        assert int(worker["stop_grace_period"].removesuffix("s")) > ENDING_S


def test_the_api_drives_nothing_and_listens_on_this_host_only() -> None:
    api = OURS["api"]
    assert parsed(api["command"])[1]["no_worker"] is True
    assert all(port.startswith("127.0.0.1:") for port in api["ports"])
    settings = Settings.from_environ({name: str(value) for name, value in api["environment"].items()})
    assert may_listen(settings), "else the service does not start"
    assert settings.published == "loopback", "which is true as long as the line above is"
    assert all("ports" not in service for name, service in OURS.items() if name != "api")
    assert "/readyz" in api["healthcheck"]["test"][-1]
    compile(api["healthcheck"]["test"][-1], "healthcheck", "exec")


def test_a_stop_reaches_each_bench_without_the_database() -> None:
    secret = OURS["api"]["environment"]["BENCH_STOP_SECRET_FILE"]
    whole = yaml.safe_load(FILE.read_text())
    assert all(service["secrets"] == ["stop"] for service in OURS.values())
    assert secret == "/run/secrets/stop"
    assert "file" in whole["secrets"]["stop"]
    names = {id(service): name for name, service in SERVICES.items()}
    for supervisor in of_bench("supervise").values():
        settings = Settings.from_environ({name: str(value) for name, value in supervisor["environment"].items()})
        host, port = split_address(settings.stop_listen)
        assert host == names[id(supervisor)], "the name by which the API's container finds it"
        assert port > 0
        assert str(settings.stop_secret_in()) == secret
