"""iXCOM frames of an inertial unit: header, payload, status, CRC, all least significant byte first.

Layout and CRC agree with the maker's own client (ixcom 1.3.10).
"""

import struct
from dataclasses import dataclass
from enum import IntEnum

from bench_service.drivers.answers import BadAnswer, Refusal
from bench_service.drivers.protocols.checksums import crc16_xmodem

SYNC = 0x7E
HEADER = struct.Struct("<BBBBHHII")
FOOTER = struct.Struct("<HH")
SHORTEST = HEADER.size + FOOTER.size
LONGEST = 2048
COUNTER_MODULUS = 256
PORT = 3000


class Message(IntEnum):
    """Message ids that are used here."""

    IMURAW = 0x00
    COMMAND = 0xFD
    RESPONSE = 0xFE
    PARAMETER = 0xFF


class Parameter(IntEnum):
    """Numbers of the system parameters that are read."""

    PART = 1
    SERIAL = 2
    FIRMWARE = 5
    MAIN_TIMING = 11
    PRESCALER = 12


class LogCommand(IntEnum):
    """Actions on the list of messages that a channel sends."""

    ADD = 0
    CLEAR_ALL = 4


IMURAW = struct.Struct("<6f")
"""Payload of IMURAW: specific force x, y, z [m/s²], angular rate x, y, z [rad/s]."""
STATUS_BITS = {
    0: "hardware error",
    1: "communication error",
    2: "navigation error",
    3: "calibration error",
    4: "gyro beyond its range",
    5: "accelerometer beyond its range",
    6: "no GNSS solution",
    7: "standby",
    8: "dynamic alignment",
    9: "time not set",
    10: "navigation mode",
    11: "AHRS mode",
}
INVALID = 0b10111011
"""Status bits with which inertial data are not valid: errors of hardware, link and calibration, ranges, standby."""
RESPONSES = (
    "ok",
    "invalid parameter",
    "invalid checksum",
    "invalid log",
    "invalid rate",
    "invalid port",
    "invalid command",
    "invalid id",
    "invalid channel",
    "out of range",
    "log exists",
    "invalid trigger",
    "internal error",
)


@dataclass(frozen=True)
class Frame:
    """One iXCOM frame whose CRC was right, in its parts."""

    message: int
    counter: int
    week: int
    time_s: float
    """Seconds of the week, device's own stamp."""
    payload: bytes
    status: int


def frame_length(data: bytes) -> int | None:
    """Return the length of the frame with which some bytes begin; None: too few of them. Raises `BadAnswer` where none
    begins.
    """
    if len(data) < 6:
        return None
    length = int.from_bytes(data[4:6], "little")
    if data[0] != SYNC or not SHORTEST <= length <= LONGEST:
        raise BadAnswer("no iXCOM frame begins here")
    return length


def frame(data: bytes) -> Frame:
    """Return the parts of one whole frame. Raises `BadAnswer` for a wrong length or CRC."""
    length = frame_length(data)
    if length is None or len(data) != length:
        raise BadAnswer(f"{len(data)} bytes are not a whole frame")
    _, message, counter, _, _, week, second, microsecond = HEADER.unpack_from(data)
    status, crc = FOOTER.unpack_from(data, length - FOOTER.size)
    if crc16_xmodem(data[: length - 2]) != crc:
        raise BadAnswer(f"wrong CRC in the frame with counter {counter}")
    return Frame(message, counter, week, second + 1e-6 * microsecond, data[HEADER.size : length - FOOTER.size], status)


def encode(message: int, counter: int, payload: bytes, status: int = 0) -> bytes:
    """Return the bytes of a frame without a time stamp, as a host sends it. Raises `ValueError` for a payload that is
    too long.
    """
    length = SHORTEST + len(payload)
    if length > LONGEST:
        raise ValueError(f"a payload of {len(payload)} bytes does not fit into a frame")
    head = HEADER.pack(SYNC, message, counter % COUNTER_MODULUS, 0, length, 0, 0, 0)
    body = head + payload + status.to_bytes(2, "little")
    return body + crc16_xmodem(body).to_bytes(2, "little")


def open_channel(counter: int, channel: int) -> bytes:
    """Return the bytes of the command that opens a channel."""
    return encode(Message.COMMAND, counter, struct.pack("<HHHH", 5, 0, 1, channel))


def log(counter: int, command: LogCommand, message: int, divider: int) -> bytes:
    """Return the bytes of the command that changes which messages the channel sends, every `divider`-th of them."""
    return encode(Message.COMMAND, counter, struct.pack("<HHBBHH", 0, 0, message, 0, command, divider))


def request_parameter(counter: int, parameter: int) -> bytes:
    """Return the bytes that ask for a parameter; a response comes first, then the parameter."""
    return encode(Message.PARAMETER, counter, struct.pack("<HBB", parameter, 0, 1))


def response(found: Frame) -> None:
    """Check that a frame is a response that accepts. Raises `Refusal` with its words, `BadAnswer` where the frame is
    none.
    """
    if found.message != Message.RESPONSE or len(found.payload) < 2:
        raise BadAnswer(f"message 0x{found.message:02X} is not a response")
    code = int.from_bytes(found.payload[:2], "little")
    if code != 0:
        words = RESPONSES[code] if code < len(RESPONSES) else "refused"
        raise Refusal(f"{words} (code {code})")


def parameter(found: Frame, number: int) -> bytes:
    """Return the value of a parameter frame. Raises `BadAnswer` where it is another parameter's."""
    if found.message != Message.PARAMETER or len(found.payload) < 4:
        raise BadAnswer(f"message 0x{found.message:02X} is not a parameter")
    which = int.from_bytes(found.payload[:2], "little")
    if which != number:
        raise BadAnswer(f"parameter {which} came where {number} was requested")
    return found.payload[4:]


def text_of(value: bytes) -> str:
    """Return the text of a parameter's value, up to its first zero byte."""
    return value.split(b"\0", 1)[0].decode("latin-1").strip()


def inertial(payload: bytes) -> tuple[float, ...]:
    """Return specific force and angular rate of an IMURAW payload, six numbers. Raises `BadAnswer` for another
    length.
    """
    if len(payload) != IMURAW.size:
        raise BadAnswer(f"a payload of {len(payload)} bytes is not an IMURAW message")
    return IMURAW.unpack(payload)
