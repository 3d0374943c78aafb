"""Bytes of a MATLAB variable, plain or packed: read at a place near the beginning, or walked from a place on."""

import os
import tempfile
import weakref
import zlib
from contextlib import suppress
from typing import IO, Any, BinaryIO, Protocol

_PIECE = 256 * 1024
WHOLE_BYTES = 16 * 1024 * 1024
"""Size of a variable that is unpacked at once."""
SPOOLED_BYTES = 1024 * 1024 * 1024
"""Size of a larger variable that is unpacked once into a temporary file, where there is room for it."""
MOST_MARKS = 16
_GLANCE = 4096
"""Number of bytes that are unpacked at once where only the head of a variable is asked for."""


class Walk(Protocol):
    """Reader of a variable's bytes in order, from a place on. Interface."""

    def take(self, size: int) -> bytes:
        """Return the next bytes. Raises `EOFError` where they end."""
        ...


class Source(Protocol):
    """Bytes of one variable of a MATLAB file, plain or packed. Interface."""

    def read(self, at: int, size: int) -> bytes:
        """Return bytes at a place. Raises `EOFError` where they end."""
        ...

    def walk(self, at: int) -> Walk:
        """Return a reader of the bytes in order, from a place on."""
        ...


class Plain:
    """Bytes of a variable that is not packed: a part of the file. Implements `Source`."""

    def __init__(self, stream: BinaryIO, begin: int, length: int) -> None:
        self._stream, self._begin, self._length = stream, begin, length

    def read(self, at: int, size: int) -> bytes:
        """Return `size` bytes at a place. Raises `EOFError` where they end."""
        if at + size > self._length:
            raise EOFError("it ends too early")
        self._stream.seek(self._begin + at)
        return self._stream.read(size)

    def walk(self, at: int) -> "_PlainWalk":
        """Return a reader of the bytes in order, from a place on."""
        return _PlainWalk(self, at)


class _PlainWalk:
    def __init__(self, source: Plain, at: int) -> None:
        self._source, self._at = source, at

    def take(self, size: int) -> bytes:
        data = self._source.read(self._at, size)
        self._at += size
        return data


class Packed:
    """Bytes of a variable packed by zlib. Reading goes forward; a place that lies behind begins again. Implements
    `Source`.
    """

    def __init__(self, stream: BinaryIO, begin: int, length: int, big_endian: bool) -> None:
        self._stream, self._begin, self._length = stream, begin, length
        self._reading = _PackedWalk(stream, begin, length)
        self._whole: bytes | None = None
        self._spool: IO[bytes] | None = None
        self._may_spool = True
        self._marks: list[_PackedWalk] = []
        self.unpacked_bytes = 8 + int.from_bytes(self._reading.glance(0, 8)[4:], "big" if big_endian else "little")

    def read(self, at: int, size: int) -> bytes:
        """Return `size` unpacked bytes at a place. Raises `EOFError`, `zlib.error`."""
        if at < self._reading.at:
            self._reading = _PackedWalk(self._stream, self._begin, self._length)
        if size <= 4096:
            return self._reading.glance(at, size)
        self._reading.skip_to(at)
        return self._reading.take(size)

    def walk(self, at: int) -> Walk:
        """Return a walk from a place on. Raises `EOFError`, `zlib.error`.

        A variable is unpacked once, into memory where it is small, else into a temporary file. Where that has no room
        for it each walk begins at the last mark before its place, so that columns which are asked for in their order
        are skipped once and read once.
        """
        if self.unpacked_bytes <= WHOLE_BYTES:
            if self._whole is None:
                self._whole = _PackedWalk(self._stream, self._begin, self._length).take(self.unpacked_bytes)
            return _WholeWalk(self._whole, at)
        if self._may_spool and (spool := self._spooled()) is not None:
            return _SpooledWalk(self, spool, at)
        nearest = max((m for m in self._marks if m.at <= at), key=lambda m: m.at, default=None)
        found = _PackedWalk(self._stream, self._begin, self._length) if nearest is None else nearest.twin()
        found.skip_to(at)
        self._marks = [*self._marks[-MOST_MARKS:], found.twin()]
        return found

    def _spooled(self) -> IO[bytes] | None:
        """Unpack the variable into a temporary file, once; None where it is too large, or the file cannot be written.
        Raises `EOFError`, `zlib.error`.
        """
        if self._spool is None and self.unpacked_bytes <= SPOOLED_BYTES:
            walk, left = _PackedWalk(self._stream, self._begin, self._length), self.unpacked_bytes
            spool = tempfile.TemporaryFile()  # noqa: SIM115  closed with this reader
            try:
                while left:
                    left -= spool.write(walk.take(min(left, 4 * _PIECE)))
                spool.flush()
                self._spool = spool
                weakref.finalize(self, spool.close)
            except OSError:
                with suppress(OSError):
                    spool.close()
        self._may_spool = self._spool is not None
        return self._spool


class _SpooledWalk:
    def __init__(self, owner: Packed, spool: IO[bytes], at: int) -> None:
        self._owner = owner  # whose end closes the file
        self._spool, self._at = spool, at

    def take(self, size: int) -> bytes:
        data = os.pread(self._spool.fileno(), size, self._at)
        if len(data) < size:
            raise EOFError("it ends too early")
        self._at += size
        return data


class _WholeWalk:
    def __init__(self, data: bytes, at: int) -> None:
        self._data, self._at = data, at

    def take(self, size: int) -> bytes:
        if self._at + size > len(self._data):
            raise EOFError("it ends too early")
        self._at += size
        return self._data[self._at - size : self._at]


class _PackedWalk:
    """Unpacked bytes in order; `at` is the place of the first that is at hand."""

    def __init__(self, stream: BinaryIO, begin: int, length: int) -> None:
        self._stream, self._next, self._end = stream, begin, begin + length
        self._unpacker: Any = zlib.decompressobj()
        self._have = b""
        self.at = 0

    def twin(self) -> "_PackedWalk":
        """Return an independent walk from the same place."""
        other = object.__new__(_PackedWalk)
        other._stream, other._next, other._end = self._stream, self._next, self._end
        other._unpacker, other._have, other.at = self._unpacker.copy(), self._have, self.at
        return other

    def _fill(self, size: int, at_once: int = 4 * _PIECE) -> None:
        parts, have = [self._have], len(self._have)
        while have < size:
            data = self._unpacker.unconsumed_tail
            if not data and self._next < self._end:
                self._stream.seek(self._next)
                data = self._stream.read(min(_PIECE, self._end - self._next))
                self._next += len(data)
            part = self._unpacker.decompress(data, at_once)
            if not part and (self._unpacker.eof or not data):
                break
            parts.append(part)
            have += len(part)
        self._have = b"".join(parts)

    def skip_to(self, at: int) -> None:
        """Leave out the bytes before a place. Raises `EOFError`."""
        while self.at < at:
            step = min(at - self.at, 4 * _PIECE)
            self.take(step)

    def glance(self, at: int, size: int) -> bytes:
        """Return bytes at a place without taking those after it. Raises `EOFError`."""
        self.skip_to(at)
        self._fill(size, _GLANCE)
        if len(self._have) < size:
            raise EOFError("it ends too early")
        return self._have[:size]

    def take(self, size: int) -> bytes:
        """Take the next bytes. Raises `EOFError`."""
        self._fill(size)
        if len(self._have) < size:
            raise EOFError("it ends too early")
        taken, self._have = self._have[:size], self._have[size:]
        self.at += size
        return taken
