"""Lines of the log: whatever is in a message, it is one line and commands no terminal."""

import io
import json
import logging
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from bench_service.cli.processes import logs
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause
from tests.kit.logged_service import process
from tests.service.campaigns import add, named, start

FORGED = (
    "smoke\r\n2031-05-06T07:08:09.123Z INFO    bench_service.jobs: ended as succeeded \x1b[2J\x07\x9b31m\u2028x\u202ey"
)


def line_of(formatter: logging.Formatter, error: Exception | None = None) -> str:
    record = logging.makeLogRecord({"name": "n", "levelname": "WARNING", "msg": "waits: %s", "args": (FORGED,)})
    record.subjects = {"job": FORGED}
    if error is not None:
        try:
            raise error
        except Exception:
            record.exc_info = sys.exc_info()
    return formatter.format(record)


@pytest.mark.parametrize("make", [logs.Lines, logs._json_lines], ids=["text", "json"])
def test_a_message_is_one_line_without_control_characters(make: Callable[[], logging.Formatter]) -> None:
    line = line_of(make())
    assert line.isprintable(), [c for c in line if not c.isprintable()]
    assert len(line.splitlines()) == 1


def test_text_shows_what_was_there_and_json_keeps_it() -> None:
    assert r"waits: smoke\r\n2031-05-06T07:08:09.123Z INFO" in line_of(logs.Lines())
    assert r"\x1b[2J\x07\x9b31m\u2028x\u202ey" in line_of(logs.Lines())
    assert json.loads(line_of(logs._json_lines()))["message"] == f"waits: {FORGED}"


def test_of_a_traceback_no_line_looks_like_a_line_of_the_log() -> None:
    first, *rest = line_of(logs.Lines(), ValueError(FORGED)).split("\n")
    assert "waits" in first
    assert len(rest) >= 4
    assert all(line.startswith("    | ") and line.isprintable() for line in rest)
    assert "ValueError: smoke" in "".join(rest)


def test_a_traceback_in_a_message_of_the_http_server_is_shown_line_by_line() -> None:
    record = logging.makeLogRecord(
        {"name": "uvicorn.error", "levelname": "ERROR", "msg": "Traceback:\n  at x\x1b\nE: y"}
    )
    first, *rest = logs.Lines().format(record).split("\n")
    assert first.endswith("uvicorn.error: Traceback:")
    assert rest == ["    |   at x\\x1b", "    | E: y"]


def test_everything_else_is_written_as_it_is() -> None:
    stream = io.StringIO()
    handler = logging.StreamHandler(stream)
    handler.setFormatter(logs.Lines())
    record = logging.makeLogRecord({"name": "n", "levelname": "INFO", "msg": "вимірювання 5 °C ± 0.1 \\n 日本 → x"})
    handler.handle(record)
    assert stream.getvalue().endswith("n: вимірювання 5 °C ± 0.1 \\n 日本 → x\n")


def test_a_reason_with_a_line_break_forges_no_line(tmp_path: Path, free_port: int) -> None:
    """As it was seen: a campaign that waits for a stopped bench says why, in the words of who stopped it."""
    assert Settings().log == "text"
    with process(tmp_path, free_port) as (client, file):
        client.http.post("/api/v1/benches/sim/stop", json={"reason": FORGED}).raise_for_status()
        add(client, named("night", {"parameters": {}}))
        start(client, "night")
        deadline = monotonic_s() + 30
        while "waits: bench sim" not in file.read_text(encoding="utf-8"):
            assert monotonic_s() < deadline
            pause(0.05)
    text = file.read_bytes().decode()
    assert r"smoke\r\n2031" in text
    lines = text.rstrip("\n").split("\n")
    assert not [line for line in lines if line.startswith("2031")]
    assert not [line for line in lines if not line.isprintable()]
