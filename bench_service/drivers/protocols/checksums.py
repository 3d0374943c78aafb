"""Checksums of frames, by the C code of the standard library."""

import binascii
import zlib
from collections.abc import Callable

_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))


def crc16_xmodem(data: bytes) -> int:
    """Return the CRC-16 of polynomial 0x1021 from 0, not reflected; of ``123456789`` it is 0x31C3."""
    return binascii.crc_hqx(data, 0)


def crc16_ccitt_false(data: bytes) -> int:
    """Return the CRC-16 of polynomial 0x1021 from 0xFFFF, not reflected; of ``123456789`` it is 0x29B1."""
    return binascii.crc_hqx(data, 0xFFFF)


def crc32_mpeg2(data: bytes) -> int:
    """CRC-32 of polynomial 0x04C11DB7 from all ones, neither reflected nor inverted; of ``123456789`` 0x0376E6E7.

    The reflected CRC of bytes whose bits are reversed is this one with its bits reversed.
    """
    reflected = zlib.crc32(data.translate(_REVERSED)) ^ 0xFFFFFFFF
    return int.from_bytes(reflected.to_bytes(4, "little").translate(_REVERSED), "big")


def crc32_ieee(data: bytes) -> int:
    """Return the CRC-32 of zlib; of ``123456789`` it is 0xCBF43926."""
    return zlib.crc32(data)


def crc32_novatel(data: bytes) -> int:
    """Return the CRC-32 of zlib's polynomial from 0, not inverted, as NovAtel's messages have it."""
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


def sum16_words(data: bytes) -> int:
    """Return the sum of the 16-bit words, least significant byte first, overflow left out; a last odd byte is a
    word.
    """
    return (sum(data[0::2]) + 256 * sum(data[1::2])) & 0xFFFF


CHECKSUMS: dict[str, tuple[int, Callable[[bytes], int]]] = {
    "crc16-xmodem": (2, crc16_xmodem),
    "crc16-ccitt-false": (2, crc16_ccitt_false),
    "crc32-mpeg2": (4, crc32_mpeg2),
    "crc32-ieee": (4, crc32_ieee),
    "crc32-novatel": (4, crc32_novatel),
    "sum16-words": (2, sum16_words),
}
"""Name in a frame's file -> (length in bytes, function)."""
