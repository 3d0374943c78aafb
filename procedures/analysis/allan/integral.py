"""The running sum of a channel from blocks of samples, and the places of its gaps. Bounded memory."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording

Gaps = Literal["refuse", "aware"]
Counts = NDArray[np.int64]

PIECE = 1 << 17
"""Samples handled at once: one megabyte, small enough for the processor's cache."""


@dataclass(frozen=True)
class Piece:
    """Running sums x_k of consecutive k, (n,), with the number of missing samples before each."""

    x: Array
    missing: Counts | None
    """Missing samples before each k, (n,); None while there was none."""


class Integral:
    """The running sum of a channel: ``x_k = Σ_{i<k} (y_i − y_ref)``, x_0 = 0, y a rate.

    The reference y_ref, the first block's mean, changes no difference of second order; it keeps x small. A sample that
    is NaN is a gap: refused, or (``gaps="aware"``) counted in `Piece.missing`; an infinite one is always refused.
    """

    def __init__(self, rate_hz: float, *, increments: bool = False, gaps: Gaps = "refuse") -> None:
        if not 0.0 < rate_hz < float("inf"):
            raise BadParameter("rate_hz", rate_hz, "finite and positive")
        if gaps not in ("refuse", "aware"):
            raise BadParameter("gaps", gaps, "'refuse' or 'aware'")
        self.scale = rate_hz if increments else 1.0
        """Factor from a sample to a rate."""
        self._gaps: Gaps = gaps
        self._last = 0.0
        self._reference: float | None = None
        self._first: float | None = None
        self._varies = False
        self.count = 0
        self.missing = 0
        self.first_missing: int | None = None

    def add(self, block: Array | NDArray[np.int32]) -> Iterator[Piece]:
        """Yield the running sums at the ends of a block's samples (n,), in pieces. Raises `UnfitRecording` for a gap
        that is refused.
        """
        for y in self._pieces(block):
            yield self._piece(y)

    def rates(self, block: Array | NDArray[np.int32]) -> Iterator[Array]:
        """Yield a block's samples less the reference, in pieces, unscaled (see `scale`); only where gaps are
        refused.
        """
        for y in self._pieces(block):
            rates, _ = self._checked(y)
            self.count += len(y)
            yield rates

    def rates_and_sums(self, block: Array | NDArray[np.int32]) -> Iterator[tuple[Array, Piece]]:
        """Yield what `rates` and `add` give of a block, piece by piece; only where gaps are refused."""
        for y in self._pieces(block):
            rates, bad = self._checked(y)
            yield rates, self._summed(rates.copy(), bad)

    @staticmethod
    def _pieces(block: Array | NDArray[np.int32]) -> Iterator[Array]:
        if block.ndim != 1:
            raise BadParameter("samples", block.shape, "one channel, (n,)")
        for start in range(0, len(block), PIECE):
            yield np.asarray(block[start : start + PIECE], dtype=np.float64)

    def check_end(self, expected: int | None = None) -> None:
        """Check the whole channel. Raises `UnfitRecording` where it is constant or its length is not `expected`."""
        if expected is not None and self.count != expected:
            raise UnfitRecording(f"{self.count} samples came where {expected} were announced")
        if not self._varies:
            raise UnfitRecording(f"the channel is constant ({self._first!r}): a stuck channel has no noise to analyse")

    def _checked(self, y: Array) -> tuple[Array, NDArray[np.bool_] | None]:
        """The samples less the reference, zero where one is missing, and the mask of missing ones (None: none)."""
        bad = None if np.isfinite(np.sum(y)) else ~np.isfinite(y)
        if bad is not None and np.any(bad):
            y = self._without(y, bad)
        else:
            bad = None
        good = y if bad is None else y[~bad]
        if len(good):
            if self._reference is None or self._first is None:
                self._reference, self._first = float(np.mean(good)), float(good[0])
            self._varies = self._varies or bool(np.any(good != self._first))
        rates = y - (self._reference or 0.0)
        if bad is not None:
            rates[bad] = 0.0
        return rates, bad

    def _piece(self, y: Array) -> Piece:
        return self._summed(*self._checked(y))

    def _summed(self, x: Array, bad: NDArray[np.bool_] | None) -> Piece:
        x[0] += self._last / self.scale
        np.cumsum(x, out=x)
        x *= self.scale
        self._last = float(x[-1])
        missing = None
        if bad is not None:
            missing = self.missing + np.cumsum(bad)
            self.missing = int(missing[-1])
        elif self.missing:
            missing = np.full(len(x), self.missing)
        self.count += len(x)
        return Piece(x, missing)

    def _without(self, y: Array, bad: NDArray[np.bool_]) -> Array:
        """The samples with gaps counted or refused."""
        first = self.count + int(np.argmax(bad))
        infinite = np.isinf(y)
        if np.any(infinite):
            at = int(np.argmax(infinite))
            raise UnfitRecording(f"sample {self.count + at} is {y[at]}: not a measurement")
        if self._gaps == "refuse":
            raise UnfitRecording(
                f"sample {first} is missing (NaN); close or cut the gap, or ask for gaps='aware', which leaves out "
                "what touches a gap"
            )
        self.first_missing = first if self.first_missing is None else self.first_missing
        return np.where(bad, self._reference or 0.0, y)
