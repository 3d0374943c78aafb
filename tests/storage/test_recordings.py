"""Raw samples come back bit for bit, whole or in part, however they came; and nothing half-made is ever seen."""

from collections.abc import Callable, Iterable
from datetime import timedelta
from threading import Event

import numpy as np
import pytest
import sqlalchemy as sa

from bench_service.campaigns.stores import Stores
from bench_service.formats import chunk
from bench_service.formats.content_hash import content_hash
from bench_service.model.errors import IdempotencyConflict, NotFound, StorageFailure, StorageFull
from bench_service.model.job import Job
from bench_service.model.records import Idempotency, NewRecording, RecordingState
from bench_service.persistence import Database
from bench_service.persistence.evidence.recording_store import SqlRecordingStore
from bench_service.persistence.tables.evidence import ChunkRow, RecordingRow
from bench_service.wall_clock import monotonic_s, now, pause
from procedures.core.errors import BadParameter, MissingChannel, UnfitRecording
from procedures.core.recording import RawArray, RecordingInfo, Station

New = Callable[..., NewRecording]
Samples = Callable[..., RawArray]
ROWS = 500


@pytest.fixture(autouse=True)
def _small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chunk, "RAW_BYTES", ROWS * 6 * 4)


def _store(stores: Stores, new: NewRecording, raw: RawArray, step: int = 333) -> RecordingInfo:
    writer = stores.recordings.open(new)
    for start in range(0, len(raw), step):
        writer.write(raw[start : start + step])
    return writer.seal({"clock_s": 4.25})


def _whole(blocks: Iterable[RawArray]) -> RawArray:
    return np.concatenate(list(blocks))


