"""The log of a service that fails again and again stays short, and says how much was left out."""

import logging
from pathlib import Path

import pytest

from bench_service.cli.processes import logs
from bench_service.settings import Settings
from bench_service.telemetry.log_restraint import BURST, FIRST, STEADY, WINDOW_S, Restraint


class Clock:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.at_s = 0.0

    def __call__(self) -> float:
        return self.at_s


def _record(name: str, text: str, level: int = logging.WARNING, line: int = 1) -> logging.LogRecord:
    return logging.LogRecord(name, level, "/a/file.py", line, text, None, None)


def test_an_equal_warning_is_written_a_few_times_and_then_counted() -> None:
    clock = Clock()
    restraint = Restraint(clock)
    written = [restraint.filter(_record("bench_service.jobs", "the database is away")) for _ in range(120)]
    assert written == [True] * FIRST + [False] * (120 - FIRST)
    clock.at_s = WINDOW_S
    later = _record("bench_service.jobs", "the database is away")
    assert restraint.filter(later)
    assert later.getMessage() == f"the database is away (and {120 - FIRST} more like this in the 60 s before)"


def test_different_warnings_of_our_own_are_all_written_and_a_librarys_count_by_their_place() -> None:
    restraint = Restraint(Clock())
    assert all(restraint.filter(_record("bench_service.jobs", f"job {i} failed")) for i in range(50))
    library = [restraint.filter(_record("dbos", f"Traceback {i}: connection refused")) for i in range(50)]
    assert library.count(True) == FIRST


def test_information_is_written_each_time_until_the_bucket_is_empty() -> None:
    clock = Clock()
    restraint = Restraint(clock)
    flood = [restraint.filter(_record("bench_service.jobs", "ended", logging.INFO)) for _ in range(3000)]
    assert flood.count(True) == BURST
    clock.at_s = 10.0
    after = [_record("bench_service.jobs", "ended", logging.INFO) for _ in range(1000)]
    assert [restraint.filter(record) for record in after].count(True) == 10 * STEADY
    assert after[0].getMessage() == f"ended (after {3000 - BURST:.0f} lines that were too many to be written)"


def test_a_log_file_is_begun_anew_and_only_so_many_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(logs, "FILE_BYTES", 2000)
    before = logging.getLogger().handlers[:]
    file = tmp_path / "logs" / "bench.log"
    try:
        logs.set_up(Settings(log_file=file), "info")
        for number in range(200):
            logging.getLogger("bench_service.test").info("line %d of a long story", number)
    finally:
        logs.set_up(Settings(), "warning")
        logging.getLogger().handlers[:] = before
    kept = sorted(path.name for path in file.parent.iterdir())
    assert kept == ["bench.log", *(f"bench.log.{n}" for n in range(1, 6))]
    assert all(path.stat().st_size <= 2000 for path in file.parent.iterdir())
    assert "line 199" in file.read_text()
