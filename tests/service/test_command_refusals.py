"""Exit code 1 is a verdict on a unit: whatever else goes wrong in a command is 2 and one sentence."""

import json
from pathlib import Path

import pytest

from bench_service.cli.commands import run_command_line
from bench_service.cli.groups import jobs
from bench_service.settings import Settings
from tests.service.answering import Answer, answering

LOGIN = (200, "text/html; charset=utf-8", "<!doctype html>\n<title>Please log in</title>" + "x" * 1000)
RUN = ("run", "no_operation", "--unit", "SIM-0001")
CAMPAIGN_RUN = ("campaign", "run", "good", "--unit", "SIM-0001")
JSON = "application/json"


def refused(capsys: pytest.CaptureFixture[str], *arguments: object, **settings: object) -> str:
    """The one line that a command says when it fails."""
    assert run_command_line(Settings.model_validate(settings), [str(one) for one in arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "Traceback" not in err
    (line,) = err.splitlines()
    assert line.startswith("bench: ")
    return line


READERS = [
    ("jobs",),
    RUN,
    CAMPAIGN_RUN,
    ("campaign", "list"),
    ("schedule", "list"),
    ("analyse", "noise_analysis"),
]
TAKERS = [("schedule", "remove", "x"), ("export", "x", "-o", "x.csv")]
"""Commands that read nothing of a good answer."""


@pytest.mark.parametrize(
    ("arguments", "answer"),
    [(one, LOGIN) for one in READERS + TAKERS]
    + [(one, (200, JSON, text)) for one in READERS for text in ("{}", "[]", "null", "{")],
    ids=lambda value: " ".join(map(str, value))[:40],
)
def test_what_is_no_bench_service_is_named_with_its_answer(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    answer: Answer,
) -> None:
    monkeypatch.chdir(tmp_path)
    with answering(lambda method, path: answer) as address:
        line = refused(capsys, *arguments, "--server", address)
    assert f"{address}/api/v1/" in line
    assert f"is not a bench service: it answered 200 OK: {answer[2][:15]}" in line
    assert len(line) < 400
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ((404, JSON, '["not", "here"]'), ("/api/v1/jobs", "404 Not Found", '["not", "here"]')),
        ((502, JSON, '"no one"'), ("502 Bad Gateway", '"no one"')),
        ((502, "text/html", "<h1>Bad\nGateway</h1>"), ("502 Bad Gateway: <h1>Bad Gateway</h1>",)),
        ((302, "text/html", ""), ("302 Found: nothing",)),
        ((422, JSON, '{"errors": [{"field": "unit", "message": "is needed"}]}'), ("bench: unit: is needed",)),
        ((422, JSON, '{"errors": [{"field": "a", "message": "no", "value": 3}]}'), ("bench: a = 3: no",)),
        ((422, JSON, '{"errors": ["so"], "detail": "no such thing"}'), ("bench: no such thing",)),
        ((422, JSON, '{"errors": {}, "detail": [{"loc": ["body"]}]}'), ("422 Unprocessable", '"loc"')),
        ((500, JSON, "[" * 100_000), ("500 Internal Server Error: [[[",)),
    ],
)
def test_a_refusal_of_any_form_is_told(
    capsys: pytest.CaptureFixture[str], answer: Answer, words: tuple[str, ...]
) -> None:
    with answering(lambda method, path: answer) as address:
        line = refused(capsys, "jobs", "--server", address)
    assert all(word in line for word in words), line


@pytest.mark.parametrize("host", ["ex..ample", "a" * 64 + ".org"])
def test_an_address_that_no_resolver_takes_is_named(capsys: pytest.CaptureFixture[str], host: str) -> None:
    line = refused(capsys, "jobs", "--server", f"http://{host}")
    assert f"--server http://{host}: {host!r} is not a host name" in line


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("dwell_s=1e999", "--set dwell_s: 1e999 is not a finite number"),
        ("a=NaN", "--set a: NaN is not a finite number"),
        ("a=[1, -Infinity]", "--set a: -Infinity is not a finite number"),
        ("a=" + "9" * 5000, "--set a: "),
        ("a=\udcff", "cannot be sent"),
    ],
    ids=lambda text: ascii(text[:20]),
)
def test_a_parameter_that_cannot_be_sent_is_named(capsys: pytest.CaptureFixture[str], given: str, words: str) -> None:
    assert words in refused(capsys, *RUN, "--set", given, "--server", "http://127.0.0.1:9")


def test_an_option_that_cannot_be_sent_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    when = ("--cron", "0 1 * * *", "--time-zone", "UTC", "--start-within-s", "nan")
    line = refused(capsys, "schedule", "add", "good", "--unit", "U", *when, "--server", "http://127.0.0.1:9")
    assert "cannot be sent" in line
    assert "float" in line


def test_a_file_without_a_folder_and_a_description_that_is_no_text_are_named(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    away = ("--server", "http://127.0.0.1:9")
    place = tmp_path / "nodir" / "x.csv"
    assert f"{place} cannot be written: there is no folder" in refused(capsys, "export", "x", "-o", place, *away)
    description = tmp_path / "bad.json"
    description.write_bytes(b'{"unit": "\xff"}')
    line = refused(capsys, "import", description, "--description", description, *away)
    assert f"{description} is not UTF-8 text: invalid start byte at byte 10" in line


def test_an_export_that_cannot_be_written_leaves_nothing(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "x.csv.part").mkdir()
    with answering(lambda method, path: (200, "text/csv", "time_s\n")) as address:
        line = refused(capsys, "export", "x", "-o", tmp_path / "x.csv", "--server", address)
    assert f"{tmp_path / 'x.csv'} cannot be written: Is a directory" in line
    assert not (tmp_path / "x.csv").exists()


def test_what_nobody_foresaw_is_one_sentence_and_its_place_is_in_the_log_of_who_wants_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_arguments: object, **_options: object) -> None:
        raise LookupError("a thing\nof two lines")

    monkeypatch.setattr(jobs, "connect", broken)
    assert "unforeseen LookupError: a thing of two lines" in refused(capsys, "jobs")
    assert run_command_line(Settings.model_validate({"log_level": "debug"}), ["jobs"]) == 2
    assert "in broken" in capsys.readouterr().err


def test_an_item_that_is_not_as_expected_is_no_verdict(capsys: pytest.CaptureFixture[str]) -> None:
    with answering(lambda method, path: (200, JSON, json.dumps({"items": [{}], "next": None}))) as address:
        assert "unforeseen KeyError" in refused(capsys, "jobs", "--server", address)


@pytest.mark.parametrize(("code", "mine"), [(1, 2), (3, 2), (0, 0), (None, 0)])
def test_a_library_that_ends_the_process_gives_no_verdict(
    monkeypatch: pytest.MonkeyPatch, code: int | None, mine: int
) -> None:
    def ends(*_arguments: object, **_options: object) -> None:
        raise SystemExit(code)

    monkeypatch.setattr(jobs, "connect", ends)
    assert run_command_line(Settings.model_validate({}), ["jobs"]) == mine
