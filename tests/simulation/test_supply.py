"""Simulated supply: settings, measurement, current limit and trip, against Ohm's law."""

import asyncio

import pytest

from procedures.bench.errors import DeviceFault, OutOfRange
from procedures.bench.supply import SupplyLimits, SupplyReading
from simulators.supply.device import SimSupply

LIMITS = SupplyLimits(0.0, 36.0, 5.0, 28.0, 3.0)
LOAD_OHM = 28.0**2 / 24.5


def _supply() -> SimSupply:
    return SimSupply(lambda: 12.5, 24.5, LIMITS)


def _read(supply: SimSupply) -> SupplyReading:
    return asyncio.run(supply.read())


def test_it_measures_what_the_unit_takes() -> None:
    supply = _supply()
    off = _read(supply)
    assert (off.on, off.voltage_v, off.current_a, off.set_voltage_v) == (False, 0.0, 0.0, 28.0)
    asyncio.run(supply.switch_on())
    on = _read(supply)
    assert (on.on, on.limiting, on.voltage_v, on.time_s) == (True, False, 28.0, 12.5)
    assert on.current_a == pytest.approx(0.875)
    asyncio.run(supply.set_output(24.0, 3.0))
    assert _read(supply).current_a == pytest.approx(24.0 / LOAD_OHM)
    assert supply.launches == 1


def test_a_current_limit_lowers_the_voltage() -> None:
    supply = _supply()
    asyncio.run(supply.set_output(28.0, 0.5))
    asyncio.run(supply.switch_on())
    found = _read(supply)
    assert found.limiting
    assert (found.current_a, found.voltage_v) == (0.5, pytest.approx(0.5 * LOAD_OHM))


def test_a_trip_stays_and_no_setting_beyond_a_limit_changes_anything() -> None:
    supply = _supply()
    for voltage, current in ((40.0, 1.0), (28.0, 6.0), (28.0, 0.0)):
        with pytest.raises(OutOfRange):
            asyncio.run(supply.set_output(voltage, current))
    assert (_read(supply).set_voltage_v, _read(supply).set_current_a) == (28.0, 3.0)
    asyncio.run(supply.switch_on())
    supply.trip()
    assert (_read(supply).on, _read(supply).tripped) == (False, True)
    with pytest.raises(DeviceFault, match="a person must reset it"):
        asyncio.run(supply.switch_on())
    woken = _supply()
    woken.resume(supply.checkpoint())
    assert _read(woken) == _read(supply)
