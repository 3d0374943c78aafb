"""Steps on a bench that several procedures share; those in a chamber are in `procedures.chamber_steps`."""

from collections.abc import AsyncGenerator, AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.recursive_bias.dwell import LiveDwell
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.bench.turntable import require_turns_over
from procedures.core.recording import Station
from procedures.core.stop_rule import StopRule
from procedures.core.turn import Turn

Blocks = AsyncIterator[NDArray[np.int32]]


@asynccontextmanager
async def taken(blocks: Blocks) -> AsyncGenerator[Blocks]:
    """Run the block with a stream's blocks; the stream is closed at its end, also where the block stops first."""
    try:
        yield blocks
    finally:
        if isinstance(blocks, AsyncGenerator):
            await blocks.aclose()


async def record_station(bench: Bench, station: Station) -> Stream:
    """Switch off for the station's `power_off_s`, on (no-op where it is on), move, settle, begin its recording.

    A station with a stop rule is recorded until the rule ends it, at most `record_s`.
    """
    if station.power_off_s > 0.0:
        await bench.supply.switch_off()
        await bench.clock.sleep(station.power_off_s)
    await switch_on(bench, station)
    if station.angles is not None:
        await bench.turntable.move_to(station.angles)
    await bench.clock.sleep(station.settle_s)
    stream = bench.imu.record(station.record_s, station)
    if station.until is None:
        return stream
    return replace(stream, blocks=_until_enough(stream, station.until, station.record_s))


async def _until_enough(stream: Stream, rule: StopRule, longest_s: float) -> Blocks:
    """The stream's blocks up to the sample with which the rule ends the dwell."""
    live = LiveDwell(rule, stream.channels, stream.rate_hz, longest_s)
    async with taken(stream.blocks) as blocks:
        async for block in blocks:
            last = live.add(block)
            yield block if last is None else block[:last]
            if last is not None:
                return


async def switch_on(bench: Bench, station: Station) -> None:
    """Switch the unit on at the station's voltage where it names one, and wait; no-op where it is on at that. Raises
    `DeviceFault`, `Disconnected`.
    """
    if station.supply_voltage_v is not None:
        await bench.supply.set_output(station.supply_voltage_v, bench.supply.limits.nominal_a)
    await bench.supply.switch_on()


async def record_turn(bench: Bench, station: Station) -> Stream:
    """Record as `record_station`; the station's turn begins with the stream's first reading and ends before the stream.

    When the stream has ended the table is at rest and locked, so that the bench can be left there. Reading it may also
    raise `OutOfRange`, before anything turns, `NotSettled` and `DeviceFault`.
    """
    stream = await record_station(bench, station)
    if station.turn is None:
        return stream
    return replace(stream, blocks=_turning(bench, station, station.turn, stream))


async def _turning(bench: Bench, station: Station, turn: Turn, stream: Stream) -> Blocks:
    await bench.turntable.command_turn(turn)
    async with taken(stream.blocks) as blocks:
        async for block in blocks:
            yield block
    require_turns_over(station.angles, turn, await bench.turntable.read())
    await bench.turntable.settle()