def test_samples_come_back_bit_for_bit(stores: Stores, new_recording: New, samples: Samples) -> None:
    for count in (1, ROWS - 1, ROWS, ROWS + 1, 2 * ROWS, 4321):
        raw = samples(count)
        info = _store(stores, new_recording(), raw)
        recording = stores.recordings.load(info.id)
        assert recording.info == info
        assert info.count == count
        for _ in range(2):
            back = _whole(recording.blocks())
            assert back.dtype == np.int32
            np.testing.assert_array_equal(back, raw)
        stored = stores.recordings.get(info.id)
        assert stored.chunks == -(-count // ROWS)
        assert stored.state is RecordingState.COMPLETE
        assert stored.stored_bytes > 0


def test_floating_point_samples_keep_every_bit(stores: Stores, new_recording: New) -> None:
    raw = np.random.Generator(np.random.PCG64(2)).normal(size=(1700, 6)) * 1e-9
    raw[3] = [-0.0, 5e-324, 1.7976931348623157e308, np.nextafter(1.0, 2.0), 0.1, -1.0]
    info = _store(stores, new_recording(dtype=np.float64), raw)
    assert _whole(stores.recordings.load(info.id).blocks()).tobytes() == raw.tobytes()


def test_any_part_can_be_read_alone(stores: Stores, new_recording: New, samples: Samples) -> None:
    raw = samples(2000)
    info = _store(stores, new_recording(), raw)
    names = ["accelerometer_z", "gyro_x"]
    for start, stop in ((0, 1), (499, 501), (500, 1000), (123, 1999), (1999, 2000), (7, 7), (-5, 9999)):
        blocks = list(stores.recordings.read(info.id, names, start, stop))
        back = np.concatenate([np.empty((0, 2), np.int32), *blocks])
        np.testing.assert_array_equal(back, raw[max(0, start) : stop][:, [5, 0]])


def test_an_unknown_channel_or_recording_is_refused_at_once(
    stores: Stores, new_recording: New, samples: Samples
) -> None:
    info = _store(stores, new_recording(), samples(10))
    with pytest.raises(MissingChannel, match="gyro_w"):
        stores.recordings.read(info.id, ["gyro_w"], 0, 10)
    for ask in (stores.recordings.get, stores.recordings.load):
        with pytest.raises(NotFound, match="recording 'nobody'"):
            ask("nobody")


def test_the_hash_does_not_know_chunks_or_blocks(
    stores: Stores, new_recording: New, samples: Samples, monkeypatch: pytest.MonkeyPatch
) -> None:
    raw = samples(3000)
    hashes = set()
    for rows, step in ((500, 333), (64, 1000), (5000, 3000)):
        monkeypatch.setattr(chunk, "RAW_BYTES", rows * 24)
        hashes.add(_store(stores, new_recording(), raw, step).content_hash)
    assert hashes == {content_hash(new_recording().channels, 400.0, raw)}


def test_nothing_is_seen_before_the_seal(
    stores: Stores, database: Database, new_recording: New, samples: Samples
) -> None:
    writer = stores.recordings.open(new_recording())
    writer.write(samples(ROWS - 1))
    assert _count(database, RecordingRow) == 0
    writer.write(samples(ROWS))
    _wait_for_chunks(database, 1)
    assert _count(database, RecordingRow) == 1
    assert stores.recordings.list().items == ()
    info = writer.seal()
    assert [r.info for r in stores.recordings.list().items] == [info]
    assert writer.seal() == info
    with pytest.raises(StorageFailure, match="closed"):
        writer.write(samples(1))


def test_what_is_abandoned_is_kept_only_where_a_chunk_was(
    stores: Stores, database: Database, new_recording: New, new_job: Callable[..., Job], samples: Samples
) -> None:
    job = stores.jobs.add(new_job())
    new = new_recording(job_id=job.id, station=job.stations[0])
    short = stores.recordings.open(new)
    short.write(samples(ROWS - 1))
    short.abandon()
    assert _count(database, RecordingRow) == 0
    raw = samples(3 * ROWS - 1)
    long = stores.recordings.open(new)
    long.write(raw)
    long.abandon()
    (kept,) = stores.recordings.list().items
    assert kept.state is RecordingState.INTERRUPTED
    assert kept.info.count == 2 * ROWS
    assert kept.info.content_hash == content_hash(kept.info.channels, 400.0, raw[: 2 * ROWS])
    np.testing.assert_array_equal(_whole(stores.recordings.load(kept.info.id).blocks()), raw[: 2 * ROWS])


def test_an_abandoned_import_leaves_nothing(
    stores: Stores, database: Database, new_recording: New, samples: Samples
) -> None:
    writer = stores.recordings.open(new_recording())
    writer.write(samples(2 * ROWS))
    writer.abandon()
    assert (_count(database, RecordingRow), _count(database, ChunkRow)) == (0, 0)


def test_after_a_crash_an_open_recording_becomes_interrupted(
    stores: Stores, database: Database, new_recording: New, new_job: Callable[..., Job], samples: Samples
) -> None:
    job = stores.jobs.add(new_job())
    raw = samples(2 * ROWS + 7)
    dead = stores.recordings.open(new_recording(job_id=job.id, station=job.stations[0]))
    dead.write(raw)
    _wait_for_chunks(database, 2)
    assert stores.recordings.interrupt_open("another job") == 0
    assert stores.recordings.interrupt_open(job.id) == 1
    assert stores.recordings.interrupt_open(job.id) == 0
    (kept,) = stores.recordings.list(job_id=job.id).items
    assert kept.state is RecordingState.INTERRUPTED
    assert kept.info.content_hash == content_hash(kept.info.channels, 400.0, raw[: 2 * ROWS])
    assert stores.recordings.of_job(job.id) == ()
    with pytest.raises(StorageFailure, match="closed"):
        dead.seal()
    again = _store(stores, new_recording(job_id=job.id, station=job.stations[0]), raw)
    assert [r.info for r in stores.recordings.of_job(job.id)] == [again]


def test_a_chunk_is_stored_beside_the_next_and_its_failure_is_raised_by_the_next_call(
    stores: Stores, new_recording: New, samples: Samples, monkeypatch: pytest.MonkeyPatch
) -> None:
    may_go_on = Event()

    def full(*_: object) -> bytes:
        assert may_go_on.wait(30.0)
        raise StorageFull("no room")

    monkeypatch.setattr("bench_service.persistence.evidence.recording_writer.encode_chunk", full)
    writer = stores.recordings.open(new_recording())
    writer.write(samples(ROWS))
    writer.write(samples(ROWS - 1))  # while the first chunk is on its way
    may_go_on.set()
    with pytest.raises(StorageFull, match="no room"):
        writer.write(samples(1))
    for call in (lambda: writer.write(samples(1)), writer.seal):
        with pytest.raises(StorageFailure, match="closed"):
            call()
    writer.abandon()
    last = stores.recordings.open(new_recording())
    last.write(samples(ROWS))
    with pytest.raises(StorageFull, match="no room"):
        last.seal()
    last.abandon()
    assert stores.recordings.list().items == ()


def test_a_crashed_import_can_be_cleared_away(
    stores: Stores, database: Database, new_recording: New, samples: Samples
) -> None:
    stores.recordings.open(new_recording()).write(samples(ROWS))
    _wait_for_chunks(database, 1)
    kept = _store(stores, new_recording(), samples(ROWS))
    recordings = SqlRecordingStore(database)
    assert recordings.discard_open_imports(now() - timedelta(hours=1)) == 0
    assert recordings.discard_open_imports(now() + timedelta(hours=1)) == 1
    assert _count(database, ChunkRow) == 1
    assert [r.info for r in stores.recordings.list().items] == [kept]


@pytest.mark.parametrize("count", [100, 3 * ROWS + 1])
def test_a_station_repeated_after_its_seal_leaves_the_first(
    stores: Stores, database: Database, new_recording: New, new_job: Callable[..., Job], samples: Samples, count: int
) -> None:
    job = stores.jobs.add(new_job())
    new = new_recording(job_id=job.id, bench="sim", station=job.stations[1], source={"a": 1})
    first = _store(stores, new, samples(count, seed=1))
    assert _store(stores, new, samples(count, seed=2)) == first
    assert [r.info for r in stores.recordings.of_job(job.id)] == [first]
    assert _count(database, RecordingRow) == 1
    assert _count(database, ChunkRow) == -(-count // ROWS)
    stored = stores.recordings.get(first.id)
    assert (stored.job_id, stored.bench, stored.source) == (job.id, "sim", {"a": 1})


def test_a_job_has_its_recordings_in_the_order_of_stations_and_the_last_checkpoint(
    stores: Stores, new_recording: New, new_job: Callable[..., Job], samples: Samples
) -> None:
    job = stores.jobs.add(new_job())
    assert stores.recordings.checkpoint(job.id) is None
    for station in job.stations:
        writer = stores.recordings.open(new_recording(job_id=job.id, station=station))
        writer.write(samples(20))
        writer.seal({"station": station.index})
    assert [r.info.station for r in stores.recordings.of_job(job.id)] == list(job.stations)
    assert stores.recordings.checkpoint(job.id) == {"station": 2}


def test_a_recording_of_no_job_there_is_is_refused(stores: Stores, new_recording: New, samples: Samples) -> None:
    writer = stores.recordings.open(new_recording(job_id="nobody", station=Station(0, "up")))
    writer.write(samples(3))
    with pytest.raises(StorageFailure):
        writer.seal()
    assert stores.recordings.list().items == ()


def test_a_key_makes_one_recording(stores: Stores, database: Database, new_recording: New, samples: Samples) -> None:
    key = Idempotency("k", "f")
    assert stores.keys.made(key, "recording") is None
    rivals = [stores.recordings.open(new_recording(idempotency=key)) for _ in range(2)]
    for rival in rivals:
        rival.write(samples(2 * ROWS + 1))
    first = rivals[0].seal()
    assert rivals[1].seal() == first
    assert stores.keys.made(key, "recording") == first.id
    assert (_count(database, RecordingRow), _count(database, ChunkRow)) == (1, 3)
    late = stores.recordings.open(new_recording(idempotency=Idempotency("k", "g")))
    late.write(samples(5))
    with pytest.raises(IdempotencyConflict):
        late.seal()
    assert _count(database, RecordingRow) == 1


def test_recordings_are_listed_newest_first_page_by_page(stores: Stores, new_recording: New, samples: Samples) -> None:
    made = [_store(stores, new_recording(unit="U-1" if i % 2 else "U-2"), samples(5)).id for i in range(7)]
    seen: list[str] = []
    cursor = None
    while True:
        page = stores.recordings.list(after=cursor, limit=3)
        seen += [r.info.id for r in page.items]
        cursor = page.next
        if cursor is None:
            break
    assert seen == made[::-1]
    assert [r.info.id for r in stores.recordings.list(unit="U-2").items] == made[::-2]


@pytest.mark.parametrize("damage", ["payload", "missing", "swapped"])
def test_a_damaged_chunk_is_noticed_and_named(
    stores: Stores, database: Database, new_recording: New, samples: Samples, damage: str
) -> None:
    info = _store(stores, new_recording(), samples(3 * ROWS))
    with database.write() as session:
        row = session.get(ChunkRow, (info.id, 1))
        assert row is not None
        if damage == "missing":
            session.delete(row)
        elif damage == "payload":
            row.payload = row.payload[:100] + bytes([row.payload[100] ^ 1]) + row.payload[101:]
        else:
            other = session.get(ChunkRow, (info.id, 2))
            assert other is not None
            row.payload = other.payload
    assert len(list(stores.recordings.read(info.id, None, 0, ROWS))) == 1
    with pytest.raises(StorageFailure, match=f"chunk 1 of recording {info.id}"):
        list(stores.recordings.load(info.id).blocks())


def test_a_damaged_recording_that_is_left_open_can_be_closed(
    stores: Stores, database: Database, new_recording: New, samples: Samples, new_job: Callable[..., Job]
) -> None:
    job = stores.jobs.add(new_job())
    writer = stores.recordings.open(new_recording(job_id=job.id, station=Station(0, "up")))
    writer.write(samples(2 * ROWS + 1))
    _wait_for_chunks(database, 2)
    with database.write() as session:
        row = session.scalars(sa.select(ChunkRow).where(ChunkRow.number == 0)).one()
        row.payload = row.payload[:-1]
    assert stores.recordings.interrupt_open(job.id) == 1
    (left,) = stores.recordings.list(job_id=job.id).items
    assert (left.state, left.info.content_hash) == (RecordingState.INTERRUPTED, "")
    assert stores.recordings.interrupt_open(job.id) == 0


def test_a_job_goes_on_from_its_last_station_whatever_the_clock_said(
    stores: Stores, new_recording: New, samples: Samples, new_job: Callable[..., Job], monkeypatch: pytest.MonkeyPatch
) -> None:
    job = stores.jobs.add(new_job())
    ids = iter(["01a20354-0000-7000-8000-000000000002", "01a20354-0000-7000-8000-000000000001"])
    monkeypatch.setattr("bench_service.wall_clock.new_id", lambda: next(ids))
    for index in range(2):
        writer = stores.recordings.open(new_recording(job_id=job.id, station=Station(index, "up")))
        writer.write(samples(20))
        writer.seal({"station": index})
    assert stores.recordings.checkpoint(job.id) == {"station": 1}


def test_what_cannot_be_a_recording_is_refused(stores: Stores, new_recording: New, samples: Samples) -> None:
    channels = new_recording().channels
    for changes in ({"channels": ()}, {"channels": (channels[0], channels[0])}, {"rate_hz": float("nan")}):
        with pytest.raises(BadParameter):
            stores.recordings.open(new_recording(**changes))
    writer = stores.recordings.open(new_recording())
    for block in (samples(5)[:, :5], samples(5)[0], samples(5).astype(np.float64), samples(5).astype(np.int64)):
        with pytest.raises(UnfitRecording):
            writer.write(block)
    with pytest.raises(UnfitRecording, match="without samples"):
        writer.seal()
    floats = stores.recordings.open(new_recording(dtype=np.float64))
    with pytest.raises(UnfitRecording, match="not finite"):
        floats.write(np.full((3, 6), np.nan))
    writer.write(samples(5))
    assert writer.seal().count == 5


def _wait_for_chunks(database: Database, number: int) -> None:
    """Wait until the writers' threads have stored so many chunks."""
    deadline_s = monotonic_s() + 30.0
    while _count(database, ChunkRow) < number:
        assert monotonic_s() < deadline_s
        pause(0.005)


def _count(database: Database, table: type[RecordingRow] | type[ChunkRow]) -> int:
    with database.read() as session:
        return session.scalar(sa.select(sa.func.count()).select_from(table)) or 0
