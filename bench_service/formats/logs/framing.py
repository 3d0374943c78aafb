"""Frames in a stream of bytes: a sync, a length and a checksum; what is between them is skipped and counted."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO, Protocol
from zlib import crc32

from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.table import PIECE_BYTES

AT_ONCE = 16_384
LONGEST = 65_536
_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))


class Framing(Protocol):
    """Rules by which one protocol's frames are found: where one may begin, its length, its checksum. Interface."""

    def next(self, data: bytes, at: int) -> int:
        """Return the place of the next byte at which a frame may begin, from `at` on; −1: there is none."""
        ...

    def length(self, data: bytes, at: int) -> int:
        """Return the length of the frame that begins there; 0: none does; more than there is: it is not whole."""
        ...

    def is_whole(self, frame: bytes) -> bool:
        """Return whether a frame's checksum is right."""
        ...


@dataclass
class Counted:
    """Counts of one pass over a file: frames, wrong checksums, skipped bytes, with their first places."""

    frames: int = 0
    bad: int = 0
    """Frames whose checksum is wrong."""
    first_bad: int = -1
    skipped: int = 0
    """Bytes that belong to no frame."""
    first_skipped: int = -1
    places: int = 0

    def warnings(self, what: str) -> list[str]:
        """Return sentences about the frames and bytes that were left out; empty where none were."""
        found: list[str] = []
        if self.bad:
            share = f"{self.bad} of {self.bad + self.frames}"
            found.append(f"{share} {what} have a wrong checksum and were left out, the first at byte {self.first_bad}")
        if self.skipped:
            found.append(
                f"{self.skipped} bytes in {self.places} {'places' if self.places > 1 else 'place'} belong to no frame "
                f"and were skipped, the first at byte {self.first_skipped}"
            )
        return found


def frames(stream: BinaryIO, framing: Framing, counted: Counted) -> Iterator[list[tuple[int, bytes]]]:
    """Yield the frames with a right checksum, with their places, some thousands at a time."""
    stream.seek(0)
    base, data, kept = 0, b"", list[tuple[int, bytes]]()
    skipping = False
    while True:
        piece = stream.read(PIECE_BYTES)
        data += piece
        at, size = 0, len(data)
        while at < size:
            found = framing.next(data, at)
            stop = size if found < 0 else found
            if stop > at:
                skipping = _skip(counted, base + at, stop - at, skipping)
                at = stop
                continue
            length = framing.length(data, at)
            if length > size - at:
                if piece:
                    break
                length = 0
            frame = data[at : at + length] if length else b""
            if length and framing.is_whole(frame):
                kept.append((base + at, frame))
                counted.frames += 1
                skipping = False
                at += length
                continue
            if length and not skipping:
                counted.bad += 1
                counted.first_bad = base + at if counted.first_bad < 0 else counted.first_bad
            skipping = _skip(counted, base + at, 1, skipping)
            at += 1
        if len(kept) >= AT_ONCE or (not piece and kept):
            yield kept
            kept = []
        base += at
        data = data[at:]
        if not piece:
            return


def _skip(counted: Counted, at: int, count: int, skipping: bool) -> bool:
    counted.skipped += count
    if not skipping:
        counted.places += 1
        counted.first_skipped = at if counted.first_skipped < 0 else counted.first_skipped
    return True


def count_at_start(start: bytes, framing: Framing, most: int = 8) -> int:
    """Return how many whole frames follow one another near the beginning, of a piece that is cut anywhere."""
    at, best, run = 0, 0, 0
    while at < len(start) and best < most:
        found = framing.next(start, at)
        if found < 0:
            break
        run = run if found == at else 0
        at = found
        length = framing.length(start, at)
        if length and at + length <= len(start) and framing.is_whole(start[at : at + length]):
            run += 1
            best = max(best, run)
            at += length
        else:
            run = 0
            at += 1
    return best


def require_frames(counted: Counted, name: str, what: str, hint: str) -> None:
    """Check that a file has frames, and mostly frames. Raises `UnreadableFile`."""
    if counted.frames == 0:
        raise UnreadableFile(name, f"has no whole {what}: {hint}")
    if counted.bad > counted.frames:
        raise UnreadableFile(
            name,
            f"has more {what} with a wrong checksum ({counted.bad}, the first at byte {counted.first_bad}) than with a "
            f"right one ({counted.frames}): {hint}",
        )


def crc32_mpeg2(data: bytes) -> int:
    """Return the CRC-32 of polynomial 0x04C11DB7, start 0xFFFFFFFF, not reflected, nothing at the end.

    It is the reflected CRC of zlib over bytes with their bits reversed, itself reversed.
    """
    value = crc32(data.translate(_REVERSED)) ^ 0xFFFFFFFF
    turned = value.to_bytes(4, "little").translate(_REVERSED)
    return int.from_bytes(turned, "big")
