"""The chamber's heat: balances by hand, an independent integrator, limits, faults; chance however time is cut."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from simulators.chamber.network import Step, rates, steady
from simulators.chamber.plant import ChamberPlant
from simulators.truth import TruthError
from simulators.truth.thermal import ChamberTruth, NetworkTruth, ThermometerTruth, random_thermal_truth

CHAMBER, UNIT = ChamberTruth(), NetworkTruth()
HOUR = 3600


def plant(seed: int = 1, **changes: float) -> ChamberPlant:
    return ChamberPlant(replace(CHAMBER, **changes), UNIT, seed)


def derivative(t: float, x: np.ndarray, place_0: float, place_1: float, step_s: float) -> list[float]:
    """Heat flows written out anew, with 300 W of heater, a room of 22 °C and the unit on."""
    air, walls, case, board, block, gx, gy, gz = x
    place = place_0 + (place_1 - place_0) * t / step_s
    into_case = 8.0 * (air + place - case)
    inside = [(board, 0.25, 1.0, 150.0), (block, 1.0, 1.5, 800.0), *((g, 1.2, 4.0, 1500.0) for g in (gx, gy, gz))]
    flows = [g * (case - node) for node, g, _, _ in inside]
    return [
        (300.0 + 60.0 * (walls - air) - into_case) / 8e3,
        (60.0 * (air - walls) + 5.0 * (22.0 - walls)) / 6e4,
        (into_case - sum(flows) + 12.0) / 5e3,
        *((flow + p) / c for flow, (_, _, p, c) in zip(flows, inside, strict=True)),
    ]


@pytest.mark.parametrize("step_s", [1.0, 300.0])
def test_a_step_is_exact(step_s: float) -> None:
    start = np.array([30.0, 25.0, 10.0, 14.0, 5.0, -3.0, 0.0, 8.0])
    found = Step.of(*rates(CHAMBER, UNIT, False), step_s).matrix @ [*start, 300.0, 22.0, 0.4, 1.0, -0.7]
    expected = solve_ivp(derivative, (0.0, step_s), start, "DOP853", args=(0.4, -0.7, step_s), rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(found, expected.y[:, -1], rtol=0, atol=1e-10)


def test_the_steady_state_balances_by_hand() -> None:
    a, b = rates(CHAMBER, UNIT, False)
    air, walls, case, board, block, *gyros = steady(a, b, np.array([0.0, 22.0, 0.0, 1.0]))
    power = 12.0 + 1.0 + 1.5 + 3 * 4.0
    assert walls == pytest.approx(22.0 + power / 5.0)
    assert air == pytest.approx(walls + power / 60.0)
    assert case == pytest.approx(air + power / 8.0)
    assert board == pytest.approx(case + 1.0 / 0.25)
    assert block == pytest.approx(case + 1.5)
    np.testing.assert_allclose(gyros, case + 4.0 / 1.2)


def test_without_power_nothing_leaves_the_room_s_temperature() -> None:
    quiet = plant(place_offset_c=0.0, fluctuation_c=0.0)
    np.testing.assert_allclose(quiet.run(2 * HOUR), 22.0, rtol=0, atol=1e-9)


def test_the_air_follows_the_ramp_and_holds_the_set_point() -> None:
    p = plant()
    p.command(-40.0, 2.0 / 60.0)
    air = p.run(3 * HOUR)[:, 0]
    assert np.abs(np.diff(air)).max() * 60.0 < 2.0 * 1.2  # a regulator overshoots its ramp a little
    end = int(62.0 / 2.0 * 60.0)
    assert np.abs(air[:end] - (22.0 - np.arange(1, end + 1) / 30.0)).max() < 2.0  # less than a minute late
    # The controller's sensor has a noise of 0.01 °C; at the unit's place ±0.5 °C come on top.
    assert np.abs(air[2 * HOUR :] + 40.0).max() < 0.05


def test_air_at_the_unit_wanders_within_its_band_about_its_place() -> None:
    p, seen = plant(), []
    for _ in range(12 * 60):
        p.run(60)
        seen.append(p.state.place_c)
    wander = np.array(seen) - CHAMBER.place_offset_c
    assert np.abs(wander).max() <= CHAMBER.fluctuation_c
    # Uniform in the band: variance 0.5²/3. Correlated over a minute, 720 minutes are some 330 values of kurtosis 1.8:
    # their mean square is known to 5 %.
    assert np.mean(wander**2) == pytest.approx(0.25 / 3.0, rel=0.2)


def test_the_same_seed_gives_the_same_bytes_in_whatever_pieces_and_after_a_resume() -> None:
    whole, cut = plant(7), plant(7)
    for p in (whole, cut):
        p.command(60.0, 5.0 / 60.0)
        p.state.unit_on = True
    expected = whole.run(2000)
    pieces = [cut.run(n) for n in (1, 599, 0, 731)]
    woken = plant(7)
    woken.resume(json.loads(json.dumps(cut.checkpoint())))
    pieces.append(woken.run(669))
    assert np.array_equal(np.concatenate(pieces), expected)
    assert not np.array_equal(plant(8).run(100), plant(7).run(100))


def test_a_stuck_heater_is_cut_off_by_the_limiter_for_good() -> None:
    p = plant()
    p.command(20.0, 0.05)
    p.fail("heater_stuck")
    air = p.run(3 * HOUR)[:, 0]
    assert p.state.tripped
    assert air.max() < CHAMBER.limiter_high_c + 0.5
    assert air[-1] < 60.0
    p.command(60.0, 0.05)
    assert p.run(HOUR)[-1, 0] < air[-1]


def test_lost_cooling_never_reaches_the_cold_and_lost_heating_never_the_heat() -> None:
    for what, target in (("cooling_lost", -40.0), ("heating_lost", 60.0)):
        p = plant()
        p.fail(what)
        p.command(target, 0.05)
        assert np.abs(p.run(2 * HOUR)[:, 0] - 22.0).max() < 1.0


def test_a_stuck_control_sensor_drives_the_air_away_while_it_reads_the_same() -> None:
    p = plant()
    p.fail("control_sensor_stuck")
    before = p.state.control_reading_c
    p.command(60.0, 0.05)
    air = p.run(2 * HOUR)[:, 0]
    assert p.state.control_reading_c == before
    assert air.max() > 80.0


def test_a_weak_plant_never_arrives_and_does_not_wind_up() -> None:
    weak = plant(heating_w=100.0)
    weak.command(60.0, 5.0 / 60.0)
    # 100 W through the walls' 5 W/K: twenty degrees over the room's, and no more.
    assert 35.0 < weak.run(12 * HOUR)[-1, 0] < 22.0 + 100.0 / 5.0 + 100.0 / 60.0 + 0.1
    weak.command(22.0, 5.0 / 60.0)
    assert weak.run(HOUR)[-1, 0] == pytest.approx(22.0, abs=1.0)


def test_an_open_door_lets_the_room_in() -> None:
    shut, opened = plant(), plant()
    for p in (shut, opened):
        p.command(60.0, 5.0 / 60.0)
        p.run(HOUR)
        p.switch_off()
    opened.state.door_open = True
    assert opened.run(600)[-1, 0] < shut.run(600)[-1, 0] - 5.0


def test_truths_out_of_range_are_refused() -> None:
    with pytest.raises(TruthError, match=r"chamber\.fluctuation_c"):
        ChamberTruth(fluctuation_c=-0.1)
    with pytest.raises(TruthError, match="limiter"):
        ChamberTruth(limiter_high_c=50.0)
    with pytest.raises(TruthError, match=r"network\.case_j_k"):
        NetworkTruth(case_j_k=0.0)
    with pytest.raises(TruthError, match=r"thermometer\.step_c"):
        ThermometerTruth(step_c=0.0)


def test_a_drawn_unit_is_another_one_and_always_the_same() -> None:
    assert random_thermal_truth(3) == random_thermal_truth(3)
    assert random_thermal_truth(3) != random_thermal_truth(4)
