"""The whole bench: power, recordings, time, and going on from a checkpoint with the same bytes."""

import asyncio
import json
from dataclasses import replace

import numpy as np
import pytest

from procedures.bench.errors import DeviceFault, NotPowered, OutOfRange
from procedures.core.recording import Quantity, Station
from procedures.core.table_angles import TableAngles
from procedures.core.units import DEG, EARTH_RATE
from simulators.clock import Motion, SimClock
from simulators.truth import declared_unit, default_unit
from simulators.world import WorldConfig, build

STATIONS = [
    Station(0, "a", TableAngles(0, 0, 90), None, 1.0, 3.0),
    Station(1, "b", TableAngles(20, -45, 90), None, 470.0, 2.5),  # the slow noise changes its block
    Station(2, "c", TableAngles(0, 90, -300), None, 0.5, 12.0),
    Station(3, "d", None, None, 0.0, 1.0),
]
CONFIG = WorldConfig(seed=9, sample_rate_hz=100.0)


def test_the_same_seed_gives_the_same_bytes_and_another_seed_does_not(record) -> None:
    first, again, other = (record(build(c), STATIONS[:2]) for c in (CONFIG, CONFIG, replace(CONFIG, seed=10)))
    assert [r.tobytes() for r in first] == [r.tobytes() for r in again]
    assert all(a.tobytes() != b.tobytes() for a, b in zip(first, other, strict=True))


def test_after_a_checkpoint_at_any_station_the_rest_is_the_same_bytes(record) -> None:
    undisturbed = record(build(CONFIG), STATIONS)
    for done in range(1, len(STATIONS)):
        broken = build(CONFIG)
        record(broken, STATIONS[:done])
        state = json.loads(json.dumps(broken.checkpoint()))
        woken = build(CONFIG, state)
        assert woken.clock.now_s() == broken.clock.now_s()
        assert woken.supply.launches == 1
        assert woken.imu.record(1.0).launched_s == 0.0
        rest = record(woken, STATIONS[done:])
        assert [r.tobytes() for r in rest] == [r.tobytes() for r in undisturbed[done:]]


def test_a_checkpoint_between_launches_keeps_their_count(record) -> None:
    bench = build(CONFIG)
    record(bench, STATIONS[:1])
    asyncio.run(bench.supply.switch_off())
    woken = build(CONFIG, json.loads(json.dumps(bench.checkpoint())))
    assert not woken.supply.is_on()
    second, same = record(woken, STATIONS[3:]), record(bench, STATIONS[3:])
    assert woken.supply.launches == 2
    assert second[0].tobytes() == same[0].tobytes()


def test_a_checkpoint_is_refused_by_another_world(record) -> None:
    state = build(CONFIG).checkpoint()
    with pytest.raises(ValueError, match="checkpoint was made with"):
        build(replace(CONFIG, seed=1), state)


def test_a_moving_table_has_no_checkpoint() -> None:
    bench = build(CONFIG)

    async def ask() -> None:
        move = asyncio.create_task(bench.turntable.move_to(TableAngles(90, 0, 0)))
        for _ in range(3):
            await asyncio.sleep(0)
        with pytest.raises(DeviceFault, match="no checkpoint"):
            bench.checkpoint()
        await move

    asyncio.run(ask())


@pytest.mark.parametrize("length", [1, 3, 10, 1000])
def test_how_time_is_cut_does_not_change_the_bytes(length: int, record, monkeypatch) -> None:
    [whole] = record(build(CONFIG), [Station(0, "", None, None, 7.0, 25.0)])
    monkeypatch.setattr("simulators.clock.SLICE_S", length / 100.0)
    monkeypatch.setattr("simulators.imu.tape.BLOCK_S", 3.33)
    [cut] = record(build(CONFIG), [Station(0, "", None, None, 7.0, 25.0)])
    assert cut.tobytes() == whole.tobytes()


def test_a_recording_has_exactly_its_samples_in_blocks_of_ten_seconds() -> None:
    bench = build(CONFIG)

    async def lengths() -> list[tuple[int, ...]]:
        await bench.supply.switch_on()
        await bench.clock.sleep(2.0)
        stream = bench.imu.record(23.456)
        assert stream.start_s == 2.0
        assert stream.launched_s == 0.0
        assert stream.rate_hz == 100.0
        blocks = [b async for b in stream.blocks]
        assert all(b.dtype == np.int32 for b in blocks)
        return [b.shape for b in blocks]

    assert asyncio.run(lengths()) == [(1000, 6), (1000, 6), (346, 6)]
    assert bench.clock.now_s() == pytest.approx(25.46)


def test_a_unit_without_power_sends_nothing() -> None:
    bench = build(CONFIG)
    with pytest.raises(NotPowered):
        bench.imu.record(1.0)

    async def cut() -> None:
        await bench.supply.switch_on()
        stream = bench.imu.record(30.0)
        async for _ in stream.blocks:
            await bench.make_safe()

    with pytest.raises(NotPowered):
        asyncio.run(cut())
    assert not bench.supply.is_on()


def test_switching_on_what_is_on_is_no_new_launch() -> None:
    bench = build(CONFIG)

    async def switch() -> list[int]:
        seen = []
        for verb in (bench.supply.switch_on, bench.supply.switch_on, bench.supply.switch_off, bench.supply.switch_on):
            await verb()
            seen.append(bench.supply.launch())
        return seen

    assert asyncio.run(switch()) == [1, 1, 0, 2]


