"""The table: limits, moves, settling, lock, stop; and what each of its flaws does, by hand, to first order."""

import asyncio
from dataclasses import replace
from math import nan, pi

import numpy as np
import pytest

from procedures.bench.errors import DeviceFault, NotSettled, OutOfRange, Stopped
from procedures.core.table_angles import TableAngles
from simulators.dwell_means import true_inputs
from simulators.truth import TableTruth, default_bench, random_table_truth
from simulators.turntable.device import pointing_error_rad
from simulators.turntable.kinematics import at_rest, attitude
from simulators.turntable.plant import Plant
from simulators.turntable.profile import Quintic, move_ticks
from simulators.world import SimulatedBench, build

ARCSEC = pi / 648000.0
DEG = pi / 180.0
G = 9.8
NORTH, UP = 7.292115e-5 * 0.8660254037844386, 7.292115e-5 * 0.5
TEN = 10.0 * ARCSEC


@pytest.mark.parametrize("angles", [TableAngles(0, 191, 0), TableAngles(-361, 0, 0), TableAngles(0, 0, nan)])
def test_a_demand_beyond_a_limit_moves_nothing(quiet_config, angles: TableAngles) -> None:
    bench = build(quiet_config())
    with pytest.raises(OutOfRange, match="is outside"):
        asyncio.run(bench.turntable.move_to(angles))
    assert bench.turntable.read_angles() == TableAngles()
    assert bench.turntable.locked
    assert bench.clock.now_s() == 0.0


@pytest.mark.parametrize("end_deg", [(180.0, -90.0, 45.0), (0.0, 0.0, -3.0), (0.1, 45.0, 135.0)])
def test_a_move_keeps_every_axis_within_its_rate_and_acceleration(end_deg: tuple[float, ...]) -> None:
    bench = default_bench()
    limits = (bench.description.outer, bench.description.middle, bench.description.inner)
    plant = Plant(TableTruth(), bench.site, 0.0, 400.0)
    ticks = move_ticks(np.array(end_deg), limits, 400.0)
    path = plant.run(Quintic(np.zeros(3), DEG * np.array(end_deg), ticks / 400.0), 0, 2 * (ticks + 240)) / DEG
    rate = np.diff(path, axis=0) / plant.step_s
    assert np.max(np.abs(rate)) <= 60.0
    assert np.max(np.abs(np.diff(rate, axis=0))) / plant.step_s <= 100.0
    # 0.6 s after the profile: at rest to a thousandth of an arcsecond.
    np.testing.assert_allclose(path[-1], end_deg, rtol=0, atol=1e-3 / 3600.0)


def test_a_move_ends_at_rest_locked_and_where_it_was_asked(quiet_config) -> None:
    bench = build(quiet_config())
    asyncio.run(bench.turntable.move_to(TableAngles(30, -60, 320)))
    assert bench.turntable.locked
    angles = bench.turntable.read_angles()
    got = (angles.outer_deg, angles.middle_deg, angles.inner_deg)
    np.testing.assert_allclose(got, (30, -60, 320), rtol=0, atol=1.1e-3 / 3600.0)
    np.testing.assert_array_equal(bench.turntable.read_rates_deg_s(), 0.0)
    before = bench.turntable.rest_truth()
    asyncio.run(bench.clock.sleep(100.0))
    np.testing.assert_array_equal(bench.turntable.rest_truth(), before)
    assert bench.turntable.read_angles() == angles


def test_whole_turns_are_counted(quiet_config) -> None:
    bench = build(quiet_config())
    for inner in (390.0, -380.0, 0.0):
        asyncio.run(bench.turntable.move_to(TableAngles(0, 0, inner)))
        assert bench.turntable.read_angles().inner_deg == pytest.approx(inner, abs=1e-6)
    _, force = bench.turntable.rest_truth()
    np.testing.assert_allclose(force, [0, G, 0], rtol=0, atol=1e-7)


def test_a_table_that_does_not_come_to_rest_says_so(quiet_config, monkeypatch) -> None:
    bench = build(quiet_config())
    monkeypatch.setattr("simulators.turntable.device.SETTLED_RATE_RAD_S", 0.0)
    with pytest.raises(NotSettled, match="within 10 s"):
        asyncio.run(bench.turntable.move_to(TableAngles(5, 0, 0)))
    monkeypatch.undo()
    with pytest.raises(DeviceFault, match="wait for the end of its motion"):
        asyncio.run(bench.turntable.move_to(TableAngles(0, 0, 0)))
    asyncio.run(bench.turntable.make_safe())
    assert bench.turntable.locked


