"""Raw data over the years: what a rule removes and keeps, the archive read back and by DuckDB, and crashes between."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import duckdb
import numpy as np
import pytest
import sqlalchemy as sa

from bench_service.campaigns.stores import Stores
from bench_service.evidence.batches.service import BatchService
from bench_service.evidence.catalogue import Catalogue
from bench_service.evidence.raw_data.service import RawDataService, StorageSettings
from bench_service.evidence.upkeep import UpkeepService
from bench_service.formats.content_hash import ContentHash
from bench_service.model.batches import BatchRequest, Selection
from bench_service.model.calibrations import Decider
from bench_service.model.errors import ArchiveAway, DamagedRecording, IllegalTransition, RawDataRemoved
from bench_service.model.job import Job, JobState
from bench_service.model.raw_data import Keeping, RawState
from bench_service.model.records import NewRecording, StoredResult
from bench_service.model.request import CAMPAIGN_RUN
from bench_service.persistence import Database, open_stores
from bench_service.persistence.upkeep.contents import DatabaseContents, check_copy
from bench_service.persistence.upkeep.copies import copy_database
from bench_service.wall_clock import monotonic_s, pause
from procedures.core.errors import BadParameter
from procedures.core.limits import Verdict
from procedures.core.recording import RawArray
from tests.correction_samples import thermal
from tests.kit.calibrations import triad
from tests.storage.campaigns import campaign, new_run

OLD = 1e-7
"""Age in days that everything has which was made more than ten milliseconds ago."""
Make = Callable[..., Job]
NewRecordings = Callable[..., NewRecording]
Samples = Callable[..., RawArray]


@pytest.fixture
def recorded(stores: Stores, new_job: Make, new_recording: NewRecordings, samples: Samples) -> Callable[..., str]:
    """Makes a job that ended with a verdict, and gives the id of its one recording, of `count` samples."""

    def make(verdict: Verdict = Verdict.PASS, count: int = 100, **terms: object) -> str:
        job = stores.jobs.add(new_job(state=JobState.SUCCEEDED, verdict=verdict, **terms))
        writer = stores.recordings.open(new_recording(job_id=job.id))
        writer.write(samples(count))
        return writer.seal().id

    return make


def service(stores: Stores, database: Database, folder: Path | None = None, **rules: float) -> RawDataService:
    settings = StorageSettings(archive=None if folder is None else str(folder), **rules)
    return RawDataService(stores, DatabaseContents(database), settings, stores.raw_data.archive_at)


def read_whole(stores: Stores, recording: str) -> tuple[RawArray, str]:
    """All samples, and their content hash computed from them anew."""
    loaded = stores.recordings.load(recording)
    blocks = list(loaded.blocks())
    digest = ContentHash(loaded.info.channels, loaded.info.rate_hz, blocks[0].dtype)
    for block in blocks:
        digest.update(block)
    return np.concatenate(blocks), digest.hexdigest()


def bytes_here(database: Database) -> int:
    with database.read() as session:
        return int(session.scalar(sa.text("SELECT sum(length(payload)) FROM chunks")) or 0)


def test_a_rule_removes_routine_passes_and_keeps_what_something_rests_on(
    stores: Stores, database: Database, recorded: Callable[..., str], new_result: Callable[..., StoredResult]
) -> None:
    routine, failed, held, wanted = recorded(), recorded(Verdict.FAIL), recorded(), recorded()
    behind, base = recorded(), recorded()
    run = stores.campaigns.add_run(new_run(campaign({})))
    in_run = recorded(labels={CAMPAIGN_RUN: run.id})
    of = lambda recording: ((recording, stores.recordings.get(recording).info.content_hash),)  # noqa: E731
    first = stores.results.add(new_result(recordings=of(base)), [triad("gyro", 1)])
    (older,) = stores.calibrations.of_results([first.id])
    stores.results.add(new_result(recordings=of(behind), calibrations=(older.id,)), [triad("gyro", 2)])
    routine_result = stores.results.add(new_result(recordings=of(routine)))
    raw = service(stores, database)
    hold = raw.hold(held, "a customer asks", "Ada")
    BatchService(stores, Catalogue()).submit(
        BatchRequest(method="allan_deviation", selection=Selection(ids=(wanted,))), "Ada"
    )
    pause(0.05)
    before = bytes_here(database)

    plan = raw.remove(OLD, dry_run=True)
    assert (plan.recordings, plan.done, bytes_here(database)) == ([routine], 0, before)
    assert plan.kept == {Keeping.HOLD: 1, Keeping.ANALYSIS: 1, Keeping.CALIBRATION: 2, Keeping.CAMPAIGN: 1}
    assert raw.remove(1.0, dry_run=True).recordings == [], "nothing is a day old"

    done = raw.remove(OLD, dry_run=False)
    assert (done.done, done.done_bytes) == (1, plan.stored_bytes)
    assert bytes_here(database) == before - plan.stored_bytes
    left = stores.recordings.get(routine)
    assert left.raw is RawState.REMOVED
    with pytest.raises(RawDataRemoved, match=rf"{left.info.content_hash}.*api/v1/recordings/{routine}"):
        stores.recordings.load(routine)
    with pytest.raises(RawDataRemoved):
        raw.hold(routine, "too late", "Ada")
    assert stores.results.get(routine_result.id).recordings == of(routine), "lineage stays"
    for kept in (failed, held, wanted, behind, base, in_run):
        assert read_whole(stores, kept)[1] == stores.recordings.get(kept).info.content_hash

    raw.release(hold.id, "Ada")
    with pytest.raises(IllegalTransition):
        raw.release(hold.id, "Ada")
    assert raw.remove(OLD, dry_run=False).done == 1, "what was held goes once it is released"
    with pytest.raises(BadParameter, match="BENCH_RAW_DAYS"):
        raw.remove(None, dry_run=True)


def test_raw_data_behind_an_approved_correction_stay_when_another_one_is_current(
    stores: Stores, database: Database, recorded: Callable[..., str], new_result: Callable[..., StoredResult]
) -> None:
    ids: list[str] = []
    for seed in (1, 2, 3):
        recording = recorded()
        content = stores.recordings.get(recording).info.content_hash
        stores.results.add(new_result(recordings=((recording, content),)), corrections=[thermal(seed)])
        ids.append(recording)
        if seed == 1:
            (first,) = stores.corrections.list("U-1").items
            stores.corrections.approve("U-1", first.id, Decider("Ada", ""), None)
    pause(0.05)
    assert service(stores, database).remove(OLD, dry_run=True).recordings == [ids[1]]


def test_archived_data_are_read_back_by_everybody_and_by_duckdb(
    stores: Stores,
    database: Database,
    recorded: Callable[..., str],
    new_result: Callable[..., StoredResult],
    tmp_path: Path,
) -> None:
    recording = recorded(count=200_000)  # three chunks
    stored = stores.recordings.get(recording)
    document = {
        "checks": [{"name": "gyro_z_bias", "value": 0.25, "limit": {"unit": "deg/h"}, "standard_uncertainty": 0.5}]
    }
    result = stores.results.add(new_result(recordings=((recording, stored.info.content_hash),), document=document))
    before, _ = read_whole(stores, recording)
    opened = stores.recordings.load(recording).blocks()
    begun = [next(opened)]
    raw = service(stores, database, tmp_path / "archive")
    pause(0.05)
    assert raw.archive(OLD, dry_run=True).recordings == [recording]
    plan = raw.archive(OLD, dry_run=False)
    assert (plan.done, plan.faults, bytes_here(database)) == (1, [], 0)
    assert stores.recordings.get(recording).raw is RawState.ARCHIVED
    assert np.array_equal(np.concatenate([*begun, *opened]), before), "a reader that had begun notices nothing"
    after, digest = read_whole(stores, recording)
    assert np.array_equal(after, before)
    assert digest == stored.info.content_hash
    assert list(stores.recordings.damage(recording, 0, stored.info.count)) == []
    assert stores.tallies.recorded_bytes() == 0

    at = tmp_path / "archive"
    with duckdb.connect() as sql:
        query = f"SELECT count(*), sum(gyro_x), min(recording) FROM '{at}/samples/*/*.parquet'"
        count, total, named = sql.execute(query).fetchone() or (0, 0, "")
        assert (count, total, named) == (200_000, int(before[:, 0].sum(dtype=np.int64)), recording)
        joined = (
            f"SELECT r.name, q.value, c.samples, u.serial FROM '{at}/tables/results/*.parquet' r "
            f"JOIN '{at}/tables/quantities/*.parquet' q ON q.result = r.id "
            f"JOIN '{at}/tables/result_recordings/*.parquet' l ON l.result = r.id "
            f"JOIN '{at}/tables/recordings/*.parquet' c ON c.id = l.recording AND c.content_hash = l.content_hash "
            f"LEFT JOIN '{at}/tables/units/*.parquet' u ON u.serial = r.unit"
        )
        assert sql.execute(joined).fetchall() == [(result.name, 0.25, 200_000, None)]
    raw.archive(OLD, dry_run=False)
    assert len(list((at / "tables/results").iterdir())) == 1, "a part is written once"

    copy = tmp_path / "copy.sqlite"
    copy_database(database, copy)
    assert check_copy(copy).faults == ()
    report = UpkeepService(stores, DatabaseContents(database), "a test").scrub()
    assert report is not None
    assert (report.good, report.document["elsewhere"]) == (True, 1)

    assert raw.restore(recording).raw is RawState.STORED
    assert bytes_here(database) == stored.stored_bytes
    for file in at.glob("samples/*/*"):
        file.unlink()
    assert np.array_equal(read_whole(stores, recording)[0], before)


def test_a_damaged_or_absent_archive_is_said_and_never_read(
    stores: Stores, database: Database, recorded: Callable[..., str], tmp_path: Path
) -> None:
    recording = recorded()
    raw = service(stores, database, tmp_path / "archive")
    pause(0.05)
    raw.archive(OLD, dry_run=False)
    (file,) = (tmp_path / "archive").glob("samples/*/*.parquet")
    whole = file.read_bytes()
    file.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    with pytest.raises(DamagedRecording, match="damaged in the archive"):
        read_whole(stores, recording)
    with pytest.raises(DamagedRecording):
        raw.restore(recording)
    assert stores.recordings.get(recording).raw is RawState.RESTORING, "and may be tried again"
    file.unlink()
    with pytest.raises(ArchiveAway, match="chunk-000000"):
        read_whole(stores, recording)
    file.write_bytes(whole)
    assert raw.restore(recording).raw is RawState.STORED

    away = service(stores, database, tmp_path / "file" / "archive")
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(ArchiveAway):
        away.archive(OLD, dry_run=False)
    assert stores.recordings.get(recording).raw is RawState.STORED


def test_what_is_damaged_in_the_database_is_not_archived(
    stores: Stores, database: Database, recorded: Callable[..., str], tmp_path: Path
) -> None:
    good, bad = recorded(), recorded()
    with database.write() as session:
        session.execute(sa.text("UPDATE chunks SET sha256 = 'x' WHERE recording_id = :id"), {"id": bad})
    pause(0.05)
    plan = service(stores, database, tmp_path / "archive").archive(OLD, dry_run=False)
    assert (plan.done, len(plan.faults)) == (1, 1)
    assert stores.recordings.get(good).raw is RawState.ARCHIVED
    assert stores.recordings.get(bad).raw is RawState.STORED


MOVE = """
import sys
from pathlib import Path
from bench_service.persistence import open_stores
from bench_service.evidence.raw_data.service import RawDataService, StorageSettings
from bench_service.persistence.upkeep.contents import DatabaseContents
stores, database = open_stores(sys.argv[1])
rules = StorageSettings(archive=sys.argv[2])
raw = RawDataService(stores, DatabaseContents(database), rules, stores.raw_data.archive_at)
getattr(raw, sys.argv[3])(1e-7, dry_run=False)
"""


def killed_after(url: str, archive: Path, chunks: int) -> None:
    """Start archiving in another process, and kill it once so many chunks have their copies."""
    command = [sys.executable, "-c", MOVE, url, str(archive), "archive"]
    with subprocess.Popen(command, env=dict(os.environ)) as mover:
        deadline = monotonic_s() + 60
        while len(list(archive.glob("samples/*/*.parquet"))) < chunks:
            assert mover.poll() is None
            assert monotonic_s() < deadline
        mover.send_signal(signal.SIGKILL)


def test_a_kill_between_copy_and_delete_loses_nothing(
    sqlite_url: str, tmp_path: Path, new_recording: NewRecordings, samples: Samples
) -> None:
    """Twelve recordings of two chunks: the first kill falls into the first of them, the second into the middle."""
    stores, database = open_stores(sqlite_url)
    hashes: dict[str, str] = {}
    for number in range(12):
        writer = stores.recordings.open(new_recording())
        writer.write(samples(100_000, number))
        info = writer.seal()
        hashes[info.id] = info.content_hash
    states: set[RawState] = set()
    for chunks in (1, 13):
        killed_after(sqlite_url, tmp_path / "archive", chunks)
        for recording, wanted in hashes.items():
            assert read_whole(stores, recording)[1] == wanted
            states.add(stores.recordings.get(recording).raw)
    raw = service(stores, database, tmp_path / "archive")
    raw.archive(OLD, dry_run=False)
    assert {stores.recordings.get(recording).raw for recording in hashes} == {RawState.ARCHIVED}
    assert bytes_here(database) == 0
    assert {recording: read_whole(stores, recording)[1] for recording in hashes} == hashes
    assert {RawState.STORED, RawState.ARCHIVED} <= states, "the second kill came between two moves"
    database.dispose()


@pytest.mark.parametrize("begun", [RawState.REMOVING, RawState.ARCHIVING, RawState.RESTORING])
def test_a_move_that_a_crash_left_half_done_is_ended_by_the_next_run(
    stores: Stores, database: Database, recorded: Callable[..., str], tmp_path: Path, begun: RawState
) -> None:
    """The database is put into the state in which a kill after the first transaction leaves it."""
    recording = recorded(count=200_000)
    before = read_whole(stores, recording)[1]
    raw = service(stores, database, tmp_path / "archive")
    pause(0.05)
    if begun is not RawState.REMOVING:
        raw.archive(OLD, dry_run=False)
        raw.restore(recording)
        if begun is RawState.RESTORING:
            with database.write() as session:
                session.execute(sa.text("UPDATE chunks SET payload = :none WHERE number = 1"), {"none": b""})
    with database.write() as session:
        session.execute(sa.text("UPDATE recordings SET raw = :begun"), {"begun": begun.value})
    assert stores.raw_data.unfinished() == ((recording, begun),)
    if begun is RawState.REMOVING:
        with pytest.raises(RawDataRemoved):
            stores.recordings.load(recording)
        raw.remove(OLD, dry_run=False)
    else:
        assert read_whole(stores, recording)[1] == before
        if begun is RawState.ARCHIVING:
            raw.archive(1000.0, dry_run=False)
        else:
            raw.restore(recording)
        assert read_whole(stores, recording)[1] == before
    assert stores.raw_data.unfinished() == ()
    assert (bytes_here(database) == 0) == (begun is not RawState.RESTORING)


def test_sizes_are_told_and_predicted(
    stores: Stores, database: Database, recorded: Callable[..., str], tmp_path: Path
) -> None:
    for _ in range(2):
        recorded(count=50_000)
    recorded(Verdict.FAIL, count=50_000)
    plain = service(stores, database).report()
    stored = plain.raw[RawState.STORED]
    assert (stored.recordings, stored.stored_bytes) == (3, bytes_here(database))
    assert plain.growth.stored_bytes == stored.stored_bytes
    assert plain.growth.passes_bytes == pytest.approx(stored.stored_bytes * 2 / 3, rel=0.01)
    month = plain.predicted[0]
    grown = plain.stored_bytes + 30 * stored.stored_bytes  # all of it was made on this one day
    assert month.days == 30
    assert month.without_rules_bytes == pytest.approx(grown, rel=0.5)
    assert month.with_rules_bytes == month.without_rules_bytes
    ruled = service(stores, database, remove_days=10.0).report().predicted[0]
    leaving = plain.growth.passes_bytes * (1 + 20)  # those that are here, and those of the first twenty days
    assert ruled.without_rules_bytes - ruled.with_rules_bytes == pytest.approx(leaving, rel=1e-6)
    archived = service(stores, database, tmp_path, archive_days=10.0).report().predicted[0]
    leaving = stored.stored_bytes * (1 + 20)
    assert archived.without_rules_bytes - archived.with_rules_bytes == pytest.approx(leaving, rel=1e-6)
