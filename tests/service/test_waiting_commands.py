"""Commands that wait say why, without a terminal too; moments are understood as people type them."""

import json
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from bench_service.cli.asking import moments, watching
from bench_service.cli.asking.moments import moment_of
from bench_service.cli.commands import run_command_line
from bench_service.cli.groups.benches import _only_stop
from bench_service.cli.refusal import Refused
from bench_service.settings import Settings
from tests.kit.odd_answers import ENDED, JOB, JOB_ENDED, RESULT, RUN
from tests.service.answering import Answer, answering

STOPPED = "bench sim is stopped: tried the stop"


def said_of(command: tuple[str, ...], answers: list[dict[str, Any]], capsys: pytest.CaptureFixture[str]) -> str:
    """Standard error of a command whose job or run is in one state after the other."""
    left = iter(answers)

    def service(method: str, path: str) -> Answer:
        if path.endswith("/result"):
            found: Any = RESULT
        elif method == "POST":
            found = answers[0]
        elif path.endswith("/report"):
            found = {"run": answers[-1]}
        else:
            found = next(left, answers[-1])
        return 200, "application/json", json.dumps(found)

    with answering(service) as address:
        run_command_line(Settings.model_validate({}), [*command, "--server", address])
    return " ".join(capsys.readouterr().err.split())


def test_a_job_that_waits_says_why_once_for_each_reason(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watching, "STANDS_S", 0.0)
    monkeypatch.setattr(watching, "LOOK_S", 0.001)
    queued = {**JOB, "state": "queued"}
    reasons = ("it is next", STOPPED, STOPPED, "behind job 7, which runs", None)
    err = said_of(("run", "p", "--unit", "U"), [*({**queued, "waiting": r} for r in reasons), JOB_ENDED], capsys)
    assert err.count(f"job j1 waits: {STOPPED}") == 1
    assert err.count("job j1 waits: behind job 7, which runs") == 1
    assert "it is next" not in err


def test_a_reason_that_is_over_at_once_is_not_printed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watching, "LOOK_S", 0.001)
    waiting = {**JOB, "state": "queued", "waiting": "no worker drives bench sim now"}
    assert "waits" not in said_of(("run", "p", "--unit", "U"), [waiting, JOB_ENDED], capsys)


def test_a_campaign_that_waits_says_why(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watching, "STANDS_S", 0.0)
    monkeypatch.setattr(watching, "LOOK_S", 0.001)
    waiting = {**RUN, "waiting": STOPPED}
    err = said_of(("campaign", "run", "good", "--unit", "U"), [waiting, waiting, waiting, ENDED], capsys)
    assert err.count(f"run r1 waits: {STOPPED}") == 1


NOW = datetime(2026, 11, 30, 12, tzinfo=UTC)


@pytest.mark.parametrize(
    ("text", "moment"),
    [
        ("7d", NOW - timedelta(days=7)),
        ("1.5h", NOW - timedelta(minutes=90)),
        ("2w", NOW - timedelta(days=14)),
        ("2026-11-23", datetime(2026, 11, 23, tzinfo=UTC)),
        ("2026-11-23T08:00", datetime(2026, 11, 23, 8, tzinfo=UTC)),
        ("2026-11-23T08:00:00+02:00", datetime(2026, 11, 23, 6, tzinfo=UTC)),
        ("2026-11-23T08:00:00Z", datetime(2026, 11, 23, 8, tzinfo=UTC)),
    ],
)
def test_a_moment_is_a_time_a_date_or_how_long_ago(
    text: str, moment: datetime, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(moments, "now", lambda: NOW)
    found = datetime.fromisoformat(str(moment_of("--since", text)))
    assert (found, found.tzinfo is None) == (moment, False)


@pytest.mark.parametrize("text", ["last-week", "7", "7 days", "99999999999d", "2026-13-01"])
def test_another_text_is_refused_with_what_is_understood(text: str) -> None:
    with pytest.raises(Refused, match=rf"--since {text}: expected .*2026-11-30 \(midnight UTC\), .*7d"):
        moment_of("--since", text)


def test_of_several_stops_each_command_is_printed() -> None:
    stops = [{"id": "s1", "reason": "smoke"}, {"id": "s2", "reason": "a drill"}]
    with pytest.raises(Refused, match=r"`bench release s1 --remark … --by …` \(smoke\); `bench release s2 "):
        _only_stop(stops, "sim")