def test_an_unstable_plant_is_a_fault_that_stays(quiet_config, monkeypatch) -> None:
    bench = build(quiet_config())
    monkeypatch.setattr(Quintic, "at", lambda _self, t: (np.full((len(t), 3), nan), np.full((len(t), 3), nan)))
    with pytest.raises(DeviceFault, match="unstable"):
        asyncio.run(bench.turntable.move_to(TableAngles(5, 0, 0)))
    monkeypatch.undo()
    with pytest.raises(DeviceFault, match="unstable"):
        asyncio.run(bench.turntable.move_to(TableAngles(5, 0, 0)))
    with pytest.raises(ExceptionGroup, match="could not be made safe"):
        asyncio.run(bench.make_safe())
    assert not bench.supply.is_on()


async def _stop_on_the_way(bench: SimulatedBench, cancel: bool) -> tuple[float, float, BaseException | None]:
    """Start a long move, stop it while it runs; angle at the stop, rate at the stop, what the move raised."""
    move = asyncio.create_task(bench.turntable.move_to(TableAngles(300, 0, 0)))
    while bench.turntable.read_rates_deg_s()[0] < 50.0:
        await asyncio.sleep(0)
    if cancel:
        move.cancel()
        await asyncio.wait([move])
    at, rate = bench.turntable.read_angles().outer_deg, bench.turntable.read_rates_deg_s()[0]
    await bench.make_safe()
    await asyncio.wait([move])
    return at, rate, None if move.cancelled() else move.exception()


@pytest.mark.parametrize("cancel", [True, False])
def test_make_safe_in_the_middle_of_a_move_ramps_down_and_locks(quiet_config, cancel: bool) -> None:
    bench = build(quiet_config())
    at, rate, raised = asyncio.run(_stop_on_the_way(bench, cancel))
    assert bench.turntable.locked
    assert raised is None if cancel else isinstance(raised, Stopped)
    # From rate ω at 98 % of 100 deg/s² the axis runs on by ω²/2a; the servo adds arcseconds, the other task a slice.
    ran_on = bench.turntable.read_angles().outer_deg - at
    assert 0.0 < ran_on < rate**2 / (2 * 98.0) + 0.1 + (0.0 if cancel else 15.0)
    asyncio.run(bench.turntable.move_to(TableAngles()))
    assert bench.turntable.read_angles().outer_deg == pytest.approx(0.0, abs=1e-6)


# Each flaw of 10″ alone (ε); what the unit reads beyond the ideal, by hand with the right hand.
FLAWS = [
    # flaw, angles, change of specific force / (g·ε), change of Earth rate / ε
    ("base_tilt_north_arcsec", TableAngles(), (-1, 0, 0), None),  # y leans north, x dips
    ("base_tilt_east_arcsec", TableAngles(), (0, 0, -1), None),  # y leans east, z dips
    ("azimuth_error_arcsec", TableAngles(), (0, 0, 0), (0, 0, -NORTH)),  # x to the east, z to the south
    ("outer_middle_nonorthogonality_arcsec", TableAngles(), (0, 0, -1), (0, 0, -UP)),  # about x: y turns to z
    ("outer_middle_nonorthogonality_arcsec", TableAngles(0, 90, 0), (0, 0, -1), (0, 0, -UP)),
    ("middle_inner_nonorthogonality_arcsec", TableAngles(), (0, 0, 0), (0, 0, NORTH)),  # about y: x turns down from z
    ("middle_inner_nonorthogonality_arcsec", TableAngles(0, 90, 0), (0, 0, 1), (0, 0, UP)),
    ("middle_inner_nonorthogonality_arcsec", TableAngles(0, 90, 90), (0, 1, 0), (0, UP, 0)),
    ("outer_wobble_arcsec", TableAngles(90, 0, 0), (0, 0, 1), None),  # sways about z of the base
    ("middle_wobble_arcsec", TableAngles(0, 90, 0), (0, 0, -1), (0, 0, -UP)),  # sways about x
    ("inner_wobble_arcsec", TableAngles(0, 0, 90), (0, 0, 0), (0, NORTH, 0)),  # sways about y
]


