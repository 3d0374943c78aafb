"""A framed link whose file describes NovAtel's RAWIMUSX, against messages of NovAtel's own encoder."""

import subprocess
import tomllib
import zlib

import numpy as np

from bench_service.drivers.protocols.frame_file import FrameFormat
from bench_service.drivers.protocols.framed import FramedDecoder
from bench_service.drivers.protocols.stream import Continuity
from tests.foreign.peer import PEERS, python_of

RAWIMUSX = """
name = "NovAtel RAWIMUSX, short header"
sync = "AA 44 13 28 B6 05"
length = 56
byte_order = "little"
rate_hz = 100.0
counter = { offset = 8, type = "u32", step = 10, begins_again_at = 604_800_000 }
checksum = { kind = "crc32-novatel", offset = 52 }
[[status]]
name = "IMU status"
offset = 24
type = "u32"
"""
ORDER = ("accelerometer_z", "accelerometer_y", "accelerometer_x", "gyro_z", "gyro_y", "gyro_x")
"""Order in the message; the values of y have the other sign."""
NEARLY_A_WEEK_MS = 604_799_800


def _format() -> FrameFormat:
    document = tomllib.loads(RAWIMUSX)
    document["channel"] = [
        {
            "name": name,
            "quantity": "velocity_increment" if name.startswith("a") else "angle_increment",
            "unit": "m/s" if name.startswith("a") else "rad",
            "offset": 28 + 4 * place,
            "type": "i32",
            "scale": (-1.0 if name.endswith("y") else 1.0) * 2.0**-33,
        }
        for place, name in enumerate(ORDER)
    ]
    return FrameFormat.model_validate(document)


def _ascii(ms: int, counts: list[int]) -> str:
    week, seconds = 1692 + ms // 604_800_000, (ms % 604_800_000) / 1000.0
    numbers = ",".join(map(str, counts))
    body = f"RAWIMUSXA,{week},{seconds:.3f};00,11,{week},{seconds:.9f},00000000,{numbers}"
    crc = zlib.crc32(body.encode("ascii"), 0xFFFFFFFF) ^ 0xFFFFFFFF
    return f"%{body}*{crc:08x}\r\n"


def test_messages_of_novatels_own_encoder_are_decoded_over_the_end_of_a_week() -> None:
    python = python_of("edie")
    rng = np.random.Generator(np.random.PCG64(3))
    counts = rng.integers(-(2**31), 2**31, (50, 6))
    given = "".join(_ascii(NEARLY_A_WEEK_MS + 10 * k, row.tolist()) for k, row in enumerate(counts))
    command = [str(python), str(PEERS / "edie_frames.py")]
    done = subprocess.run(command, input=given, capture_output=True, text=True, timeout=60.0, check=True)
    data = b"".join(bytes.fromhex(line) for line in done.stdout.split())
    decoder = FramedDecoder(_format())
    parts = [decoder.feed(data[at : at + 100]) for at in range(0, len(data), 100)]
    np.testing.assert_array_equal(np.concatenate([part.counts for part in parts]), counts)
    assert sum(part.spoiled for part in parts) == 0
    check = Continuity(decoder.modulus, decoder.step)
    assert all(check.check(part.counters) is None for part in parts)
    values = decoder.form.channels[1].value(np.array([1000.0]))
    assert values[0] == -1000.0 * 2.0**-33
