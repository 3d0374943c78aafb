"""Result of decoding a stream of frames, and the check that none of them is missing."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Decoded:
    """Frames of some bytes, in the order in which they came: samples, counters, status words, and bytes left out."""

    counts: NDArray[np.int32]
    """Raw counts, (n, channels)."""
    counters: Integers
    """Counter of each frame, (n,)."""
    status: Integers
    """Status words of each frame, (n, words)."""
    spoiled: int = 0
    """Number of frames with a wrong checksum, or of places where bytes belong to no frame."""


class StreamDecoder(Protocol):
    """Decoder of a stream of frames; keeps what is not whole yet, which is never more than a few frames. Interface."""

    @property
    def modulus(self) -> int:
        """Number of values of the counter, after which it begins again at 0."""
        ...

    @property
    def step(self) -> int:
        """Step of the counter from one frame to the next."""
        ...

    def feed(self, data: bytes) -> Decoded:
        """Decode the bytes that have come, with those that waited, and return the whole frames."""
        ...

    def invalid(self, status: Integers) -> NDArray[np.bool_]:
        """Mask of the frames that say that their data are not valid, (n,), from status words (n, words)."""
        ...

    def words(self, status: Integers) -> tuple[tuple[str, str, tuple[str, ...]], ...]:
        """Status words (words,) of one frame: name, word in hexadecimal, names of the bits that are set."""
        ...


@dataclass(frozen=True)
class Gap:
    """Place in a stream at which frames are missing, by their counter."""

    at: int
    """Index of the first frame after the gap."""
    last: int
    """Counter of the last frame before it."""
    found: int
    """Counter of the first frame after it."""
    missing: int
    """Number of missing frames, up to whole rounds of the counter."""

    def __str__(self) -> str:
        if self.found == self.last:
            return f"a frame came twice: counter {self.found}"
        number = "at least one frame was" if self.missing == 0 else f"{self.missing} frames were"
        return f"{number} lost: after counter {self.last} came {self.found}"


class Continuity:
    """Checks that a counter continues, over its wrap-around, from one piece of a stream to the next."""

    def __init__(self, modulus: int, step: int = 1) -> None:
        self._modulus, self._step = modulus, step
        self.last: int | None = None

    def check(self, counters: Integers) -> Gap | None:
        """Return the first gap within these counters, or between them and those of the last call; None: nothing is
        missing.
        """
        if len(counters) == 0:
            return None
        before = int(counters[0]) - self._step if self.last is None else self.last
        steps = np.diff(counters, prepend=before) % self._modulus
        wrong = np.flatnonzero(steps != self._step % self._modulus)
        last, self.last = before, int(counters[-1])
        if len(wrong) == 0:
            return None
        at = int(wrong[0])
        former = last if at == 0 else int(counters[at - 1])
        return Gap(at, former, int(counters[at]), max(0, int(steps[at]) // self._step - 1))
