"""Encoders and supply over a recording: means and spreads by numpy, disagreement with the demand, and whole turns."""

import asyncio
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from bench_service.bench.device_log import DeviceLog, require_agreement
from procedures.bench.description import TableAccuracy
from procedures.bench.device import StatusWord
from procedures.bench.environment import EnvironmentReading
from procedures.bench.errors import DeviceFault
from procedures.bench.supply import SupplyReading
from procedures.bench.turntable import TableReading
from procedures.core.measured import MeasuredEnvironment
from procedures.core.recording import Station
from procedures.core.table_angles import TableAngles
from procedures.core.turn import Turn

STATION = Station(0, "o1", TableAngles(10.0, 20.0, 30.0), record_s=10.0)
ARCSEC = 1.0 / 3600.0


class _Bench:
    """Readings of a table and a supply, one a second."""

    def __init__(self, errors: np.ndarray, currents: np.ndarray) -> None:
        self.time_s = 0.0
        self.asked = 0
        self._errors, self._currents = errors, currents
        self.description = SimpleNamespace(accuracy=TableAccuracy(0.0, 1.0, 0.0), devices=())
        self.clock = SimpleNamespace(now_s=lambda: self.time_s)
        self.turntable = SimpleNamespace(read=self._table)
        self.supply = SimpleNamespace(read=self._supply)
        self.environment = SimpleNamespace(read=self._room)
        self.imu = SimpleNamespace(status=lambda: (StatusWord("status", "0x0010", ("gyro failed",)),))

    async def _room(self) -> EnvironmentReading:
        return EnvironmentReading(self.time_s, 20.0 + self.time_s, None, 1004.0)

    async def _table(self) -> TableReading:
        self.asked += 1
        outer, middle, inner = np.array([10.0, 20.0, 30.0]) + self._errors[int(self.time_s)]
        return TableReading(self.time_s, TableAngles(outer, middle, inner), False, (StatusWord("*STB?", "0x00"),))

    async def _supply(self) -> SupplyReading:
        current = float(self._currents[int(self.time_s)])
        return SupplyReading(self.time_s, True, 28.0, current, current > 1.0, False, 28.0, 3.0)


def _watched(bench: _Bench, station: Station = STATION, seconds: int = 10) -> DeviceLog:
    log = DeviceLog(cast(Any, bench), station, 0.0)

    async def look() -> None:
        for quarter in range(4 * seconds):
            bench.time_s = quarter / 4.0
            await log.look()

    asyncio.run(look())
    return log


def test_means_and_spreads_are_those_of_the_readings_once_a_second() -> None:
    rng = np.random.default_rng(5)
    errors, currents = rng.normal(0.0, ARCSEC, (10, 3)), rng.normal(0.9, 0.02, 10)
    bench = _Bench(errors, currents)
    found = _watched(bench).measured()
    assert bench.asked == 10
    assert found.angles is not None
    assert found.supply is not None
    mean, spread = found.angles.mean, found.angles.spread
    np.testing.assert_allclose(
        (mean.outer_deg, mean.middle_deg, mean.inner_deg),
        np.mean(errors, axis=0) + np.array([10.0, 20.0, 30.0]),
        atol=1e-12,
    )
    np.testing.assert_allclose(
        (spread.outer_deg, spread.middle_deg, spread.inner_deg), np.std(errors, axis=0, ddof=1), rtol=1e-9
    )
    assert found.supply.current_a == pytest.approx(np.mean(currents))
    assert found.supply.current_spread_a == pytest.approx(np.std(currents, ddof=1))
    assert (found.supply.limiting, found.supply.readings) == (False, 10)
    assert found.environment == MeasuredEnvironment(24.5, None, 1004.0)  # the mean of 20 … 29
    assert found.status == ("*STB? = 0x00", "status = 0x0010 (gyro failed)")


def test_an_encoder_that_disagrees_with_the_demand_is_a_fault_that_names_the_axis() -> None:
    errors = np.zeros((10, 3))
    errors[4, 1] = 5.0
    with pytest.raises(DeviceFault, match=r"the middle encoder shows 25\.0000 deg where 20 was commanded"):
        _watched(_Bench(errors, np.full(10, 0.9)))


@pytest.mark.parametrize("turns", [-360.0, 360.0, 720.0])
def test_whole_turns_are_no_disagreement(turns: float) -> None:
    require_agreement(TableAngles(0.0, 179.9999, -180.0), _at(turns, -180.0001, 180.0), TableAccuracy())


def test_the_tables_accuracy_decides_above_a_hundredth_of_a_degree() -> None:
    shown = _at(0.02, 0.0, 0.0)
    with pytest.raises(DeviceFault, match="outer"):
        require_agreement(TableAngles(), shown, TableAccuracy(0.0, 1.0, 0.0))
    require_agreement(TableAngles(), shown, TableAccuracy(0.0, 10.0, 0.0))
    with pytest.raises(DeviceFault, match="outer"):
        require_agreement(TableAngles(), _at(float("nan"), 0.0, 0.0), TableAccuracy())


def test_angles_of_a_table_that_turns_or_does_not_carry_the_unit_are_not_read() -> None:
    bench = _Bench(np.full((10, 3), 90.0), np.full(10, 1.2))
    found = _watched(bench, replace(STATION, turn=Turn("inner", 1, 60.0, 1.0))).measured()
    assert (found.angles, bench.asked) == (None, 0)
    assert found.supply is not None
    assert found.supply.limiting


def _at(outer: float, middle: float, inner: float) -> TableReading:
    return TableReading(0.0, TableAngles(outer, middle, inner), False)
