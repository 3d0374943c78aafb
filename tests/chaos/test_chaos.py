"""A small chaos run on each database, and proof that its checkers see what they are there to see."""

import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.chaos import books as check
from tests.chaos.books import Books, Twins
from tests.chaos.databases import engine
from tests.chaos.journals import masters
from tests.chaos.load import Asked
from tests.chaos.processes import Death, Ledger
from tests.chaos.storm import storm
from tests.chaos.undisturbed import twins
from tests.chaos.witnesses import Seen

pytestmark = pytest.mark.timeout(900)  # a minute on two idle cores; kills and restarts share them with other tests
KILLS = 10


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the undisturbed run's database stays."""
    return tmp_path_factory.mktemp("undisturbed")


@pytest.fixture(scope="module")
def undisturbed(folder: Path) -> Twins:
    return twins(folder)


@pytest.mark.parametrize("kind", ["sqlite", "postgres"])
def test_every_promise_is_kept_while_processes_are_killed(kind: str, tmp_path: Path, undisturbed: Twins) -> None:
    finding = storm(kind, tmp_path / kind, KILLS, 3, undisturbed)
    print(f"\n{kind}", *finding.figures, sep="\n")
    assert not finding.violations, "\n".join(finding.violations)
    assert finding.kills >= KILLS


def everything(books: Books, expected: Twins, before: Books) -> list[str]:
    """All that is checked of stored rows; `before` is what was once seen."""
    seen = Seen(
        {row["id"]: row["content_hash"] for row in before.recordings},
        {(row["id"], c["number"]): c["sha256"] for row in before.recordings for c in before.chunks(row["id"])},
        {
            (job, event["sequence"]): event["data"]["hash"]
            for job, events in before.events.items()
            for event in events
            if event["kind"] == "station"
        },
    )
    jobs = [
        Asked(f"key {label}", {"labels": {"chaos": label}}, "none", [job])
        for job, label in ((job, row["labels"]["chaos"]) for job, row in before.jobs.items())
    ]
    return (
        check.acknowledged(books, jobs, stopped=False)
        + check.histories(books)
        + check.results(books)
        + check.stations(books, expected)
        + check.samples(books)
        + check.lost(books, seen)
    )


TAMPERED = {
    "a job is lost": ("UPDATE jobs SET id = 'x' || id WHERE procedure = 'no_operation'", "is lost"),
    "a job ended without being asked": ("UPDATE jobs SET state = 'cancelled'", "cancelled, and nobody asked"),
    "a job is stuck": ("UPDATE jobs SET state = 'running'", "nothing is left that runs it"),
    "a job was made twice": ('UPDATE jobs SET labels = \'{"chaos": "0"}\'', "there are 5 jobs of it"),
    "an event is missing": ("DELETE FROM events WHERE sequence = 2", "sequences [1, 3"),
    "a job ran after its end": (
        'UPDATE events SET data = replace(data, \'"before": "queued"\', \'"before": "succeeded"\')',
        "queued became",
    ),
    "two results of a job": (
        "UPDATE results SET job_id = (SELECT max(job_id) FROM results)",
        "of which",
    ),
    "a station is missing": ("UPDATE recordings SET state = 'interrupted' WHERE station_index = 7", "without stations"),
    "a recording is open": ("UPDATE recordings SET state = 'open' WHERE station_index = 7", "never closed"),
    "a recording is of other samples": (
        "UPDATE recordings SET content_hash = 'f' || substr(content_hash, 2) WHERE station_index = 0",
        "differ from the twin's",
    ),
    "a chunk is lost": ("DELETE FROM chunks WHERE number = 1", "was there, and is lost"),
    "chunks have a gap": ("UPDATE chunks SET number = 9 WHERE number = 1", "chunks [0, 2, 3, 4, 9] of 5"),
    "a payload is damaged": ("UPDATE chunks SET payload = substr(payload, 2)", "is not what was written"),
    "counts do not add up": ("UPDATE recordings SET samples = samples + 1", "are claimed"),
    "a result's lineage is wrong": ("UPDATE result_recordings SET content_hash = 'x'", "not what it was"),
}


@pytest.fixture(scope="module")
def books(folder: Path, undisturbed: Twins) -> Books:
    """Of the undisturbed run."""
    return Books(engine(f"sqlite:///{folder / 'undisturbed.sqlite'}"))


def test_nothing_is_found_where_nothing_is_wrong(books: Books, undisturbed: Twins) -> None:
    assert len(books.jobs) == len(undisturbed) == 5
    assert everything(books, undisturbed, books) == []


@pytest.mark.parametrize("what", TAMPERED)
def test_what_is_wrong_in_the_books_is_found(
    what: str, folder: Path, tmp_path: Path, undisturbed: Twins, books: Books
) -> None:
    statement, words = TAMPERED[what]
    copy = shutil.copy(folder / "undisturbed.sqlite", tmp_path / "copy.sqlite")
    with sqlite3.connect(copy) as connection:
        connection.execute("DROP INDEX uq_recordings_complete_station")
        assert connection.execute(statement).rowcount > 0
    connection.close()
    found = everything(Books(engine(f"sqlite:///{copy}")), undisturbed, books)
    assert any(words in violation for violation in found), found


def line(second: int, pid: int, verb: str) -> dict[str, object]:
    return {"at": f"1970-01-01T00:00:{second:02d}+00:00", "pid": pid, "verb": verb}


WRONG_MASTERS: dict[str, Callable[[], list[dict[str, object]]]] = {
    "lived": lambda: [line(1, 7, "link.opened"), line(2, 8, "link.opened")],
    "while process 7 had the link": lambda: [line(1, 7, "link.opened"), line(2, 8, "turntable.move_to")],
    "while process None had the link": lambda: [line(1, 7, "link.opened"), line(2, 7, "link.closed"), line(3, 7, "x")],
    "which was gone": lambda: [line(1, 9, "link.opened"), line(20, 9, "turntable.move_to")],
}


@pytest.mark.parametrize("words", WRONG_MASTERS)
def test_two_masters_of_one_bench_are_found(words: str) -> None:
    ledger = Ledger(deaths=[Death("worker", 9, 10.0, 11.0, "SIGKILL")])
    found = masters("sim", WRONG_MASTERS[words](), ledger)
    assert len(found) == 1
    assert words in found[0]


def test_a_master_that_died_or_left_may_be_followed() -> None:
    ledger = Ledger(deaths=[Death("worker", 9, 10.0, 11.0, "SIGKILL")])
    entries = [line(1, 9, "link.opened"), line(12, 8, "link.refused"), line(13, 8, "link.opened")]
    assert masters("sim", [*entries, line(14, 8, "link.closed"), line(15, 7, "link.opened")], ledger) == []
