"""Shared verbs over a bench: what several procedures do in the same way."""

from collections.abc import AsyncIterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core.recording import Station
from procedures.core.turn import Turn


async def record_station(bench: Bench, station: Station) -> Stream:
    """Power off for as long as the station wants, on (no-op where it is on), move, settle, begin its recording."""
    if station.power_off_s > 0.0:
        await bench.supply.switch_off()
        await bench.clock.sleep(station.power_off_s)
    await bench.supply.switch_on()
    if station.angles is not None:
        await bench.turntable.move_to(station.angles)
    await bench.clock.sleep(station.settle_s)
    return bench.imu.record(station.record_s, station)


async def record_turn(bench: Bench, station: Station) -> Stream:
    """As `record_station`; the station's turn begins with the first reading of the stream and is over before its end.

    When the stream has ended the table is at rest and locked, so that the bench can be left there. Reading it may also
    raise `OutOfRange`, before anything turns, `NotSettled` and `DeviceFault`.
    """
    stream = await record_station(bench, station)
    if station.turn is None:
        return stream
    return replace(stream, blocks=_turning(bench, station.turn, stream.blocks))


async def _turning(
    bench: Bench, turn: Turn, blocks: AsyncIterator[NDArray[np.int32]]
) -> AsyncIterator[NDArray[np.int32]]:
    bench.turntable.command_turn(turn)
    async for block in blocks:
        yield block
    await bench.turntable.settle()
