"""Recordings from a stream of frames: exact counts, deadlines, power. The part that all unit links share."""

from collections.abc import AsyncIterator, Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from bench_service import wall_clock
from bench_service.drivers.interface.driver import DriverContext, Found
from bench_service.drivers.link.frame_stream import FrameStream, Tape
from bench_service.wall_clock import pause_async
from procedures.bench.device import DeviceIdentity, Status, StatusWord
from procedures.bench.errors import Disconnected, NotPowered, OutOfRange
from procedures.bench.imu import Stream
from procedures.core.recording import Channel, Quantity, Station

HELD_S = 30.0
"""Length of data that may wait to be recorded [s, real time]; beyond it a recording ends."""
MOST_HELD = 1_000_000
"""Largest number of frames that may wait, at the time factor of served simulators."""
BLOCK_S = 0.25
"""Length of a block [s of the unit]."""
READY_S = 2.0
"""Longest wait for a unit's first valid frame after its power-up [s]; one that needs more is given it by a procedure's
`settle_s`."""
LOOK_S = 0.01
"""Pause between two looks at what has come [s]."""


class UnitRecordings:
    """Base of the data links of real units, over a stream of frames: implements `procedures.bench.imu.Imu` but for its
    identity.
    """

    def __init__(
        self,
        stream: FrameStream,
        channels: Sequence[Channel],
        rate_hz: float,
        answer_s: float,
        context: DriverContext,
    ) -> None:
        self._stream, self._answer_s, self._context = stream, answer_s, context
        self._all = tuple(channels)
        self._inertial = [k for k, channel in enumerate(channels) if channel.quantity != Quantity.TEMPERATURE]
        self.channels = tuple(self._all[k] for k in self._inertial)
        self.rate_hz = rate_hz
        self._launched_s: float | None = None

    async def found(self, identity: DeviceIdentity) -> Found:
        """Wait for the first frame where the unit has power, and return identity and status. Raises `Disconnected`
        where none comes in time.
        """
        self._stream.begin()
        until = wall_clock.monotonic_s() + self._answer_s
        while self._context.powered() and self._stream.last_frame_s == 0.0:
            if wall_clock.monotonic_s() > until:
                raise Disconnected(self._silence())
            await pause_async(LOOK_S)
        return Found(identity, self.status())

    async def ready(self) -> None:
        """Wait for a frame that says that its data are valid, at most `READY_S`; a recording refuses those that do not.

        For a unit that was switched on just now. Raises nothing: the recording has the words for what is wrong.
        """
        self._stream.begin()
        since = wall_clock.monotonic_s()
        while self._stream.last_valid_s < since and wall_clock.monotonic_s() < since + READY_S:
            await pause_async(LOOK_S)

    def status(self) -> Status:
        """Return the status words of the newest frame. Implements `Imu.status`."""
        return tuple(StatusWord(name, raw, bits) for name, raw, bits in self._stream.words())

    def record(self, duration_s: float, station: Station | None = None) -> Stream:
        """Begin a recording with the first sample from now on, and return its stream of blocks. Raises `NotPowered`,
        `OutOfRange`. Implements `Imu.record`.
        """
        if not 0.0 <= duration_s < float("inf"):
            raise OutOfRange(f"duration_s = {duration_s!r} must be finite and not negative")
        if not self._context.powered():
            raise NotPowered("the unit is switched off")
        warm = station is not None and station.temperatures
        if warm and len(self._inertial) == len(self._all):
            raise OutOfRange("station.temperatures = True: the frames of this unit hold no temperature")
        columns = None if warm or len(self._inertial) == len(self._all) else self._inertial
        self._stream.begin()
        real_rate_hz = self.rate_hz * self._context.time_factor
        most = max(1, min(MOST_HELD, round(HELD_S * real_rate_hz)))
        start_s = self._context.clock.now_s()
        tape = Tape(most, wall_clock.monotonic_s(), 1.0 / real_rate_hz)
        self._stream.record(tape)
        samples = round(duration_s * self.rate_hz)
        blocks = self._blocks(tape, samples, columns)
        return Stream(self._all if warm else self.channels, self.rate_hz, start_s, blocks, station, None)

    async def _blocks(self, tape: Tape, samples: int, columns: list[int] | None) -> AsyncIterator[NDArray[np.int32]]:
        try:
            while samples > 0:
                least = min(samples, max(1, round(BLOCK_S * self.rate_hz)))
                await self._wait(tape, least)
                block = tape.take(min(samples, tape.held))
                samples -= len(block)
                yield block if columns is None else np.ascontiguousarray(block[:, columns])
        finally:
            self._stream.end(tape)

    async def _wait(self, tape: Tape, least: int) -> None:
        """Wait until a tape holds some frames. Raises what ended the recording."""
        held, until = tape.held, wall_clock.monotonic_s() + self._answer_s
        while tape.held < least:
            if not self._context.powered():
                raise NotPowered("the unit was switched off during its recording")
            if tape.failure is not None:
                raise tape.failure
            if tape.held != held:
                held, until = tape.held, wall_clock.monotonic_s() + self._answer_s
            elif wall_clock.monotonic_s() > until:
                raise Disconnected(self._silence())
            await pause_async(LOOK_S)

    def _silence(self) -> str:
        why = f" ({self._stream.problem})" if self._stream.problem else ""
        return f"{self._stream.named} sent nothing for {self._answer_s:g} s{why}"


def require_channels(declared: Sequence[Channel], found: Sequence[Channel], refuse: Callable[[str], Exception]) -> None:
    """Check that a unit's declared channels are those of its frames, with their scales. Raises what `refuse` makes."""
    by_name = {channel.name: channel for channel in found}
    for channel in declared:
        other = by_name.get(channel.name)
        if other is None:
            raise refuse(f"the unit's channel {channel.name} is not in its frames, which have {', '.join(by_name)}")
        if other != channel:
            raise refuse(f"channel {channel.name}: the unit is declared with {channel}, its frames have {other}")
