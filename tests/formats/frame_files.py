"""Byte streams of devices with the known motion: frames packed by the published layouts."""

import struct
from collections.abc import Callable
from typing import Any

import numpy as np

from tests.formats.reading import FORCES, RATE_HZ, RATES, ROWS

WEEK, SECOND = 2100, 446_443.0


def novatel_crc(data: bytes) -> int:
    """CRC-32 of NovAtel, bit by bit as its manual has it: polynomial 0xEDB88320, start 0."""
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xEDB88320 if crc & 1 else 0)
    return crc


def rawimusx(angle: float, velocity: float, kind: int = 11) -> bytes:
    """Write logs RAWIMUSX, binary with a short header; increments in counts of `angle` and `velocity`."""
    found = b""
    for row in range(ROWS):
        second = SECOND + row / RATE_HZ
        gx, gy, gz = np.rint(RATES[row] / RATE_HZ / angle).astype(int)
        ax, ay, az = np.rint(FORCES[row] / RATE_HZ / velocity).astype(int)
        body = struct.pack("<BBHdI6i", 0, kind, WEEK, second, 0x00FF, az, -ay, ax, gz, -gy, gx)
        head = struct.pack("<3sBHHI", b"\xaa\x44\x13", len(body), 1462, WEEK, round(second * 1000))
        found += head + body + struct.pack("<I", novatel_crc(head + body))
    return found


