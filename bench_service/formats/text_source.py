"""Text of a file as lines of UTF-8 that end with LF: unpacked, decoded, and within the bounds.

Reads gzip, UTF-8 with or without a mark, UTF-16 in both orders, and lines that end with LF, CR LF or CR.
"""

import codecs
import gzip
import zlib
from typing import BinaryIO, cast

from bench_service.formats.bounds import LINE_BYTES, MEGABYTE
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.foreign import foreign_kind

PIECE_BYTES = 1024 * 1024
"""Number of bytes that are unpacked at once."""
GLANCE_BYTES = 64 * 1024
"""Number of bytes from which the encoding is detected."""


class TextSource:
    """Reader of one text from its beginning, unpacked and decoded. `unpacked_bytes` is the most that is unpacked."""

    def __init__(self, stream: BinaryIO, name: str, unpacked_bytes: int) -> None:
        self._name = name
        self._left = unpacked_bytes
        self._allowed = unpacked_bytes
        stream.seek(0)
        start = stream.read(8)
        stream.seek(0)
        self._packed = start[:2] == b"\x1f\x8b"
        self._stream = cast(BinaryIO, gzip.GzipFile(fileobj=stream, mode="rb")) if self._packed else stream
        self._buffer = b""
        self._ended = False
        self._decoder: codecs.IncrementalDecoder | None = None
        self._cr = False
        self._begin()

    def _begin(self) -> None:
        """Detect the encoding of the text. Raises `UnreadableFile` for a file of another kind."""
        glance = b""
        while len(glance) < GLANCE_BYTES and (more := self._read(GLANCE_BYTES - len(glance))):
            glance += more
        kind = foreign_kind(glance[:64])
        if kind is not None:
            raise UnreadableFile(self._name, f"is not delimited text but {kind}")
        encoding = _encoding(glance)
        if encoding is None and 20 * glance[:4096].count(0) > len(glance[:4096]):
            raise UnreadableFile(
                self._name,
                "is not delimited text: it contains zero bytes, as a binary file does; if it is a log, give its format "
                "(format), else export it as text",
            )
        if encoding is not None:
            self._decoder = codecs.getincrementaldecoder(encoding)(errors="replace")
        text = self._decoded(glance.removeprefix(codecs.BOM_UTF8))
        self._cr = b"\n" not in text and b"\r" in text
        self._buffer = self._lines(text)

    def _read(self, size: int) -> bytes:
        try:
            data = self._stream.read(size)
        except (EOFError, zlib.error, gzip.BadGzipFile) as error:
            raise UnreadableFile(
                self._name, f"is a compressed file that is cut off or damaged: copy it again ({error})"
            ) from error
        self._left -= len(data)
        if self._left < 0:
            raise UnreadableFile(
                self._name,
                f"unpacks to more than {self._allowed // MEGABYTE} MB, which is the most for a file of its size: send "
                "it in parts",
            )
        if not data:
            self._ended = True
        return data

    def _decoded(self, data: bytes) -> bytes:
        if self._decoder is None:
            return data
        return self._decoder.decode(data, final=not data).encode("utf-8", errors="replace")

    def _lines(self, text: bytes) -> bytes:
        return text.replace(b"\r", b"\n") if self._cr else text

    def fill(self, size: int) -> None:
        """Read on until at least `size` bytes are buffered, or all that there are."""
        parts, have = [self._buffer], len(self._buffer)
        while have < size and not self._ended:
            part = self._lines(self._decoded(self._read(PIECE_BYTES)))
            parts.append(part)
            have += len(part)
        self._buffer = b"".join(parts)

    def glance(self) -> bytes:
        """Return the buffered text without taking it."""
        return self._buffer

    @property
    def is_over(self) -> bool:
        """True where all remaining text is in memory."""
        return self._ended

    def line(self, number: int) -> bytes:
        """Return the next line with its end; empty at the end of the text. Raises `UnreadableFile` if it has none."""
        self.fill(LINE_BYTES)
        end = self._buffer.find(b"\n", 0, LINE_BYTES) + 1
        if not end and len(self._buffer) >= LINE_BYTES:
            raise too_long(self._name, number)
        taken = self._buffer[: end or len(self._buffer)]
        self._buffer = self._buffer[len(taken) :]
        return taken

    def piece(self, size: int) -> bytes:
        """Return whole lines, about `size` bytes; empty at the end. A line may be cut where it is too long."""
        self.fill(size)
        if self._ended:
            taken, self._buffer = self._buffer, b""
            return taken
        cut = self._buffer.rfind(b"\n") + 1 or len(self._buffer)
        taken, self._buffer = self._buffer[:cut], self._buffer[cut:]
        return taken


def text_of(data: bytes) -> str:
    """Decode some of a text: UTF-8 with or without a mark, or else the code page 1252 of Western Windows."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def too_long(name: str, number: int) -> UnreadableFile:
    """Return the error to raise for a line without an end."""
    return UnreadableFile(name, f"line {number} has more than {LINE_BYTES} bytes: it is not a table of text")


def _encoding(start: bytes) -> str | None:
    """Detect UTF-16 by its mark, or by every second byte being zero; None: text whose delimiters are bytes."""
    if start[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        return "utf-16"
    sample = start[:512]
    if len(sample) >= 8 and sample[1::2].count(0) > 0.9 * len(sample[1::2]) and not sample[::2].count(0):
        return "utf-16-le"
    if len(sample) >= 8 and sample[::2].count(0) > 0.9 * len(sample[::2]) and not sample[1::2].count(0):
        return "utf-16-be"
    return None
