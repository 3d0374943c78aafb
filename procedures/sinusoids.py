"""Recording of a unit while the table follows a sinusoid, with the encoder's readings beside its samples."""

from dataclasses import replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.response.trace import ANGLE_STEP_DEG, ENCODER_CHANNELS, NO_READING, TIME_STEP_S
from procedures.bench import Bench
from procedures.bench.errors import DeviceFault
from procedures.bench.imu import Stream
from procedures.bench.turntable import NO_TRACE, EncoderTrace, Turntable, appended
from procedures.core.recording import Station
from procedures.core.sinusoid import Sinusoid
from procedures.steps import Blocks, taken

MOST_ANGLE_DEG = 2000.0
"""Largest angle that the channel of readings holds [deg]."""
AGE = 3
"""Column of the age of a reading."""
OLDEST_S = 200.0
"""Age beyond which a reading is none any more, and largest half interval of one that the channel holds [s]."""
QUIET_S = 5.0
"""Time without a new reading after which the table is asked whether it still swings [s]."""


async def record_sinusoid(bench: Bench, station: Station) -> Stream:
    """Switch on, move, settle, begin the station's sinusoid, wait until it is steady, begin the recording.

    The stream has the unit's channels and `ENCODER_CHANNELS`. When it has ended the table is at rest where the sinusoid
    began. Reading it may raise `DeviceFault` where the sinusoid ended before the recording, and as the devices do: what
    ended a sinusoid is raised within some seconds, not at the end of the recording.
    """
    if station.sinusoid is None or station.angles is None:
        raise DeviceFault(f"station {station.label!r} needs an attitude and a sinusoid")
    await bench.supply.switch_on()
    await bench.turntable.move_to(station.angles)
    await bench.clock.sleep(station.settle_s)
    await bench.turntable.command_sinusoid(station.sinusoid)
    await bench.clock.sleep(station.sinusoid.lead_s)
    bench.turntable.trace()
    stream = bench.imu.record(station.record_s, station)
    blocks = _beside(bench.turntable, station.sinusoid, stream)
    return replace(stream, channels=(*stream.channels, *ENCODER_CHANNELS), blocks=blocks)


async def _beside(table: Turntable, sinusoid: Sinusoid, stream: Stream) -> Blocks:
    """The stream's blocks with the readings beside them; the table rests at their end."""
    rows, asked_s = EncoderRows(stream.start_s, stream.rate_hz), stream.start_s
    async with taken(stream.blocks) as blocks:
        async for block in blocks:
            beside = rows.next_rows(len(block), table.trace())
            if rows.end_s - max(rows.newest_s, asked_s) > QUIET_S:
                asked_s = rows.end_s
                await _require_swinging(table, sinusoid)
            yield np.column_stack([block, beside])
    await _require_swinging(table, sinusoid)
    await table.settle()


async def _require_swinging(table: Turntable, sinusoid: Sinusoid) -> None:
    """Check that the sinusoid goes on. Raises what ended it, `DeviceFault` where it was over by itself."""
    if (await table.read()).moving:
        return
    await table.settle()
    raise DeviceFault(
        f"the sinusoid of the {sinusoid.axis} axis was over before its recording: the unit's samples came too "
        "slowly; give it more time (slack_s)"
    )


class EncoderRows:
    """Puts readings of the table's axes with the samples of a unit, as the channels of `ENCODER_CHANNELS`."""

    def __init__(self, start_s: float, rate_hz: float) -> None:
        """Set up; `start_s`: bench time of the first sample's beginning [s]."""
        self._start_s, self._rate_hz = start_s, rate_hz
        self._rows = 0
        self._kept = NO_TRACE

    @property
    def end_s(self) -> float:
        """Bench time of the end of the last sample [s]."""
        return self._start_s + self._rows / self._rate_hz

    @property
    def newest_s(self) -> float:
        """Bench time of the newest reading [s]; minus infinity before the first one."""
        return float(self._kept.time_s[-1]) if len(self._kept.time_s) else -inf

    def next_rows(self, count: int, fresh: EncoderTrace) -> NDArray[np.int32]:
        """Return the encoder rows of the next samples, (count, 5) counts: the newest reading at each one's end. Raises
        `DeviceFault`.
        """
        ends = self._start_s + (self._rows + 1.0 + np.arange(count)) / self._rate_hz
        self._rows += count
        kept = appended(self._kept, fresh)
        newest = np.searchsorted(kept.time_s, ends + 0.5 * TIME_STEP_S, side="right") - 1
        rows = np.zeros((count, len(ENCODER_CHANNELS)), dtype=np.int32)
        rows[:, AGE] = NO_READING
        age = ends - kept.time_s[newest] if len(kept.time_s) else np.full(count, np.inf)
        known = np.flatnonzero((newest >= 0) & (age <= OLDEST_S))
        angles, within = kept.angles_deg[newest[known]], kept.within_s[newest[known]]
        if np.any(np.abs(angles) > MOST_ANGLE_DEG):
            raise DeviceFault(f"an encoder reads {np.max(np.abs(angles)):g} deg: a recording holds no such angle")
        if np.any(within > OLDEST_S):
            raise DeviceFault(
                f"a reading of the table took {2.0 * np.max(within):g} s: a recording holds at most "
                f"{2.0 * OLDEST_S:g} s"
            )
        times = np.maximum(age[known], 0.0), within
        counts = [angles / ANGLE_STEP_DEG, np.column_stack(times) / TIME_STEP_S]
        rows[known] = np.rint(np.column_stack(counts)).astype(np.int32)
        self._kept = _from(kept, int(newest[-1])) if count and newest[-1] >= 0 else kept
        return rows


def _from(trace: EncoderTrace, first: int) -> EncoderTrace:
    return EncoderTrace(trace.time_s[first:], trace.angles_deg[first:], trace.within_s[first:])
