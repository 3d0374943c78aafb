"""Frames of the served unit: iXCOM messages, and frames of whole counts with a file that describes them."""

import struct
from collections.abc import Sequence

from procedures.core.recording import INCREMENTS, Channel

POLYNOMIAL = 0x1021
HEADER = struct.Struct("<BBBBHHII")
SYNC = b"\xeb\x90"
VALID, NOT_YET = 0x0000, 0x0001
STANDBY = 1 << 7


def _table() -> list[int]:
    table: list[int] = []
    for byte in range(256):
        crc = byte << 8
        for _ in range(8):
            crc = ((crc << 1) ^ POLYNOMIAL if crc & 0x8000 else crc << 1) & 0xFFFF
        table.append(crc)
    return table


_TABLE = _table()


def crc16(data: bytes) -> int:
    """CRC of polynomial 0x1021 from 0, byte by byte from a table."""
    crc = 0
    for byte in data:
        crc = (crc << 8 & 0xFF00) ^ _TABLE[crc >> 8 ^ byte]
    return crc


class IxcomFrames:
    """Encoder of IMURAW: specific force [m/s²] and angular rate [rad/s] as 32-bit floats."""

    def __init__(self, channels: Sequence[Channel], rate_hz: float) -> None:
        """Set up; `channels`: gyro x, y, z, accelerometer x, y, z."""
        self.columns = 6
        self._scales = [c.scale * (rate_hz if c.quantity in INCREMENTS else 1.0) for c in channels[:6]]
        self._payload = struct.Struct("<6f")

    def data(self, counter: int, counts: Sequence[int], time_s: float, valid: bool) -> bytes:
        """Return the frame of one sample; `valid`: its status says that the data are valid."""
        values = [count * scale for count, scale in zip(counts, self._scales, strict=True)]
        payload = self._payload.pack(*values[3:], *values[:3])
        return self.message(0x00, counter, payload, time_s, 0 if valid else STANDBY)

    def message(self, message: int, counter: int, payload: bytes, time_s: float = 0.0, status: int = 0) -> bytes:
        """Frame of any message."""
        second = int(time_s)
        length = 16 + len(payload) + 4
        microsecond = int(1e6 * (time_s - second))
        body = HEADER.pack(0x7E, message, counter & 0xFF, 0, length, 2400, second % 604800, microsecond)
        body += payload + struct.pack("<H", status)
        return body + struct.pack("<H", crc16(body))


class CountFrames:
    """Encoder of frames of whole counts: sync, 16-bit counter, status, one 32-bit count a channel, CRC-16."""

    def __init__(self, channels: Sequence[Channel], rate_hz: float, columns: int) -> None:
        self.columns = columns
        self._channels, self._rate_hz = tuple(channels[:columns]), rate_hz
        self._body = struct.Struct(f"<2sHH{columns}i")

    @property
    def length(self) -> int:
        """Length of a frame [bytes]."""
        return self._body.size + 2

    def data(self, counter: int, counts: Sequence[int], time_s: float, valid: bool) -> bytes:
        """Return the frame of one sample; `valid`: its status says that the data are valid."""
        body = self._body.pack(SYNC, counter & 0xFFFF, VALID if valid else NOT_YET, *counts)
        return body + struct.pack("<H", crc16(body))

    def description(self) -> str:
        """Return the TOML file that describes these frames to their reader."""
        length = self.length
        lines = [
            'name = "frames of the simulated unit"',
            'sync = "EB 90"',
            f"length = {length}",
            'byte_order = "little"',
            f"rate_hz = {self._rate_hz!r}",
            'counter = { offset = 2, type = "u16" }',
            f'checksum = {{ kind = "crc16-xmodem", offset = {length - 2} }}',
            "[[status]]",
            'name = "status"\noffset = 4\ntype = "u16"\ninvalid_mask = 1',
            'bits = { 0 = "data not valid" }',
        ]
        for k, channel in enumerate(self._channels):
            lines += ["[[channel]]", f'name = "{channel.name}"', f'quantity = "{channel.quantity.value}"']
            lines += [f'unit = "{channel.unit}"', f"offset = {6 + 4 * k}", 'type = "i32"']
            lines += [f"scale = {channel.scale!r}", f"zero = {channel.offset!r}"]
        return "\n".join(lines) + "\n"
