"""A command that watches waits for a service that is away, for a while; then it says how to look again."""

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from bench_service.cli.asking import retries
from bench_service.cli.asking.retries import with_retries
from bench_service.cli.commands import run_command_line
from bench_service.cli.refusal import Away, Refused
from bench_service.settings import Settings
from tests.kit.odd_answers import ENDED, JOB, JOB_ENDED, RESULT, RUN
from tests.service.answering import Answer, answering

JSON = "application/json"
PROXY = (502, "text/html", "<h1>Bad Gateway</h1>")
CAMPAIGN = ("campaign", "run", "good", "--unit", "U")
JUNIT = "<testsuites/>"


@pytest.fixture(autouse=True)
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(retries, "AWAY_S", 0.4)
    monkeypatch.setattr(retries, "AGAIN_S", 0.1)


def away_from(look: int, looks: int) -> Callable[[str, str], Answer]:
    """A service that is away for so many looks, from this one on."""
    seen = {"looks": 0}

    def say(method: str, path: str) -> Answer:
        if method == "POST":
            return 202, JSON, json.dumps(JOB if path == "/api/v1/jobs" else RUN)
        seen["looks"] += 1
        if look <= seen["looks"] < look + looks:
            return PROXY
        if path.endswith("format=junit"):
            return 200, "application/xml", JUNIT
        if path.endswith("/result"):
            return 200, JSON, json.dumps(RESULT)
        if path.endswith("/report"):
            return 200, JSON, json.dumps({"run": ENDED})
        ended = seen["looks"] > 1
        if "/jobs/" in path:
            return 200, JSON, json.dumps(JOB_ENDED if ended else JOB)
        return 200, JSON, json.dumps(ENDED if ended else RUN)

    return say


def run(address: str, *arguments: str) -> int:
    return run_command_line(Settings.model_validate({}), [*arguments, "--server", address])


@pytest.mark.parametrize("look", [2, 3, 4], ids=["watching", "report", "junit"])
def test_two_bad_answers_are_waited_through_and_told_once(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, look: int
) -> None:
    file = tmp_path / "run.xml"
    with answering(away_from(look, 2)) as address:
        assert run(address, *CAMPAIGN, "--junit", str(file)) == 1
    err = capsys.readouterr().err
    assert (err.count("502 Bad Gateway"), err.count("waiting since"), err.count("answers again")) == (1, 1, 1), err
    assert file.read_text() == JUNIT


def test_a_service_that_stays_away_is_given_up_with_the_way_back_and_no_old_report_is_left(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "run.xml"
    file.write_text("of yesterday")
    with answering(away_from(1, 10**9)) as address:
        assert run(address, *CAMPAIGN, "--junit", str(file), "--key", "night 7") == 2
        told = capsys.readouterr().err
        assert run(address, *CAMPAIGN) == 2
        keyless = capsys.readouterr().err
        assert run(address, "run", "no_operation", "--unit", "U") == 2
        job = capsys.readouterr().err.splitlines()[-1]
    assert told.count("502 Bad Gateway") == 2, "once on the display, once at the end"
    last = told.splitlines()[-1]
    assert "waited for 0 s. The service has run r1 and continues it: the same command with --key 'night 7'" in last
    assert not list(tmp_path.iterdir())
    key = keyless.split("--key ")[1].split()[0]
    assert len(key) == 36, "a command without a key of the user's has one of its own"
    assert "The service has job j1 and continues it" in job
    assert f"{address}/jobs/j1" in job


def test_the_key_that_is_named_is_the_one_that_was_sent(capsys: pytest.CaptureFixture[str]) -> None:
    asked: list[str] = []
    with answering(away_from(1, 10**9), lambda headers: asked.append(headers.get("Idempotency-Key", ""))) as address:
        assert run(address, *CAMPAIGN) == 2
    assert f"--key {asked[0]} " in capsys.readouterr().err


def test_every_absence_has_the_whole_patience_and_other_refusals_have_none() -> None:
    said: list[str] = []
    answers: list[Exception | str] = [Away("away"), Away("away"), "here"]

    def ask() -> str:
        found = answers.pop(0)
        if isinstance(found, Exception):
            raise found
        return found

    assert with_retries(ask, said.append, "on") == "here"
    assert [line.partition(";")[0] for line in said] == ["away", "the service answers again"]
    answers[:] = [Refused("no"), "here"]
    with pytest.raises(Refused, match="no"):
        with_retries(ask, said.append, "on")
    assert answers == ["here"]


@pytest.mark.parametrize("given", [("--set", "nothing"), ("--label", "x"), ("--key", "Nächte")])
def test_a_command_that_is_refused_at_once_leaves_no_old_report_either(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, given: tuple[str, str]
) -> None:
    file = tmp_path / "run.xml"
    file.write_text("of yesterday")
    assert run("http://127.0.0.1:9", *CAMPAIGN, "--junit", str(file), *given) == 2
    assert capsys.readouterr().err.startswith(f"bench: {given[0]}")
    assert not file.exists()


def test_an_old_report_that_cannot_be_removed_is_said_before_anything_is_asked(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for file, why in (("/proc/version", "an old /proc/version cannot be removed"), (str(pipe), "not an ordinary file")):
        with answering(lambda method, path: pytest.fail("asked")) as address:
            assert run(address, *CAMPAIGN, "--junit", file) == 2
        assert why in capsys.readouterr().err
    assert pipe.exists()
