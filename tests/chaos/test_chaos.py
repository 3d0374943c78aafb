"""A small chaos run on Postgres, and proof that its checkers see what they are there to see."""

import json
import shutil
import sqlite3
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from tests.chaos import books as check
from tests.chaos.books import Books, Row, Twins
from tests.chaos.campaigns import campaigns
from tests.chaos.databases import engine
from tests.chaos.journals import masters
from tests.chaos.load import Asked, Stop, recipes_beside_campaign
from tests.chaos.processes import Death, Ledger
from tests.chaos.storm import storm
from tests.chaos.undisturbed import twins
from tests.chaos.witnesses import DeviceWitness, Seen

pytestmark = pytest.mark.timeout(900)  # half a minute on two idle cores; kills and restarts share them with other tests
KILLS = 6


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the undisturbed run's database stays."""
    return tmp_path_factory.mktemp("undisturbed")


@pytest.fixture(scope="module")
def undisturbed(folder: Path) -> Twins:
    return twins(folder)


def test_every_promise_is_kept_while_processes_are_killed(tmp_path: Path, undisturbed: Twins) -> None:
    """On Postgres, where the database ends too; `make chaos` has both databases and thirty times the kills."""
    finding = storm("postgres", tmp_path / "postgres", KILLS, 3, undisturbed)
    print("", *finding.figures, sep="\n")
    assert not finding.violations, "\n".join(finding.violations)
    assert finding.kills >= KILLS


