"""The operator's work, and the same bytes with the chamber on, however time is cut and after a resume."""

import asyncio
import json
from dataclasses import replace

import numpy as np
import pytest

from procedures.bench import Operator
from procedures.bench.errors import DeviceFault, OtherVersion, OutOfRange
from procedures.core.recording import Station
from procedures.core.table_angles import TableAngles
from procedures.core.units import ARCSEC
from simulators.truth import OperatorTruth, TableTruth, default_bench
from simulators.truth.thermal import ChamberFault
from simulators.world import CHECKPOINT_VERSION, SimulatedBench, WorldConfig, build

FAULTS = (ChamberFault("cooling_lost", 900.0),)
CONFIG = WorldConfig(bench=replace(default_bench(), chamber_faults=FAULTS), seed=9, sample_rate_hz=100.0, thermal=True)
UPS = {"y": TableAngles(0, 0, 0), "x": TableAngles(0, 90, 0), "z": TableAngles(0, 0, -90)}
"""Table angles with an axis of the unit up."""
AXES = ("x", "y", "z")


async def thermal_run(bench: SimulatedBench, up: str, target_c: float) -> np.ndarray:
    """Off, set by hand, on, a ramp of 77.77 s under a recording."""
    await bench.supply.switch_off()
    await bench.operator.set_by_hand(UPS[up], f"{up} axis up")
    await bench.supply.switch_on()
    await bench.chamber.command(target_c, 5.0)
    await bench.clock.sleep(3.33)
    stream = bench.imu.record(77.77, Station(0, up, None, temperatures=True))
    return np.concatenate([block async for block in stream.blocks])


RUNS = (("x", 60.0), ("y", -40.0), ("z", 20.0))


def all_runs(bench: SimulatedBench, first: int = 0) -> list[bytes]:
    async def work() -> list[bytes]:
        return [(await thermal_run(bench, *run)).tobytes() for run in RUNS[first:]]

    return asyncio.run(work())


@pytest.fixture(scope="module")
def undisturbed() -> list[bytes]:
    return all_runs(build(CONFIG))


@pytest.mark.parametrize("done", [1, 2])
def test_after_a_checkpoint_between_runs_the_rest_is_the_same_bytes(undisturbed: list[bytes], done: int) -> None:
    broken = build(CONFIG)

    async def begin() -> None:
        for run in RUNS[:done]:
            await thermal_run(broken, *run)

    asyncio.run(begin())
    woken = build(CONFIG, json.loads(json.dumps(broken.checkpoint())))
    assert woken.chamber.plant.state == broken.chamber.plant.state
    assert all_runs(woken, done) == undisturbed[done:]


