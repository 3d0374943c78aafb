"""The data link of a signal converter on a bench of its own, before final assembly: implements `procedures.bench.imu`.

A current instead of three accelerometers; nothing of the triads is there. ``code = round(K0·Fc·I + N0 + Fs)`` at each
cycle, which is one tick (thesis 3.8); the current's own noise lies over the rounding.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from procedures.bench.device import DeviceIdentity, Status
from procedures.bench.errors import OutOfRange
from procedures.bench.imu import Stream
from procedures.core.recording import AXES, Channel, Quantity, Station
from simulators.clock import SimClock
from simulators.imu.climate import Lengths
from simulators.imu.counter import Counts
from simulators.imu.tape import Tapes
from simulators.truth import Array, UnitTruth, temperature_channels

Codes = Callable[[int, Array, Array], Array]
"""(channel, currents (n,) [mA], board temperatures (n,) [°C]) -> codes a cycle (n,), not yet whole."""
CURRENT_CHANNELS = tuple(Channel(f"converter_{axis}", Quantity.SPECIFIC_FORCE, "count") for axis in AXES)
FULL_SCALE = 2**15 - 1
"""Full scale of the converter's 16 bits; beyond it the code is clipped."""


class ConverterLink:
    """Data link with three channels of codes and the board's own thermometer."""

    def __init__(self, truth: UnitTruth, clock: SimClock, launch: Callable[[], int], codes: Codes) -> None:
        """Connect to the clock; `launch` returns the number of the power-up, 0 while the converter is off."""
        self._clock, self._codes = clock, codes
        self._tapes = Tapes(clock, launch)
        thermometer = next(c for c in temperature_channels(truth) if c.name == "temperature_converter")
        self._channels = (*CURRENT_CHANNELS, thermometer)
        self._serial = truth.serial
        self._ticks = 0

    @property
    def channels(self) -> tuple[Channel, ...]:
        return self._channels

    @property
    def rate_hz(self) -> float:
        return self._clock.rate_hz

    async def identify(self) -> DeviceIdentity:
        """Identity of the simulated unit."""
        return DeviceIdentity("simulated", "signal converter", self._serial)

    def status(self) -> Status:
        """Status words of the newest frame: a simulated unit sends none."""
        return ()

    def power_up(self, _launch: int) -> None:
        """Begin a new launch at tick zero."""
        self._ticks = 0

    def power_down(self) -> None:
        """End the launch; recordings in progress find the converter gone."""
        self._tapes.stop()

    def feel(self, ticks: int, current_ma: Callable[[], Array], lengths: Lengths, board_c: Array, sent: Counts) -> None:
        """Let some ticks pass, in pieces of `lengths` ticks with the board's temperatures `board_c` and the
        thermometer's codes `sent`, both (pieces,); `current_ma` returns the currents, (ticks,).

        Codes are a function of current, temperature and moment alone, so none are made while no recording runs.
        """
        self._ticks += ticks
        if not self._tapes.running:
            return
        current, board = current_ma(), np.repeat(board_c, lengths)
        columns = [np.rint(self._codes(channel, current, board)) for channel in range(len(AXES))]
        counts = np.empty((ticks, len(self._channels)), dtype=np.int32)
        counts[:, : len(AXES)] = np.clip(np.column_stack(columns), -FULL_SCALE - 1, FULL_SCALE)
        counts[:, len(AXES)] = np.repeat(sent, lengths)
        for tape in self._tapes.running:
            tape.put(counts)

    def record(self, duration_s: float, station: Station | None = None) -> Stream:
        """Begin a recording now; time passes while its blocks are read. Implements `Imu.record`.

        Raises `OutOfRange` for a negative duration, and for a station without a current or without temperatures.
        """
        self._tapes.need_power()
        if not 0.0 <= duration_s < float("inf"):
            raise OutOfRange(f"duration_s = {duration_s!r} must be finite and not negative")
        if station is None or station.current_ma is None or not station.temperatures:
            raise OutOfRange("station.current_ma = None: a converter on a bench of its own has no triads to record")
        start = self._clock.ticks
        launched_s = (start - self._ticks) / self.rate_hz
        blocks = self._tapes.blocks(round(duration_s * self.rate_hz), start, len(self._channels))
        return Stream(self._channels, self.rate_hz, start / self.rate_hz, blocks, station, launched_s)

    def checkpoint(self) -> dict[str, Any]:
        """State of the link, from which it can resume."""
        return {"ticks": self._ticks}

    def resume(self, launch: int, state: dict[str, Any]) -> None:
        """Go on with a launch from a checkpoint."""
        if launch:
            self._ticks = int(state["ticks"])
