"""The chamber's port and the thermometers: refusals, faults, ticks, checkpoints."""

import asyncio
import json
from dataclasses import replace

import numpy as np
import pytest

from procedures.bench.chamber import Chamber, ChamberReading
from procedures.bench.errors import DeviceFault, Disconnected, OutOfRange
from simulators.chamber.device import SimChamber
from simulators.chamber.thermometers import DISCONNECTED_CODE, Thermometers
from simulators.truth.thermal import ChamberFault, ChamberTruth, ThermometerTruth, UnitThermalTruth


class Ticking:
    """A chamber with a clock of its own."""

    def __init__(
        self, rate_hz: float = 400.0, seed: int = 1, faults: tuple[ChamberFault, ...] = (), **unit: object
    ) -> None:
        self.ticks, self.rate_hz = 0, rate_hz
        truth = replace(UnitThermalTruth(), **unit)
        self.chamber = SimChamber(ChamberTruth(), truth, seed, rate_hz, lambda: self.ticks / rate_hz, faults)

    def go(self, seconds: float):
        ticks = round(seconds * self.rate_hz)
        warmth = self.chamber.advance(ticks)
        self.ticks += ticks
        return warmth

    def command(self, temperature_c: float, ramp_c_min: float = 5.0) -> None:
        asyncio.run(self.chamber.command(temperature_c, ramp_c_min))

    def read(self) -> ChamberReading:
        return asyncio.run(self.chamber.read())


def test_it_is_a_chamber() -> None:
    port: Chamber = Ticking().chamber
    assert (port.limits.minimum_c, port.limits.maximum_c, port.limits.ambient_c) == (-60.0, 100.0, 22.0)


@pytest.mark.parametrize(("temperature", "ramp"), [(-61, 1), (101, 1), (float("nan"), 1), (20, 0), (20, 5.1)])
def test_a_demand_beyond_a_limit_changes_nothing(temperature: float, ramp: float) -> None:
    bench = Ticking()
    with pytest.raises(OutOfRange):
        bench.command(temperature, ramp)
    assert bench.read().target_c is None


def test_it_goes_where_it_is_told_and_made_safe_goes_to_ambient() -> None:
    bench = Ticking()
    bench.command(60.0)
    bench.go(3600)
    reading = bench.read()
    assert reading.time_s == 3600.0
    assert reading.air_c == pytest.approx(60.0, abs=0.1)
    assert (reading.target_c, reading.set_point_c) == (60.0, 60.0)
    asyncio.run(bench.chamber.make_safe())
    bench.go(3600)
    assert bench.read().air_c == pytest.approx(22.0, abs=0.1)


def test_an_open_door_stops_it_and_a_closed_one_does_not_start_it() -> None:
    bench = Ticking()
    bench.command(60.0)
    bench.chamber.set_door(True)
    assert bench.read().target_c is None
    with pytest.raises(DeviceFault, match="door"):
        bench.command(60.0)
    asyncio.run(bench.chamber.make_safe())
    assert bench.read().target_c is None
    bench.chamber.set_door(False)
    assert bench.read().target_c is None


def test_a_tripped_limiter_stays_until_a_person_resets_it() -> None:
    bench = Ticking(faults=(ChamberFault("heater_stuck", 100.0),))
    bench.command(20.0)
    bench.go(99)
    assert bench.read().air_c == pytest.approx(20.0, abs=0.5)
    bench.go(2 * 3600)
    assert bench.read().tripped
    with pytest.raises(DeviceFault, match="limiter"):
        bench.command(20.0)
    asyncio.run(bench.chamber.make_safe())
    bench.chamber.reset_limiter()
    assert not bench.read().tripped


def test_a_lost_link_in_hour_seven_is_said_and_the_air_goes_on() -> None:
    bench = Ticking(rate_hz=1.0, faults=(ChamberFault("link_lost", 7 * 3600.0),))
    bench.command(60.0)
    bench.go(7 * 3600 - 1)
    assert bench.read().air_c == pytest.approx(60.0, abs=0.1)
    bench.go(1)
    for verb in (bench.chamber.read(), bench.chamber.command(20.0, 1.0), bench.chamber.make_safe()):
        with pytest.raises(Disconnected):
            asyncio.run(verb)
    assert bench.go(600).temperatures_c[-1, 0] == pytest.approx(60.0, abs=0.1)