@pytest.mark.parametrize(("flaw", "angles", "force", "rate"), FLAWS)
def test_every_flaw_has_its_effect_of_first_order(quiet_config, flaw: str, angles: TableAngles, force, rate) -> None:
    ideal, flawed = build(quiet_config()), build(quiet_config(**{flaw: 10.0}))
    for bench in (ideal, flawed):
        asyncio.run(bench.turntable.move_to(angles))
    change = np.subtract(flawed.turntable.rest_truth(), ideal.turntable.rest_truth())
    # Second order is ε² = 2.4e-9 of the vector; the servo's rest 0.001″ = 5e-9, twice.
    np.testing.assert_allclose(change[1] / G, np.multiply(force, TEN), rtol=0, atol=1.5e-8)
    if rate is not None:
        np.testing.assert_allclose(change[0], np.multiply(rate, TEN), rtol=0, atol=1.5e-8 * 7.3e-5)


def test_a_pointing_error_turns_the_unit_but_not_the_encoder(quiet_config) -> None:
    config = quiet_config(pointing_sd_arcsec=10.0)
    bench = build(config)
    asyncio.run(bench.turntable.move_to(TableAngles()))
    _, middle, inner = pointing_error_rad(config.bench.table, config.seed, 1)
    _, force = bench.turntable.rest_truth()
    # Up is y: a turn of the inner axis (x) takes it to −z, of the middle axis (z) to +x.
    np.testing.assert_allclose(force / G, [middle, 1.0, -inner], rtol=0, atol=2e-8)
    assert abs(inner) > ARCSEC / 10
    assert bench.turntable.read_angles().inner_deg == pytest.approx(0.0, abs=1.1e-3 / 3600.0)


def test_pointing_errors_are_new_at_each_move_and_have_their_spread() -> None:
    table = TableTruth(pointing_sd_arcsec=2.0)
    draws = np.array([pointing_error_rad(table, 3, move) for move in range(1, 801)]) / ARCSEC
    assert np.std(draws) == pytest.approx(2.0, rel=0.06)  # 2400 draws: 1.4 %, 4 sigma
    assert np.max(np.abs(np.corrcoef(draws[:-1].T, draws[1:].T) - np.eye(6))) < 4 / np.sqrt(800)


def test_the_numpy_table_is_the_mujoco_table() -> None:
    site = default_bench().site
    rng = np.random.Generator(np.random.Philox(11))
    worst = 0.0
    for seed in range(10):
        outer, middle, inner = rng.uniform(0, 50, 3).tolist()
        table = replace(
            random_table_truth(seed, 100.0, 500.0, 0.0, 100.0),
            outer_wobble_arcsec=outer,
            middle_wobble_arcsec=middle,
            inner_wobble_arcsec=inner,
        )
        azimuth = float(rng.uniform(-180, 180))
        plant = Plant(table, site, azimuth, 400.0)
        for angles in rng.uniform(-pi, pi, (20, 3)):
            plant.put(angles)
            mine = attitude(angles[None], table, azimuth)[0]
            worst = max(worst, float(np.max(np.abs(plant.attitude() - mine))))
            assert np.linalg.det(mine) == pytest.approx(1.0, abs=1e-12)
    assert worst < 1e-9
    rate, force = at_rest(mine[None], site)
    np.testing.assert_allclose(np.linalg.norm(rate), site.earth_rate_rad_s, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(force), site.gravity_m_s2, rtol=1e-12)


def test_true_inputs_are_those_of_the_moved_table(quiet_config) -> None:
    config = quiet_config(azimuth_deg=20.0, pointing_sd_arcsec=5.0, middle_inner_nonorthogonality_arcsec=30.0)
    bench = build(config)
    angles = [TableAngles(10, 20, 30), TableAngles(-50, 90, 200)]
    rate, force = true_inputs(config, angles)
    for i, there in enumerate(angles):
        asyncio.run(bench.turntable.move_to(there))
        np.testing.assert_allclose(bench.turntable.rest_truth()[0], rate[i], rtol=0, atol=1e-8 * 7.3e-5)
        np.testing.assert_allclose(bench.turntable.rest_truth()[1], force[i], rtol=0, atol=1e-8 * G)
