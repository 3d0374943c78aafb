"""Commands print a service's texts: as they are, for brackets and colons are no markup, and all of them."""

import json
from typing import Any

import pytest

from bench_service.cli.commands import run_command_line
from bench_service.cli.options import console, errors
from bench_service.settings import Settings
from tests.kit.odd_answers import BELOW, CAMPAIGN, ENDED, EVIL, JOB, JOB_ENDED, RESULT, RUN, SCHEDULE, TOO_FEW
from tests.service.answering import Answer, answering


def service(method: str, path: str) -> Answer:
    known: dict[str, Any] = {
        "GET /api/v1/jobs": {"items": [JOB]},
        "POST /api/v1/jobs": JOB,
        "GET /api/v1/jobs/j1": JOB_ENDED,
        "GET /api/v1/jobs/j1/result": RESULT,
        "POST /api/v1/analyses": RESULT,
        "GET /api/v1/campaigns": {"items": [CAMPAIGN], "next": None},
        "POST /api/v1/campaigns/good/runs": RUN,
        "GET /api/v1/campaign-runs": {"items": [RUN, ENDED]},
        "GET /api/v1/campaign-runs/r1": ENDED,
        "GET /api/v1/campaign-runs/r1/report": {"run": ENDED},
        "GET /api/v1/schedules": {"items": [SCHEDULE], "next": None},
    }
    return 200, "application/json", json.dumps(known[f"{method} {path.partition('?')[0]}"])


@pytest.fixture(autouse=True)
def _a_wide_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the width was when the consoles were made: then rich asks its environment."""
    for each in (console, errors):
        monkeypatch.setattr(each, "_width", 400)


@pytest.mark.parametrize(
    ("arguments", "code", "shown", "beside_the_bar"),
    [
        (("jobs",), 0, 2, 0),
        (("run", "no_operation", "--unit", "U"), 1, 3, 2),
        (("analyse", "noise_analysis"), 1, 3, 0),
        (("campaign", "list"), 0, 3, 0),
        (("campaign", "runs"), 0, 6, 0),
        (("schedule", "list"), 0, 4, 0),
        (("campaign", "run", "good", "--unit", "U"), 1, 8, 3),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else None,
)
def test_texts_with_brackets_are_shown_as_they_are(
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    code: int,
    shown: int,
    beside_the_bar: int,
) -> None:
    with answering(service) as address:
        done = run_command_line(Settings.model_validate({}), [*arguments, "--server", address])
    out, err = capsys.readouterr()
    assert done == code, err
    assert (out.count(EVIL), err.count(EVIL)) == (shown, beside_the_bar)


def test_every_warning_of_a_step_is_in_the_table_of_a_run(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with answering(service) as address:
        assert (
            run_command_line(
                Settings.model_validate({}), ["campaign", "run", "good", "--unit", "U", "--server", address]
            )
            == 1
        )
    out = capsys.readouterr().out
    told = [line for line in out.splitlines() if BELOW in line or TOO_FEW in line or f"missed: {EVIL}" in line]
    assert len(told) == 3, out
