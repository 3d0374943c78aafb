"""Stuck bits of integer samples, and a resolution coarser than one count, in two's complement."""

import numpy as np
from numpy.typing import NDArray

CROSSINGS = 50
"""Fewest direct crossings of the forbidden half, from sample to sample, that prove a bit to be stuck."""
LEVELS = 16
"""Different values that a channel must take within a piece before a gap among them counts: with two levels, some bits
never change."""
SPREAD = 4
"""Number of different values from which on their common factor counts as a resolution."""
EXAMINED = 1024
"""Samples of a piece in which different values are counted."""


class Bits:
    """The bits of one channel that ever change.

    Values that leave no gap between their least and greatest change every bit below the highest that changes: to pass
    a multiple of 2^j they go from …0111 to …1000. So a bit that never changes below one that does is stuck, provided
    that the signal does move to and fro between the values above and below, sample by sample, and takes many values.
    """

    def __init__(self) -> None:
        self._or, self._and = np.int32(0), np.int32(-1)
        self._crossings: dict[int, int] = {}
        self._levels = 0

    @property
    def changing(self) -> int:
        """Mask of the bits that changed, of 32."""
        return int(self._or ^ self._and) & 0xFFFFFFFF

    @property
    def lowest(self) -> int:
        """The lowest bit that changes; 0 while none does."""
        return max((self.changing & -self.changing).bit_length() - 1, 0)

    def add(self, x: NDArray[np.int32], ones: np.int32, zeros: np.int32) -> None:
        """Take in samples (n,), with the OR `ones` and the AND `zeros` of them all."""
        self._or, self._and = self._or | ones, self._and & zeros
        held = self._held()
        if not held and (self._levels >= SPREAD or not self.lowest):
            return
        self._levels = max(self._levels, len(np.unique(x[:EXAMINED])))
        if held and self._levels >= LEVELS:
            flips = (x[1:] ^ x[:-1]).view(np.uint32)
            for bit in held:
                self._crossings[bit] = self._crossings.get(bit, 0) + int(np.count_nonzero(flips >> np.uint32(bit + 1)))

    def stuck(self) -> dict[int, int]:
        """Return the stuck bits by number, each with the value at which it is stuck."""
        return {b: int(self._or) >> b & 1 for b in self._held() if self._crossings.get(b, 0) >= CROSSINGS}

    def coarse(self) -> int:
        """Return the number of the lowest bits that never change although higher ones do."""
        return self.lowest if self._levels >= SPREAD else 0

    def remainder(self) -> int:
        """Return the constant value of the lowest bits that never change."""
        return int(self._or) & ((1 << self.lowest) - 1)

    def _held(self) -> list[int]:
        """Bits that never changed between two that did."""
        changing = self.changing
        return [b for b in range(self.lowest + 1, changing.bit_length()) if not changing >> b & 1]
