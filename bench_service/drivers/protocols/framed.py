"""Decoder of a stream of frames whose format a file describes."""

import numpy as np
from numpy.typing import NDArray

from bench_service.drivers.protocols.checksums import CHECKSUMS
from bench_service.drivers.protocols.frame_file import SIZES, FrameFormat
from bench_service.drivers.protocols.stream import Decoded, Integers

Bytes = NDArray[np.uint8]


class FramedDecoder:
    """Decodes frames by sync and checksum. Bytes that belong to none are left out and counted. Implements
    `StreamDecoder`.
    """

    def __init__(self, form: FrameFormat) -> None:
        self.form = form
        self._sync = form.sync_bytes
        size, self._sum = CHECKSUMS[form.checksum.kind]
        self._sum_at = slice(form.checksum.offset, form.checksum.offset + size)
        covered = form.checksum.offset - form.checksum.start
        self._padding = bytes(-covered % form.checksum.pad_to)
        self._buffer = bytearray()
        self._lost_step = False

    @property
    def modulus(self) -> int:
        """Number of values of the counter, after which it begins again at 0."""
        return self.form.counter.modulus

    @property
    def step(self) -> int:
        """Step of the counter from one frame to the next."""
        return self.form.counter.step

    @property
    def held(self) -> int:
        """Number of bytes that wait for the rest of their frame: fewer than a frame has."""
        return len(self._buffer)

    def feed(self, data: bytes) -> Decoded:
        """Decode the bytes that have come, with those that waited, and return the whole frames; a cut frame waits for
        the next call.
        """
        self._buffer += data
        frames, spoiled = self._whole_frames()
        block = np.frombuffer(b"".join(frames), dtype=np.uint8).reshape(len(frames), self.form.length)
        counts = np.empty((len(frames), len(self.form.channel)), dtype=np.int32)
        for column, part in enumerate(self.form.channel):
            counts[:, column] = self._integers(block, part.offset, part.type)
        counters = self._integers(block, self.form.counter.offset, self.form.counter.type) % self.modulus
        words = [self._integers(block, part.offset, part.type) for part in self.form.status]
        status = np.stack(words, axis=1) if words else np.empty((len(frames), 0), dtype=np.int64)
        return Decoded(counts, counters, status, spoiled)

    def invalid(self, status: Integers) -> NDArray[np.bool_]:
        """Mask of the frames that say that their data are not valid, see `StreamDecoder`."""
        found = np.zeros(len(status), dtype=np.bool_)
        for column, part in enumerate(self.form.status):
            failed = status[:, column] if part.failed_when == 1 else ~status[:, column]
            found |= (failed & part.invalid_mask) != 0
        return found

    def words(self, status: Integers) -> tuple[tuple[str, str, tuple[str, ...]], ...]:
        """Status words of one frame, see `StreamDecoder`."""
        named: list[tuple[str, str, tuple[str, ...]]] = []
        for part, value in zip(self.form.status, status.tolist(), strict=True):
            width = 8 * SIZES[part.type]
            bits = (part.bits.get(str(n), f"bit {n}") for n in range(width) if value >> n & 1)
            named.append((part.name, f"0x{value:0{width // 4}X}", tuple(bits)))
        return tuple(named)

    def _whole_frames(self) -> tuple[list[bytes], int]:
        """Take the whole frames out of the buffer; and the number of places where bytes belong to none."""
        buffer, length, sync = self._buffer, self.form.length, self._sync
        frames: list[bytes] = []
        at = spoiled = 0
        while len(buffer) - at >= length:
            if buffer.startswith(sync, at):
                frame = bytes(buffer[at : at + length])
                if self._sum_is_right(frame):
                    frames.append(frame)
                    at += length
                    self._lost_step = False
                    continue
            if not self._lost_step:
                spoiled += 1
                self._lost_step = True
            found = buffer.find(sync, at + 1)
            at = found if found >= 0 else max(at + 1, len(buffer) - len(sync) + 1)
        del buffer[:at]
        return frames, spoiled

    def _sum_is_right(self, frame: bytes) -> bool:
        part = self.form.checksum
        covered = frame[part.start : part.offset] + self._padding
        return self._sum(covered) == int.from_bytes(frame[self._sum_at], self.form.byte_order)

    def _integers(self, block: Bytes, offset: int, kind: str) -> Integers:
        """Integers of one field of all frames, (n,)."""
        size = SIZES[kind]
        field = block[:, offset : offset + size]
        if self.form.byte_order == "little":
            field = field[:, ::-1]
        value = np.zeros(len(block), dtype=np.int64)
        for column in range(size):
            value = (value << 8) | field[:, column]
        if kind.startswith("i"):
            value -= (value >> (8 * size - 1)) << (8 * size)
        return value
