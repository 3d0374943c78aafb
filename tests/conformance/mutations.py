"""Answers and frames that are right, and what becomes of them on a bad line."""

from collections.abc import Callable
from typing import Any

import numpy as np

from bench_service.drivers.answers import BadAnswer, Refusal
from bench_service.drivers.link.framing import Framing, NoFrame
from bench_service.drivers.protocols import acutrol, ascii2, ixcom, scpi, simserv
from bench_service.drivers.protocols.frame_file import FrameFormat
from bench_service.drivers.protocols.framed import FramedDecoder
from bench_service.drivers.protocols.ixcom_stream import IxcomDecoder
from procedures.core.recording import Channel, Quantity
from simulators.served.unit_frames import CountFrames, IxcomFrames

DIALECT, LAYOUT = acutrol.Dialect(), ascii2.Layout()
DOCUMENTED = (BadAnswer, Refusal)
"""Errors that a parser may raise, whatever bytes it is given."""
PREFIX = b"\x00\x01\x02\x03\x04\x05\x06\x07"
PARSERS: dict[str, tuple[bytes, tuple[Callable[[bytes], Any], ...]]] = {
    "acutrol": (
        PREFIX + b"12.500000;-3.000000;0.000000;1.000000;0.000000;-0.500000",
        (
            lambda a: acutrol.states(DIALECT, a, 3),
            lambda a: acutrol.identity(DIALECT, a),
            lambda a: acutrol.absolute_limits(DIALECT, a),
            lambda a: acutrol.acknowledged(DIALECT, a),
            lambda a: acutrol.word(DIALECT, a),
            lambda a: acutrol.status_byte(DIALECT, a),
        ),
    ),
    "simserv": (
        b"1\xb623.41",
        (
            simserv.number_of,
            simserv.whole_of,
            simserv.text_of,
            simserv.accepted,
            simserv.status_of,
        ),
    ),
    "ascii2": (
        b"0050.0 0024.6 0080.0 0066.7 0090.0 0090.0 0000.0 0023.8 0000.0 0022.2 0000.0 0025.5 0000.0 0024.4 "
        b"01100000000000000000000000000000",
        (lambda a: ascii2.state(LAYOUT, a), ascii2.acknowledged),
    ),
    "scpi": (
        b'-222,"Data out of range"',
        (scpi.value, scpi.switch, scpi.mode, scpi.error, scpi.no_error, scpi.identity),
    ),
    "ixcom": (
        ixcom.encode(0, 7, ixcom.IMURAW.pack(1.0, 2.0, 3.0, 4.0, 5.0, 6.0)),
        (ixcom.frame, ixcom.frame_length, ixcom.inertial, lambda a: ixcom.response(ixcom.frame(a))),
    ),
}
"""Protocol -> a right answer, and the parsers that may be given it."""
CHANNELS = tuple(
    Channel(name, Quantity.ANGLE_INCREMENT, "rad", 1e-6) for name in ("gyro_x", "gyro_y", "gyro_z")
) + tuple(
    Channel(name, Quantity.VELOCITY_INCREMENT, "m/s", 1e-5)
    for name in ("accelerometer_x", "accelerometer_y", "accelerometer_z")
)


def count_format() -> FrameFormat:
    """Format of the served unit's own frames."""
    import tomllib

    return FrameFormat.model_validate(tomllib.loads(CountFrames(CHANNELS, 400.0, 6).description()))


def right_stream(kind: str, frames: int) -> bytes:
    """Frames of a stream that is right."""
    encoder = IxcomFrames(CHANNELS, 400.0) if kind == "ixcom" else CountFrames(CHANNELS, 400.0, 6)
    return b"".join(encoder.data(k, [k, -k, 2 * k, 3, 4, -5 * k], k / 400.0, True) for k in range(frames))


def decoder(kind: str) -> FramedDecoder | IxcomDecoder:
    """Decoder of a stream."""
    if kind == "ixcom":
        return IxcomDecoder([c.scale * 400.0 for c in CHANNELS])
    return FramedDecoder(count_format())


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """Bytes with one to four faults: changed, lost, added, doubled or cut off."""
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 5))):
        if not out:
            return bytes(out)
        at, kind = int(rng.integers(len(out))), int(rng.integers(5))
        if kind == 0:
            out[at] = int(rng.integers(256))
        elif kind == 1:
            del out[at : at + int(rng.integers(1, 9))]
        elif kind == 2:
            out[at:at] = rng.bytes(int(rng.integers(1, 9)))
        elif kind == 3:
            out[at:at] = out[at : at + int(rng.integers(1, 33))]
        else:
            del out[at:]
    return bytes(out)


def parse_all(protocol: str, answer: bytes) -> int:
    """Give an answer to every parser of a protocol; how many took it. Raises what is not documented."""
    taken = 0
    for parser in PARSERS[protocol][1]:
        try:
            parser(answer)
            taken += 1
        except DOCUMENTED:
            continue
    return taken


def frame_all(data: bytes, prefix: int) -> int:
    """Cut bytes into answers as a line does; the number of answers. The buffer never holds more than it may."""
    framing, buffer, found = Framing(b"\r\n", prefix, longest=256), bytearray(), 0
    for at in range(0, len(data), 64):
        buffer += data[at : at + 64]
        try:
            while framing.take(buffer) is not None:
                found += 1
        except NoFrame:
            buffer.clear()
        assert len(buffer) <= 256 + 64
    return found
