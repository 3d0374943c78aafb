"""Results, calibrations and their lineage; units and benches."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from bench_service.campaigns.stores import Stores
from bench_service.model.errors import IdempotencyConflict, NotFound, UnfitValue
from bench_service.model.job import Job
from bench_service.model.records import Idempotency, NewRecording, StoredResult
from procedures.bench.description import AxisLimits, BenchDescription, TableAccuracy
from procedures.core.imu_model import TriadCalibration, triad_calibration
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import RawArray, RecordingInfo
from procedures.core.site import Site
from procedures.core.unit import TriadRecord, Unit

NewResult = Callable[..., StoredResult]


@pytest.fixture
def recordings(
    stores: Stores, new_recording: Callable[..., NewRecording], samples: Callable[..., RawArray]
) -> tuple[RecordingInfo, ...]:
    made: list[RecordingInfo] = []
    for seed in range(3):
        writer = stores.recordings.open(new_recording())
        writer.write(samples(20, seed))
        made.append(writer.seal())
    return tuple(made)


def _triad(triad: str, seed: int = 1) -> TriadCalibration:
    rng = np.random.Generator(np.random.PCG64(seed))
    unit = {"gyro": "rad/s", "accelerometer": "m/s^2"}[triad]
    return triad_calibration(triad, unit, unit, rng.normal(size=12), np.diag(rng.random(12)) * 1e-12)


def test_a_result_comes_back_as_it_was_with_its_lineage(
    stores: Stores, new_result: NewResult, new_job: Callable[..., Job], recordings: tuple[RecordingInfo, ...]
) -> None:
    job = stores.jobs.add(new_job())
    used = tuple((r.id, r.content_hash) for r in recordings[::-1])
    result = new_result(job_id=job.id, recordings=used, seed=7, context={"x": 1})
    assert stores.results.add(result) == result
    back = stores.results.get(result.id)
    assert back == result
    assert repr(back.document) == repr(result.document)
    assert stores.results.list(job_id=job.id).items == (result,)


def test_lineage_is_read_both_ways(
    stores: Stores, new_result: NewResult, recordings: tuple[RecordingInfo, ...]
) -> None:
    def used(*which: int) -> StoredResult:
        pairs = tuple((recordings[i].id, recordings[i].content_hash) for i in which)
        return stores.results.add(new_result(recordings=pairs))

    first, second, third = used(0, 1), used(1, 2, 1), used(1)
    assert stores.results.of_recording(recordings[1].id) == (third.id, second.id, first.id)
    assert stores.results.of_recording(recordings[0].id) == (first.id,)
    assert stores.results.of_recording("nobody") == ()
    assert [rid for rid, _ in stores.results.get(second.id).recordings] == [recordings[i].id for i in (1, 2, 1)]


def test_a_result_of_something_that_does_not_exist_leaves_nothing(stores: Stores, new_result: NewResult) -> None:
    with pytest.raises(NotFound, match="recording 'r'"):
        stores.results.add(new_result(recordings=(("r", "h"),)), [_triad("gyro")])
    with pytest.raises(NotFound, match="calibration 'c'"):
        stores.results.add(new_result(calibrations=("c",)), [_triad("gyro")])
    assert stores.results.list().items == ()
    assert stores.calibrations.list("U-1").items == ()
    with pytest.raises(NotFound, match="result 'x'"):
        stores.results.get("x")


def test_a_calibration_needs_a_unit(stores: Stores, new_result: NewResult) -> None:
    with pytest.raises(ValueError, match="unit"):
        stores.results.add(new_result(unit=None), [_triad("gyro")])


def test_a_key_makes_one_result_and_one_calibration(stores: Stores, new_result: NewResult) -> None:
    key = Idempotency("k", "f")
    first = stores.results.add(new_result(), [_triad("gyro")], idempotency=key)
    assert stores.results.add(new_result(), [_triad("gyro")], idempotency=key) == first
    assert len(stores.calibrations.list("U-1").items) == 1
    with pytest.raises(IdempotencyConflict):
        stores.results.add(new_result(), idempotency=Idempotency("k", "g"))


def test_a_key_of_a_job_is_not_one_of_a_result(
    stores: Stores, new_result: NewResult, new_job: Callable[..., Job]
) -> None:
    stores.jobs.add(new_job(), Idempotency("k", "f"))
    with pytest.raises(IdempotencyConflict):
        stores.results.add(new_result(), idempotency=Idempotency("k", "f"))


def test_results_are_listed_newest_first(stores: Stores, new_result: NewResult) -> None:
    made = [stores.results.add(new_result(unit=f"U-{i % 2}")) for i in range(5)]
    page = stores.results.list(limit=2)
    assert page.items == (made[4], made[3])
    assert stores.results.list(after=page.next).items == (made[2], made[1], made[0])
    assert stores.results.list(unit="U-1").items == (made[3], made[1])


def test_a_value_that_no_database_holds_is_refused_as_one_that_never_will_be(
    stores: Stores, new_result: NewResult, new_recording: Callable[..., NewRecording]
) -> None:
    """Not as a failure of the database, which is answered by trying again."""
    unit = Unit("U-1", 400.0, new_recording().channels, averaging_time_s=float("nan"))
    for store in (lambda: stores.units.put_unit(unit), lambda: stores.results.add(new_result(document={"a": [1e999]}))):
        with pytest.raises(UnfitValue, match=r"a value cannot be stored.*Out of range float values"):
            store()
    with pytest.raises(NotFound):
        stores.units.unit("U-1")
    assert stores.results.list().items == ()


def test_a_unit_comes_back_with_its_current_calibration(
    stores: Stores, new_result: NewResult, new_recording: Callable[..., NewRecording]
) -> None:
    noise = NoiseCoefficients(1e-6, 2e-6, 3e-9, 4e-12, 5e-15)
    gyro = TriadRecord((noise, noise, noise), 1e-7, 1e-5, "a result")
    unit = Unit("U-1", 400.0, new_recording().channels, gyro, None, 81.25)
    with pytest.raises(NotFound, match="unit 'U-1'"):
        stores.units.unit("U-1")
    stores.units.put_unit(replace(unit, averaging_time_s=1.0))
    stores.units.put_unit(replace(unit, calibrations=(_triad("gyro", 8),)))
    assert stores.units.unit("U-1") == unit, "the calibrations of the record are not stored"
    stores.results.add(new_result(), [_triad("gyro", 4)])
    stores.results.add(new_result(), [_triad("gyro", 5)])
    (current,) = (c for c in stores.calibrations.list("U-1").items if c.current)
    assert stores.units.unit("U-1") == replace(unit, calibrations=(current.value,), calibration_ids=(current.id,))
    assert current.value.coefficients.tolist() == _triad("gyro", 5).coefficients.tolist(), "to the last bit"
    other = replace(unit, serial="A-1", gyro=None)
    stores.units.put_unit(other)
    assert stores.units.units() == (other, stores.units.unit("U-1"))


def test_a_bench_comes_back_as_it_was(stores: Stores) -> None:
    axis = AxisLimits(-180.0, 180.0, 200.0, 500.0)
    bench = BenchDescription("sim", Site(55.0, 9.81, 37.0), axis, axis, axis, TableAccuracy(1.0, 2.0, 3.0), True)
    with pytest.raises(NotFound, match="bench 'sim'"):
        stores.benches.bench("sim")
    stores.benches.put_bench(bench)
    stores.benches.put_bench(replace(bench, title="B"))
    assert stores.benches.bench("sim") == replace(bench, title="B")
    assert stores.benches.benches() == (replace(bench, title="B"),)