def test_faults_that_do_not_exist_are_refused() -> None:
    with pytest.raises(ValueError, match="fault 'fire'"):
        ChamberFault("fire", 0.0)


def test_time_may_be_cut_anywhere_and_a_checkpoint_goes_on() -> None:
    one, other = Ticking(seed=5), Ticking(seed=5)
    for bench in (one, other):
        bench.command(-20.0)
        bench.chamber.unit_power(True)
    whole = one.go(120.25)
    parts = [other.go(s) for s in (0.5, 0.25, 59.5, 0.0025)]
    woken = Ticking(seed=5)
    woken.ticks = other.ticks
    woken.chamber.resume(json.loads(json.dumps(other.chamber.checkpoint())))
    parts.append(woken.go(120.25 - 60.2525))
    assert np.array_equal(np.concatenate([p.temperatures_c for p in parts]), whole.temperatures_c)
    assert np.array_equal(np.concatenate([p.codes for p in parts]), whole.codes)
    assert whole.end_ticks == tuple(range(400, 48_001, 400))
    assert [len(p.codes) for p in parts] == [0, 0, 60, 0, 60]
    np.testing.assert_array_equal(parts[1].before_c, 22.0)


def test_a_unit_that_is_on_warms_itself() -> None:
    on, off = Ticking(rate_hz=1.0), Ticking(rate_hz=1.0)
    on.chamber.unit_power(True)
    assert on.go(7200).temperatures_c[-1, 2] > off.go(7200).temperatures_c[-1, 2] + 2.0


def test_a_thermometer_lags_as_a_first_order_does() -> None:
    truth = ThermometerTruth(offset_c=0.5, lag_s=20.0, noise_c=0.0, step_c=1e-6)
    sensors = Thermometers([truth] * 5, 1, 20.0)
    t = np.arange(1.0, 301.0)
    ramp = np.repeat(20.0 + 0.1 * t[:, None], 8, axis=1)
    expected = 20.5 + 0.1 * (t - 20.0 * -np.expm1(-t / 20.0))
    np.testing.assert_allclose(sensors.read(0, ramp)[:, 0] * 1e-6, expected, rtol=0, atol=0.6e-6)


def test_codes_are_whole_steps_with_the_noise_of_the_truth() -> None:
    truth = ThermometerTruth(lag_s=0.0, noise_c=0.03, step_c=0.0625)
    codes = Thermometers([truth] * 5, 1, 20.0).read(0, np.full((20_000, 8), 20.01))[:, 1] * 0.0625
    # Rounding of a noise of half a step: mean true to its standard error and the dither's bias of 1e-3 step,
    # variance that of noise and step²/12 to 2·(π·σ/step)² ≈ 2·e^−4.5 of a step²/π².
    assert codes.mean() == pytest.approx(20.01, abs=4 * 0.035 / np.sqrt(20_000) + 1e-3 * 0.0625 + 3e-4)
    assert codes.var() == pytest.approx(0.03**2 + 0.0625**2 / 12, rel=0.05)


def test_a_stuck_and_a_disconnected_thermometer() -> None:
    quiet = ThermometerTruth(noise_c=0.0, lag_s=0.0)
    truths = [replace(quiet, stuck_from_s=50.0), replace(quiet, disconnected_from_s=80.0), quiet, quiet, quiet]
    ramp = np.repeat(20.0 + 0.1 * np.arange(1.0, 101.0)[:, None], 8, axis=1)
    whole = Thermometers(truths, 1, 20.0).read(0, ramp)
    assert np.all(whole[48:, 0] == whole[48, 0])
    assert whole[47, 0] < whole[48, 0]
    assert np.all(whole[79:, 1] == DISCONNECTED_CODE)
    assert whole[78, 1] == whole[78, 2]
    again = Thermometers(truths, 1, 20.0)
    cut = np.concatenate([again.read(0, ramp[:60]), again.read(60, ramp[60:])])
    assert np.array_equal(cut, whole)
