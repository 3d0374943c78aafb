"""Counter at the end of a channel: from increments to whole pulses, nothing lost between them."""

from math import ldexp

import numpy as np
from numpy.typing import NDArray

from procedures.bench.errors import DeviceFault
from simulators.imu.blocks import Blocks, Fixed
from simulators.truth import Array, Vector

FRACTION_BITS = 32
LARGEST_COUNT = 2**26
"""Counts in one sample beyond which the counter overflows."""
LARGEST_STEP = ldexp(float(LARGEST_COUNT), FRACTION_BITS)

Counts = NDArray[np.int32]


class Counter:
    """Three angle or velocity counters. Reading j is ``⌊φ + Θ_j/LSB + d_j⌋``, a count the difference of two readings.

    The sum φ + Θ/LSB is kept in units of 2⁻³² pulse, so that it is exact in any grouping; the rounding of an increment
    to that unit is at most 4e-8 pulse a second at 400 Hz. Sums may wrap round: differences of 32-bit readings do not
    mind, as long as a count is below `LARGEST_COUNT`.
    """

    def __init__(
        self, pulse: Vector, phase: list[int], dither: Blocks | None = None, ahead: list[int] | None = None
    ) -> None:
        """See `resume` for `phase` and `ahead`.

        `pulse`: weight of a count [rate·s]; `dither`: d_j of the reading at the end of each tick, in units of 2⁻³²
        pulse, None: zero.
        """
        self._per_pulse = ldexp(1.0, FRACTION_BITS) / np.array(pulse)[:, None]
        self._dither = dither
        self._work = np.empty((3, 0))
        self._sums: Fixed = np.empty((3, 0), dtype=np.int64)
        self.resume(phase, [0, 0, 0] if ahead is None else ahead)

    @property
    def phase(self) -> list[int]:
        """Return the carried fraction of each channel, 0 … 2³² − 1."""
        return [int(p) & ((1 << FRACTION_BITS) - 1) for p in self._sum]

    @property
    def ahead(self) -> list[int]:
        """Number of pulses by which the dither raised the last reading of each channel: 0, 1 or 2."""
        return [int(a) for a in (self._reading - (self._sum >> FRACTION_BITS).astype(np.int32))]

    def resume(self, phase: list[int], ahead: list[int]) -> None:
        """Go on from carried fractions and from how far the last readings stood above them."""
        self._sum: Fixed = np.array(phase, dtype=np.int64)
        self._reading: Counts = np.array(ahead, dtype=np.int32)

    def count(self, increments: Array, tick: int = 0, out: Counts | None = None) -> Counts:
        """Return the counts of each sample, (3, n), from increments (3, n) [rate·s] of the ticks from `tick` on.

        `out`: where to write them. Raises `DeviceFault` where a sample is too large, with nothing counted.
        """
        ticks = increments.shape[1]
        if self._work.shape[1] != ticks:
            self._work, self._sums = np.empty((3, ticks)), np.empty((3, ticks), dtype=np.int64)
        fixed, sums = self._work, self._sums
        np.multiply(increments, self._per_pulse, out=fixed)
        if not (fixed.max(initial=0.0) < LARGEST_STEP and fixed.min(initial=0.0) > -LARGEST_STEP):
            largest = ldexp(float(np.max(np.abs(fixed))), -FRACTION_BITS)
            raise DeviceFault(f"a sample of {largest:.3g} counts overflows the counter")
        np.copyto(sums, np.rint(fixed, out=fixed), casting="unsafe")
        sums[:, :1] += self._sum[:, None]
        np.cumsum(sums, axis=1, out=sums)
        if ticks > 0:
            self._sum = sums[:, -1].copy()
        if self._dither is not None:
            self._dither.add_to(sums, tick)
        readings = np.empty((3, ticks + 1), dtype=np.int32)
        readings[:, 0] = self._reading
        np.copyto(readings[:, 1:], np.right_shift(sums, FRACTION_BITS, out=sums), casting="same_kind")
        self._reading = readings[:, -1].copy()
        return np.subtract(readings[:, 1:], readings[:, :-1], out=out)
