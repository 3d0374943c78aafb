"""Interface of the unit's data link."""

from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from procedures.bench.device import Device, Status
from procedures.core.recording import Channel, Station


@dataclass(frozen=True)
class Stream:
    """Recording in progress: its description, and its raw blocks as they arrive, each (n, channels) int32."""

    channels: tuple[Channel, ...]
    rate_hz: float
    start_s: float
    blocks: AsyncIterator[NDArray[np.int32]]
    station: Station | None = None
    launched_s: float | None = None
    """Bench time at which the unit was switched on for this launch [s]; None where unknown."""


class Imu(Device, Protocol):
    """Data link of the unit, from which recordings are read.

    A unit's link is only listened to. Frames that arrive between two reads are kept by the driver within a bound that
    it states; a frame that is lost, or one more than the bound, raises `Disconnected` naming its counter.
    """

    @property
    def channels(self) -> tuple[Channel, ...]: ...

    @property
    def rate_hz(self) -> float: ...

    def record(self, duration_s: float, station: Station | None = None) -> Stream:
        """Begin a recording of a station now, or of no station (None); time passes while its blocks are read. Exactly
        round(duration_s·rate_hz) samples.

        Returns at once and waits on no line: the first block waits for the first sample. Raises `NotPowered`,
        `Disconnected`, here or from the blocks.
        """
        ...

    def status(self) -> Status:
        """Return the status words of the newest frame, without waiting; empty before the first one, or where there are
        none.
        """
        ...
