"""Values that belong to ticks, made in canonical blocks, so that they do not depend on how time is cut into pieces.

Knows nothing of what the values are.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simulators.truth import Array, KeyedBlocks

Fixed = NDArray[np.int64]
"""Fixed-point numbers; the code that uses them defines the size of one step."""


class Blocks:
    """Three channels of values, one for each tick since power-up, of which the last block that was asked for is kept.

    The block is one array, filled again each time: fresh memory for every block costs more than what is written in it.
    """

    def __init__(self, ticks: int, dtype: type[np.generic], fill: Callable[[int, NDArray[Any]], None]) -> None:
        """Set up; `ticks`: length of a canonical block; `fill(block, values)` writes one into values (3, ticks)."""
        self.ticks = ticks
        self._fill = fill
        self._values: NDArray[Any] = np.zeros((3, ticks), dtype)
        self._block = -1

    def add_to(self, total: Array | Fixed, tick: int) -> None:
        """Add the values of the ticks from `tick` on to `total`, shape (3, n), of the blocks' own dtype."""
        at, ticks = 0, total.shape[1]
        while at < ticks:
            block, begin = divmod(tick + at, self.ticks)
            if block != self._block:
                self.forget()
                self._fill(block, self._values)
                self._block = block
            step = min(ticks - at, self.ticks - begin)
            total[:, at : at + step] += self._values[:, begin : begin + step]
            at += step

    def forget(self) -> None:
        """Discard the kept block, so that the next one is made again."""
        self._block = -1


class Dither:
    """Random part of a counter's dither: the number added to each of its readings before it rounds down.

    Triangular and non-subtractive: the sum of two uniform numbers, each one pulse wide, independent at every reading.
    With it the first two moments of a reading's whole error do not depend on the input (Lipshitz, Wannamaker and
    Vanderkooy, Quantization and Dither: A Theoretical Survey, J. Audio Eng. Soc. 40 (1992) 355): the error is white
    with variance ``LSB²/12 + 2·LSB²/12 = LSB²/4``, whatever the unit feels, exact rest included. The uniform numbers
    have 16 bits, so that two of them cost half a word of the generator; what they leave is a counter of 2⁻¹⁶ pulse.
    """

    WIDTH_BITS = 16

    def __init__(self, key: tuple[int, int, str], ticks: int, fraction_bits: int) -> None:
        """Set up the streams. `key`: seed, launch number, triad; values: multiples of 2^−fraction_bits pulse, 0 … 2."""
        self._streams = [KeyedBlocks(*key, channel, "dither") for channel in range(3)]
        self._words = -(-ticks // 2)
        self._ticks = ticks
        self._shift = fraction_bits - self.WIDTH_BITS
        self.blocks = Blocks(ticks, np.int64, self._fill)

    def _fill(self, block: int, values: Fixed) -> None:
        for stream, row in zip(self._streams, values, strict=True):
            raw = stream.at(block).bit_generator.random_raw(self._words)
            halves = raw.astype("<u8", copy=False).view("<u2")
            np.add(halves[: self._ticks], halves[self._ticks : 2 * self._ticks], out=row, dtype=np.int64)
        values <<= self._shift