def mpeg2_crc(data: bytes) -> int:
    """CRC-32 bit by bit: polynomial 0x04C11DB7, start all ones, not reflected, nothing at the end."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte << 24
        for _ in range(8):
            crc = (crc << 1 ^ (0x04C11DB7 if crc & 0x80000000 else 0)) & 0xFFFFFFFF
    return crc


def stim300(identifier: int = 0x91, line_ends: bool = False, skip: Callable[[int], bool] = lambda row: False) -> bytes:
    """Write datagrams of gyros in 2^-14 deg/s and accelerometers in 2^-19 g; the counter steps by ten at 200 Hz."""
    found = b""
    for row in range(ROWS):
        if skip(row):
            continue
        gyro = b"".join(int(v).to_bytes(3, "big", signed=True) for v in np.rint(np.rad2deg(RATES[row]) * 2**14))
        acc = b"".join(int(v).to_bytes(3, "big", signed=True) for v in np.rint(FORCES[row] / 9.80665 * 2**19))
        body = bytes([identifier]) + gyro + b"\0" + acc + b"\0"
        if identifier == 0xA7:
            temperatures = struct.pack(">3h", *(256 * 30 + k for k in range(3))) + b"\0"
            body += bytes(10) + temperatures * 3
        body += bytes([row * 10 % 256]) + struct.pack(">H", 120)
        padded = body + bytes(-len(body) % 4)
        found += body + struct.pack(">I", mpeg2_crc(padded)) + (b"\r\n" if line_ends else b"")
    return found


def kvh1750() -> bytes:
    """Write frames of format A: rad/s and g as big-endian float32."""
    found = b""
    for row in range(ROWS):
        body = struct.pack(">4s6f2Bh", b"\xfe\x81\xff\x55", *RATES[row], *(FORCES[row] / 9.80665), 0x77, row % 128, 25)
        found += body + struct.pack(">I", mpeg2_crc(body))
    return found


def hg4930(rows: int = ROWS) -> bytes:
    """Write five control messages and one inertial message a row, after the start pattern."""
    found = _summed(struct.pack("<2B6h2H", 14, 1, *(0x5555,) * 6, 0, 0))
    counter = 0
    for row in range(rows):
        head = struct.pack("<6h", *np.rint(RATES[row] / (600 * 2**-20)).astype(int), 1, 2, 3)
        for kind in (1, 1, 1, 1, 1, 2):
            message = struct.pack("<2B", 14, kind) + head + struct.pack("<2H", counter & 3, 0)
            if kind == 2:
                message += struct.pack("<3i", *np.rint(RATES[row] / 100 * 2**33).astype(int))
                message += struct.pack("<3i", *np.rint(FORCES[row] / 100 / 0.3048 * 2**27).astype(int))
            found += _summed(message)
            counter += 1
    return found


def _summed(message: bytes) -> bytes:
    words = struct.unpack(f"<{len(message) // 2}H", message)
    return message + struct.pack("<H", sum(words) & 0xFFFF)


def vectornav() -> bytes:
    """Write $VNIMU messages with their exclusive-or checksum."""
    lines: list[str] = []
    for row in range(ROWS):
        values = [0.1, 0.2, 0.3, *FORCES[row], *RATES[row], 25.0, 101.3]
        body = "VNIMU," + ",".join(f"{v:+010.6f}" for v in values)
        check = 0
        for letter in body.encode():
            check ^= letter
        lines.append(f"${body}*{check:02X}\r\n")
    return "".join(lines).encode()


def imr(order: str = "<", increments: bool = True, gyro: float = 1e-7, acc: float = 1e-6) -> bytes:
    """Write an IMR file by the layout: 512 bytes of header, then a double and six int32 a record."""
    head = struct.pack(
        f"{order}8sbdiidddiid32s4s32s12sb3i354s",
        b"$IMURAW\0",
        0 if order == "<" else 1,
        8.8,
        int(increments),
        int(increments),
        RATE_HZ,
        gyro,
        acc,
        2,
        0,
        0.0,
        b"HG1700",
        b"",
        b"by hand",
        b"",
        0,
        0,
        0,
        0,
        b"",
    )
    assert len(head) == 512
    size = 1.0 / RATE_HZ if increments else 1.0
    records = b""
    for row in range(ROWS):
        angles = np.rint(np.rad2deg(RATES[row]) * size / gyro).astype(int)
        velocities = np.rint(FORCES[row] * size / acc).astype(int)
        records += struct.pack(f"{order}d6i", SECOND + row / RATE_HZ, *angles, *velocities)
    return head + records


FMT = struct.Struct("<2BB2B4s16s64s")


def dataflash(bursts: bool = True) -> bytes:
    """Write a DataFlash log by hand: FMT of itself, IMU of two instances, and a burst of each sensor."""
    found = _fmt(0x80, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    found += _fmt(0x81, 3 + 8 + 1 + 24 + 4, "IMU", "QBfffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,T")
    found += _fmt(
        0x82,
        3 + 8 + 2 + 1 + 1 + 2 + 2 + 8 + 4,
        "ISBH",
        "QHBBHHQf",
        "TimeUS,N,type,instance,mul,smp_cnt,SampleUS,smp_rate",
    )
    found += _fmt(0x83, 3 + 8 + 2 + 2 + 192, "ISBD", "QHHaaa", "TimeUS,N,seqno,x,y,z")
    for row in range(ROWS):
        time_us = 10_000_000 + row * 5000
        for instance, sign in ((0, 1.0), (1, -1.0)):
            values = (*(sign * RATES[row]), *(sign * FORCES[row]), 31.5)
            found += struct.pack("<3BQB7f", 0xA3, 0x95, 0x81, time_us + 100 * instance, instance, *values)
    return found + (_burst(5, 1, RATES * 1000) + _burst(6, 0, FORCES * 100) if bursts else b"")


def _fmt(kind: int, size: int, name: str, form: str, columns: str) -> bytes:
    return FMT.pack(0xA3, 0x95, 0x80, kind, size, name.encode(), form.encode(), columns.encode())


def _burst(number: int, kind: int, counts: Any, parts: int = 4) -> bytes:
    multiplier = 1000 if kind == 1 else 100
    found = struct.pack(
        "<3BQHBBHHQf", 0xA3, 0x95, 0x82, 11_000_000, number, kind, 0, multiplier, 32 * parts, 10_999_000, 1000.0
    )
    for part in range(parts):
        rows = np.rint(counts[32 * part : 32 * part + 32]).astype("<i2")
        found += struct.pack("<3BQHH", 0xA3, 0x95, 0x83, 11_000_000 + part, number, part) + rows.T.tobytes()
    return found
