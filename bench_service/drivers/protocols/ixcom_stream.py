"""Decoder of a stream of iXCOM frames into counts of inertial data."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bench_service.drivers.answers import BadAnswer
from bench_service.drivers.protocols import ixcom
from bench_service.drivers.protocols.ixcom import Frame, Message
from bench_service.drivers.protocols.stream import Decoded, Integers

LARGEST_COUNT = 2**31 - 1


class IxcomDecoder:
    """Decodes IMURAW; other messages are kept for who asked for them.

    IMURAW holds 32-bit floats; a recording holds counts. A count is the nearest whole number of the channel's declared
    scale, so a scale of a unit that sends whole counts gives them back exactly, up to 2²³.
    """

    modulus = ixcom.COUNTER_MODULUS
    step = 1

    def __init__(self, scales: Sequence[float]) -> None:
        """Set up; `scales`: of gyro x, y, z [rad/s], then accelerometer x, y, z [m/s²] per count."""
        if len(scales) != 6 or not all(np.isfinite(scales)) or any(s == 0.0 for s in scales):
            raise ValueError(f"scales = {list(scales)!r}: six finite numbers, none of them zero")
        self._scales = np.array(scales)
        self._buffer = bytearray()
        self._lost_step = False
        self.others: list[Frame] = []
        """Frames of other messages, the newest sixteen."""

    def begin_with(self, data: bytes) -> None:
        """Keep bytes that came before the stream was listened to; the next `feed` decodes them."""
        self._buffer += data

    @property
    def held(self) -> int:
        """Number of bytes that wait for the rest of their frame: fewer than the longest frame has."""
        return len(self._buffer)

    def feed(self, data: bytes) -> Decoded:
        """Decode the bytes that have come, with those that waited, and return the whole frames. Raises `BadAnswer` for
        a value that no count can hold.
        """
        self._buffer += data
        frames, spoiled = self._whole_frames()
        raw = [f for f in frames if f.message == Message.IMURAW and len(f.payload) == ixcom.IMURAW.size]
        self.others = (self.others + [f for f in frames if f.message != Message.IMURAW])[-16:]
        payload = b"".join(f.payload for f in raw)
        values = np.frombuffer(payload, dtype="<f4").reshape(len(raw), 6).astype(np.float64)
        with np.errstate(invalid="ignore", over="ignore"):
            counts = np.rint(np.concatenate([values[:, 3:], values[:, :3]], axis=1) / self._scales)
            fits = np.abs(counts) <= LARGEST_COUNT
        if not np.all(fits):
            row, column = (int(k) for k in np.argwhere(~fits)[0])
            raise BadAnswer(f"channel {column} of the frame with counter {raw[row].counter} holds no number of counts")
        counters = np.array([f.counter for f in raw], dtype=np.int64)
        status = np.array([f.status for f in raw], dtype=np.int64).reshape(len(raw), 1)
        return Decoded(counts.astype(np.int32), counters, status, spoiled)

    def invalid(self, status: Integers) -> NDArray[np.bool_]:
        """Mask of the frames that say that their data are not valid, see `StreamDecoder`."""
        return (status[:, 0] & ixcom.INVALID) != 0

    def words(self, status: Integers) -> tuple[tuple[str, str, tuple[str, ...]], ...]:
        """Status words of one frame, see `StreamDecoder`."""
        value = int(status[0])
        bits = tuple(ixcom.STATUS_BITS.get(n, f"bit {n}") for n in range(16) if value >> n & 1)
        return (("global status", f"0x{value:04X}", bits),)

    def _whole_frames(self) -> tuple[list[Frame], int]:
        buffer, at, spoiled = self._buffer, 0, 0
        frames: list[Frame] = []
        while len(buffer) - at >= 6:
            try:
                length = ixcom.frame_length(bytes(buffer[at : at + 6]))
                if length is None or len(buffer) - at < length:
                    break
                frames.append(ixcom.frame(bytes(buffer[at : at + length])))
                at += length
                self._lost_step = False
            except BadAnswer:
                if not self._lost_step:
                    spoiled += 1
                    self._lost_step = True
                found = buffer.find(ixcom.SYNC, at + 1)
                at = found if found >= 0 else len(buffer)
        del buffer[:at]
        return frames, spoiled