def test_two_launches_have_their_own_coefficients_and_noise(record) -> None:
    bench = build(CONFIG)
    [first] = record(bench, [Station(0, "", None, None, 0.0, 5.0)])
    bias = bench.true_calibration()["gyro"][0]
    asyncio.run(bench.supply.switch_off())
    asyncio.run(bench.clock.sleep(3600.0))
    [second] = record(bench, [Station(0, "", None, None, 0.0, 5.0)])
    assert bench.imu.record(1.0).launched_s == 3605.0
    assert np.all(bias != bench.true_calibration()["gyro"][0])
    assert first.tobytes() != second.tobytes()


def test_what_the_unit_counts_through_a_move_is_the_turn(quiet_config) -> None:
    bench = build(quiet_config())

    async def turn_under_a_recording() -> np.ndarray:
        await bench.supply.switch_on()
        stream = bench.imu.record(20.0)
        move = asyncio.create_task(bench.turntable.move_to(TableAngles(0, 0, 120)))
        raw = np.concatenate([b async for b in stream.blocks])
        await move
        return raw

    counted = asyncio.run(turn_under_a_recording()).sum(axis=0) * [c.scale for c in bench.imu.channels]
    # x is the inner axis: 120° and 20 s of the Earth's rate along north. Specific force turned: its sum is below g·t.
    earth = EARTH_RATE * 0.8660254037844386 * 20.0
    assert counted[0] == pytest.approx(120 * DEG + earth, abs=1e-8)
    assert np.linalg.norm(counted[3:]) < 9.8 * 20.0


def test_the_increments_of_a_move_compose_to_the_new_attitude(quiet_config) -> None:
    config = quiet_config()
    still_earth = replace(config.bench, site=replace(config.bench.site, earth_rate_rad_s=0.0))
    bench = build(replace(config, bench=still_earth, sample_rate_hz=400.0))
    passed: list[Motion] = []
    bench.clock.connect(lambda ticks: passed.append(bench.turntable.advance(ticks)))
    asyncio.run(bench.turntable.move_to(TableAngles(60, -90, 150)))
    force = np.array([0.0, 9.8, 0.0])
    for vector in np.concatenate([m.angle_rad for m in passed]):
        size = np.linalg.norm(vector)
        axis = vector / max(size, 1e-300)
        along = axis * (axis @ force) * (1.0 - np.cos(size))
        force = force * np.cos(size) - np.cross(axis, force) * np.sin(size) + along  # Rodrigues, backwards
    # Increments do not commute: |ω × ω̇|dt³/12 = 2e-9 rad a sample at the worst, over 1900 samples.
    np.testing.assert_allclose(force, bench.turntable.rest_truth()[1], rtol=0, atol=9.8 * 4e-6)


def test_a_late_reader_is_told_that_samples_were_lost() -> None:
    bench = build(CONFIG)

    async def late() -> None:
        await bench.supply.switch_on()
        stream = bench.imu.record(1.0)
        await bench.clock.sleep(1.0)
        async for _ in stream.blocks:
            pass

    with pytest.raises(DeviceFault, match="samples were lost"):
        asyncio.run(late())


def test_cancelling_a_long_sleep_lands_within_a_slice() -> None:
    bench = build(CONFIG)

    async def cancel() -> None:
        sleeping = asyncio.create_task(bench.clock.sleep(1e6))
        for _ in range(5):
            await asyncio.sleep(0)
        sleeping.cancel()
        await asyncio.wait([sleeping])

    asyncio.run(cancel())
    assert 0.0 < bench.clock.now_s() <= 50.0


def test_real_time_waits_through_what_it_was_given() -> None:
    waited: list[float] = []

    async def wait(seconds: float) -> None:
        waited.append(seconds)

    bench = build(replace(CONFIG, real_time_factor=4.0, wait=wait))
    asyncio.run(bench.clock.sleep(2.0))
    assert sum(waited) == pytest.approx(0.5)
    assert max(waited) <= 0.1
    with pytest.raises(ValueError, match="real_time_factor"):
        SimClock(100.0, 2.0)


@pytest.mark.parametrize("seconds", [-1.0, float("nan"), float("inf")])
def test_time_does_not_go_back(seconds: float) -> None:
    bench = build(CONFIG)
    asyncio.run(bench.supply.switch_on())
    with pytest.raises(OutOfRange):
        asyncio.run(bench.clock.sleep(seconds))
    with pytest.raises(OutOfRange):
        bench.imu.record(seconds)


def test_the_data_sheet_says_what_is_true_of_the_noise() -> None:
    truth = default_unit()
    unit = declared_unit(truth)
    assert [c.quantity for c in unit.channels] == [Quantity.ANGLE_INCREMENT] * 3 + [Quantity.VELOCITY_INCREMENT] * 3
    assert unit.gyro is not None
    assert unit.gyro.noise[1].quantization == truth.gyro.quantization[1]
    assert unit.gyro.noise[2].flicker_band_s == truth.gyro.flicker_band_s
    assert unit.gyro.scale_factor_run_to_run_sd == pytest.approx(2e-6)
    assert unit.channels == build(CONFIG).imu.channels
