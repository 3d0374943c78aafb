"""Framing of answers: where one answer ends in what has arrived. Buffers are bounded."""

from collections.abc import Callable
from dataclasses import dataclass

LONGEST_ANSWER = 4096


class NoFrame(ValueError):
    """Raised where bytes have arrived that cannot become an answer."""


@dataclass(frozen=True)
class Framing:
    """Finds answers of a text protocol: some bytes of any value, then text up to an ending."""

    ending: bytes
    prefix_bytes: int = 0
    longest: int = LONGEST_ANSWER

    def __post_init__(self) -> None:
        if not self.ending or len(self.ending) > 8 or not 0 <= self.prefix_bytes <= 64:
            raise ValueError(f"{self!r}: the ending has 1 … 8 bytes, the prefix 0 … 64")

    def take(self, buffer: bytearray) -> bytes | None:
        """Remove one answer from the buffer and return it, its ending left out, the prefix kept; None: it is not whole
        yet.

        Raises `NoFrame` where more has arrived than the longest answer has.
        """
        at = buffer.find(self.ending, self.prefix_bytes)
        if at < 0 or at > self.longest:
            if len(buffer) > self.longest:
                raise NoFrame(f"more than {self.longest} bytes came without the end of an answer")
            return None
        answer = bytes(buffer[:at])
        del buffer[: at + len(self.ending)]
        return answer


@dataclass(frozen=True)
class Frames:
    """Finds answers of a binary protocol, by a function that gives the length of the first one."""

    length: Callable[[bytes], int | None]
    """Length of the frame that begins the bytes; None: too little has come to say it. Raises `NoFrame`."""
    longest: int = LONGEST_ANSWER

    def take(self, buffer: bytearray) -> bytes | None:
        """Remove one frame from the buffer and return it; None: it is not whole yet. Raises `NoFrame`."""
        length = self.length(bytes(buffer[: self.longest]))
        if length is None or len(buffer) < length:
            if len(buffer) > self.longest:
                raise NoFrame(f"more than {self.longest} bytes came without the end of a frame")
            return None
        frame = bytes(buffer[:length])
        del buffer[:length]
        return frame
