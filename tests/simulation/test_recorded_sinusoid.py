"""Recording of a sinusoid: what ended the swing is raised, and soon; readings that no recording holds are refused."""

import asyncio
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from procedures.bench.errors import BenchError, DeviceFault, Disconnected
from procedures.bench.turntable import NO_TRACE, EncoderTrace, TableReading
from procedures.core.recording import Station
from procedures.core.sinusoid import Sinusoid
from procedures.core.table_angles import TableAngles
from procedures.sinusoids import QUIET_S, EncoderRows, record_sinusoid
from simulators.world import build

SWING = Sinusoid("outer", 1.0, 1.0, 40)
RECORD_S = 30.0
BLOCK_S = 0.5
SOON_S = QUIET_S + 2.0 * BLOCK_S + 0.1
"""The readings of the block in which the swing ends are missing, and the table is asked at the end of a block."""


class FailingTable:
    """A table whose sinusoid is ended by a fault at some bench time: no readings, rest, and `settle` raises it."""

    def __init__(self, table: Any, clock: Any, fails_at_s: float, fault: BenchError | None) -> None:
        self._table, self._clock, self._fails_at_s, self._fault = table, clock, fails_at_s, fault

    def __getattr__(self, name: str) -> Any:
        return getattr(self._table, name)

    @property
    def _failed(self) -> bool:
        return self._clock.now_s() >= self._fails_at_s

    def trace(self) -> EncoderTrace:
        fresh = self._table.trace()
        return NO_TRACE if self._failed else fresh

    async def read(self) -> TableReading:
        reading = await self._table.read()
        return replace(reading, moving=False) if self._failed else reading

    async def settle(self) -> None:
        if not self._failed:
            await self._table.settle()
        elif self._fault is not None:
            raise self._fault


def ended(quiet_config: Any, fault: BenchError | None, fails_after_s: float) -> tuple[BenchError, float]:
    """Error that reading the recording raised, and how long after the end of the sinusoid [s]."""
    bench = build(quiet_config())
    bench.imu._tapes._block_s = BLOCK_S
    station = Station(0, "x", TableAngles(), None, 0.0, RECORD_S, sinusoid=SWING)

    async def scene() -> tuple[BenchError, float]:
        await bench.supply.switch_on()
        await bench.turntable.move_to(TableAngles())
        fails_at_s = bench.clock.now_s() + SWING.lead_s + fails_after_s
        table: Any = FailingTable(bench.turntable, bench.clock, fails_at_s, fault)
        stream = await record_sinusoid(replace(bench, turntable=table), station)
        with pytest.raises(BenchError) as raised:
            async for _ in stream.blocks:
                pass
        return raised.value, bench.clock.now_s() - fails_at_s

    return asyncio.run(scene())


@pytest.mark.parametrize(
    "fault",
    [DeviceFault("interlock 1 of the turntable is open"), Disconnected("the line to the turntable is cut")],
)
@pytest.mark.parametrize("fails_after_s", [4.0, 27.0])
def test_what_ended_a_sinusoid_is_raised_and_soon(quiet_config: Any, fault: BenchError, fails_after_s: float) -> None:
    """After `QUIET_S` and two blocks; or, where less than that is left, at the recording's end."""
    found, late_s = ended(quiet_config, fault, fails_after_s)
    assert found is fault
    assert late_s < min(SOON_S, RECORD_S - fails_after_s + 1.0)


def test_a_sinusoid_that_was_over_by_itself_is_said_so(quiet_config: Any) -> None:
    found, late_s = ended(quiet_config, None, 4.0)
    assert "was over before its recording" in str(found)
    assert late_s < SOON_S


def test_a_sinusoid_that_goes_on_is_recorded_to_its_end_while_the_table_swings(quiet_config: Any) -> None:
    bench = build(quiet_config())
    bench.turntable.trace = lambda: NO_TRACE  # type: ignore[method-assign]
    station = Station(0, "x", TableAngles(), None, 0.0, RECORD_S, sinusoid=SWING)

    async def scene() -> int:
        stream = await record_sinusoid(bench, station)
        return sum([len(block) async for block in stream.blocks])

    assert asyncio.run(scene()) == round(RECORD_S * bench.imu.rate_hz)


def test_a_reading_that_took_longer_than_a_recording_holds_is_refused() -> None:
    trace = EncoderTrace(np.array([0.1]), np.zeros((1, 3)), np.array([201.0]))
    with pytest.raises(DeviceFault, match="a reading of the table took 402 s: a recording holds at most 400 s"):
        EncoderRows(0.0, 100.0).next_rows(100, trace)


def test_an_angle_beyond_what_a_recording_holds_is_refused() -> None:
    trace = EncoderTrace(np.array([0.1]), np.array([[0.0, -2001.0, 0.0]]), np.zeros(1))
    with pytest.raises(DeviceFault, match="an encoder reads 2001 deg: a recording holds no such angle"):
        EncoderRows(0.0, 100.0).next_rows(100, trace)