def asked(rows: Mapping[str, Row]) -> list[Asked]:
    """As clients would have asked for jobs or campaign runs; nobody asks for the jobs of a campaign run."""
    return [
        Asked(f"key {row['labels']['chaos']}", {"labels": {"chaos": row["labels"]["chaos"]}}, "none", [id_])
        for id_, row in rows.items()
        if "campaign_run" not in row["labels"]
    ]


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
    return (
        check.acknowledged(books, asked(before.jobs), ())
        + campaigns(books, asked(before.runs), ())
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
    "a job was made twice": ('UPDATE jobs SET labels = \'{"chaos": "0"}\'', "there are 8 of it"),
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
TAMPERED_RUNS = {
    "a campaign run is lost": ("UPDATE campaign_runs SET id = 'x' || id", "is lost"),
    "a job of a campaign run that is not there": ("UPDATE campaign_runs SET id = 'x' || id", "which is not there"),
    "a campaign run is stuck": ("UPDATE campaign_runs SET state = 'running'", "it is running at the end"),
    "a campaign run was cancelled": ("UPDATE campaign_runs SET state = 'cancelled'", "cancelled, and nobody asked"),
    "a campaign run was made twice, and both ran at once": (
        "INSERT INTO campaign_runs SELECT 'y' || id, campaign, unit, bench, state, verdict, created_at, finished_at, "
        "schedule_id, document FROM campaign_runs",
        "of bench sim overlapped",
    ),
    "a step's job was done twice": (
        "UPDATE jobs SET labels = replace(labels, '\"nothing\"', '\"verification\"')",
        "step verification: 1 attempts, it lists jobs",
    ),
    "a step was done with another seed": (
        "UPDATE jobs SET seed = 1 WHERE labels LIKE '%\"verification\"%'",
        "seeds [1] instead of [3]",
    ),
    "a step began too soon": (
        "UPDATE jobs SET finished_at = '2100-01-01 00:00:00.000000' WHERE labels LIKE '%\"calibration\"%'",
        "began before the one before it had ended",
    ),
    "a step's verdict is not its job's": (
        "UPDATE jobs SET verdict = 'pass' WHERE labels LIKE '%\"calibration\"%'",
        "its job says pass",
    ),
    "a step's verdict is not its method's": (
        "UPDATE results SET verdict = 'fail' WHERE job_id IS NULL",
        "step magnitude: verdict pass, its result says ['fail']",
    ),
    "a campaign run's verdict is not its steps'": (
        "UPDATE campaign_runs SET verdict = 'pass'",
        "verdict pass (its document: fail), by its steps fail",
    ),
    "a method ran twice": (
        "INSERT INTO results SELECT 'y' || id, kind, name, version, parameters, document, verdict, code_version, "
        "simulated, created_at, unit, job_id, seed, context FROM results WHERE job_id IS NULL",
        "are of no campaign run",
    ),
}


@pytest.fixture(scope="module")
def books(folder: Path, undisturbed: Twins) -> Books:
    """Books of the undisturbed run."""
    return Books(engine(f"sqlite:///{folder / 'undisturbed.sqlite'}"))


def test_nothing_is_found_where_nothing_is_wrong(books: Books, undisturbed: Twins) -> None:
    assert len(books.jobs) == len(undisturbed) == len(recipes_beside_campaign()) + 3 == 8
    assert len(books.runs) == 1
    assert everything(books, undisturbed, books) == []


def tampered(folder: Path, to: Path, statement: str) -> Books:
    """The undisturbed run's books, copied, after a statement that changes something."""
    copy = shutil.copy(folder / "undisturbed.sqlite", to / "copy.sqlite")
    with sqlite3.connect(copy) as connection:
        connection.execute("DROP INDEX uq_recordings_complete_station")
        assert connection.execute(statement).rowcount > 0
    connection.close()
    return Books(engine(f"sqlite:///{copy}"))


@pytest.mark.parametrize("what", TAMPERED)
def test_what_is_wrong_in_the_books_is_found(
    what: str, folder: Path, tmp_path: Path, undisturbed: Twins, books: Books
) -> None:
    statement, words = TAMPERED[what]
    found = everything(tampered(folder, tmp_path, statement), undisturbed, books)
    assert any(words in violation for violation in found), found


@pytest.mark.parametrize("what", TAMPERED_RUNS)
def test_what_is_wrong_with_campaign_runs_is_found(what: str, folder: Path, tmp_path: Path, books: Books) -> None:
    statement, words = TAMPERED_RUNS[what]
    found = campaigns(tampered(folder, tmp_path, statement), asked(books.runs), ())
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


def test_who_calls_a_bench_safe_that_cannot_be_reached_is_found(tmp_path: Path) -> None:
    witness = DeviceWitness(tmp_path, ("sim",), 3.0)
    said = {"table": "at rest", "powered": False, "chamber_target_c": None, "chamber_ambient_c": 22.0}
    said |= {"current_ma": 0.0, "fault": "", "by": "a worker", "at": "2031-05-06T07:08:10+00:00"}
    assert witness.false_safety("sim", said) == []
    for until, wrong in (("07:08:12", 1), ("07:08:09", 0), ("07:08:14", 0)):
        text = json.dumps({"until": f"2031-05-06T{until}+00:00", "why": ""})
        (tmp_path / "bench-sim.chamber.lost").write_text(text)
        assert len(witness.false_safety("sim", said)) == wrong, until
    assert witness.false_safety("sim", {**said, "at": "2031-05-06T07:08:13+00:00", "powered": True}) == []


def test_a_job_may_end_for_a_stop_of_its_own_bench_and_only_then() -> None:
    row = {
        "state": "cancelled",
        "failure": None,
        "procedure": "p",
        "bench": "east",
        "finished_at": "2031-05-06 07:08:09",
    }
    end = check.moment(row["finished_at"])
    for bench, at, until, found in (
        ("east", "2031-05-06T07:08:00+00:00", end + 3.0, ""),
        ("west", "2031-05-06T07:08:00+00:00", end + 3.0, "p was cancelled, and nobody asked"),
        ("east", "2031-05-06T07:08:10+00:00", end + 3.0, "p was cancelled, and nobody asked"),
        ("east", "2031-05-06T07:00:00+00:00", end - 100.0, "p was cancelled, and nobody asked"),
    ):
        assert check.bad_end(row, False, [Stop(bench, f"{at}: why", until)]) == found