@pytest.mark.parametrize("length", [7, 130, 4000])
def test_how_time_is_cut_does_not_change_the_bytes(
    undisturbed: list[bytes], length: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("simulators.world.WARM_SLICE_S", length / 100.0)
    [first] = [asyncio.run(thermal_run(build(CONFIG), *RUNS[0])).tobytes()]
    assert first == undisturbed[0]


def test_another_seed_is_another_chamber_and_another_seat(undisturbed: list[bytes]) -> None:
    first = asyncio.run(thermal_run(build(replace(CONFIG, seed=10)), *RUNS[0]))
    codes, before = first[:, 6:], np.frombuffer(undisturbed[0], dtype=np.int32).reshape(-1, 11)[:, 6:]
    assert not np.array_equal(codes, before)


@pytest.mark.parametrize("changes", [{"sample_rate_hz": 50.0}, {"seed": 1}, {"thermal": False}])
def test_a_checkpoint_is_refused_by_another_rate_seed_or_world(changes: dict[str, object]) -> None:
    state = build(CONFIG).checkpoint()
    with pytest.raises(ValueError, match=r"made with .* = \(9, 100.0, True, False\)"):
        build(replace(CONFIG, **changes), state)


@pytest.mark.parametrize("version", [None, 1, CHECKPOINT_VERSION + 1])
def test_a_checkpoint_of_another_version_is_refused_before_anything_else_of_it_is_read(version: int | None) -> None:
    with pytest.raises(OtherVersion, match=f"by version {version} of .* are version {CHECKPOINT_VERSION}"):
        build(CONFIG, {} if version is None else {"version": version})


def test_a_job_without_temperatures_does_not_wake_in_the_chamber() -> None:
    state = build(replace(CONFIG, thermal=False)).checkpoint()
    with pytest.raises(ValueError, match="made with"):
        build(CONFIG, state)


def specific_force(bench: SimulatedBench, angles: TableAngles) -> np.ndarray:
    asyncio.run(bench.operator.set_by_hand(angles, "please"))
    return bench.turntable.rest_truth()[1]


@pytest.mark.parametrize("up", AXES)
def test_set_by_hand_the_axis_that_was_asked_for_is_up(up: str) -> None:
    exact = replace(default_bench(), table=TableTruth(), operator=OperatorTruth(fixture_tilt_sd_arcsec=0.0))
    bench = build(WorldConfig(bench=exact))
    operator: Operator = bench.operator
    assert operator is bench.operator
    expected = np.where(np.array(AXES) == up, bench.config.bench.site.gravity_m_s2, 0.0)
    np.testing.assert_allclose(specific_force(bench, UPS[up]), expected, rtol=0, atol=1e-13)
    assert bench.turntable.read_angles() == UPS[up]


def test_the_seat_leans_by_its_spread_anew_each_time_and_keeps_its_lean() -> None:
    shipped = default_bench()
    bench = build(WorldConfig(bench=replace(shipped, table=TableTruth()), seed=3, sample_rate_hz=1.0))
    g = bench.config.bench.site.gravity_m_s2
    force = np.array([specific_force(bench, UPS["y"]) for _ in range(300)])
    assert bench.clock.now_s() == 300 * 300.0
    # x and z of 300 settings: 600 small angles of 300 arcsec, so their spread is known to 2.9 %; 4 of those.
    assert np.std(force[:, [0, 2]] / g) == pytest.approx(300 * ARCSEC, rel=0.12)
    np.testing.assert_allclose(np.linalg.norm(force, axis=1), g, rtol=1e-12)
    asyncio.run(bench.turntable.move_to(TableAngles(0, 0, 180)))
    # Turned over by an exact table, a unit that leans in its axes as before feels the opposite.
    np.testing.assert_allclose(bench.turntable.rest_truth()[1], -force[-1], rtol=0, atol=1e-7)


def test_the_lean_is_felt_through_a_move_of_the_table() -> None:
    lean = replace(default_bench(), table=TableTruth(), operator=OperatorTruth(fixture_tilt_sd_arcsec=3600.0))
    bench = build(WorldConfig(bench=lean, seed=3))
    specific_force(bench, UPS["y"])
    passed = []
    bench.clock.connect(lambda ticks: passed.append(bench.turntable.advance(ticks)))
    asyncio.run(bench.turntable.move_to(UPS["z"]))
    last = passed[-1].velocity_m_s[-1] * bench.clock.rate_hz
    np.testing.assert_allclose(last, bench.turntable.rest_truth()[1], rtol=0, atol=1e-6)


def test_a_unit_that_is_on_is_not_touched_and_nothing_has_moved() -> None:
    bench = build(CONFIG)

    async def ask() -> None:
        await bench.supply.switch_on()
        await bench.chamber.command(40.0, 5.0)
        with pytest.raises(DeviceFault, match="the unit is on"):
            await bench.operator.set_by_hand(UPS["x"], "x up")
        assert (await bench.chamber.read()).target_c == 40.0

    asyncio.run(ask())
    assert bench.clock.now_s() == 0.0
    assert bench.turntable.read_angles() == TableAngles()


def test_angles_that_the_bench_does_not_have_are_refused_and_the_door_is_closed() -> None:
    bench = build(CONFIG)
    with pytest.raises(OutOfRange, match="middle_deg = 200"):
        asyncio.run(bench.operator.set_by_hand(TableAngles(0, 200, 0), "over"))
    assert not bench.chamber.plant.state.door_open
    assert bench.operator.settings == 0


def test_the_open_door_lets_the_chamber_s_air_out_and_stops_its_plant() -> None:
    bench = build(CONFIG)

    async def work() -> tuple[float, float, bool]:
        await bench.chamber.command(60.0, 5.0)
        await bench.clock.sleep(800.0)
        hot = (await bench.chamber.read()).air_c
        setting = asyncio.create_task(bench.operator.set_by_hand(UPS["x"], "x up"))
        for _ in range(4):
            await asyncio.sleep(0)
        assert (await bench.chamber.read()).door_open
        await setting
        after = await bench.chamber.read()
        return hot, after.air_c, after.door_open or after.target_c is not None

    hot, after, going = asyncio.run(work())
    assert hot > 55.0
    # The air's 8 kJ/K leave through 150 W/K in a minute; walls of 60 kJ/K hold it up through 60 W/K.
    assert after < 45.0
    assert not going


def test_a_cancelled_setting_leaves_the_door_closed_and_the_unit_where_it_was() -> None:
    bench = build(CONFIG)

    async def cancel() -> None:
        setting = asyncio.create_task(bench.operator.set_by_hand(UPS["x"], "x up"))
        for _ in range(3):
            await asyncio.sleep(0)
        setting.cancel()
        await asyncio.wait([setting])
        await bench.make_safe()
        reading = await bench.chamber.read()
        assert (reading.door_open, reading.target_c) == (False, None), "a chamber that stands still is not started"
        assert (await bench.turntable.read()).angles == TableAngles()

    asyncio.run(cancel())
