"""Chunks of bags unpacked, to a size that is known beforehand."""

import bz2
from typing import Any

import pyarrow as pa

from bench_service.formats.bounds import MEGABYTE
from bench_service.formats.errors import UnreadableFile

ZSTD = b"\x28\xb5\x2f\xfd"
"""First bytes of a frame of zstd; no CDR begins so."""
LARGEST_MESSAGE = 16 * MEGABYTE


def unpacked_stream(data: bytes, name: str) -> bytes:
    """Unpack a message whose size is not known, by zstd. Raises `UnreadableFile`."""
    try:
        with pa.CompressedInputStream(pa.BufferReader(data), "zstd") as stream:
            found = stream.read(LARGEST_MESSAGE + 1)
    except (pa.ArrowException, OSError) as error:
        raise UnreadableFile(name, f"a message cannot be unpacked (zstd: {str(error)[:100]})") from error
    if len(found) > LARGEST_MESSAGE:
        raise UnreadableFile(name, f"a message unpacks to more than {LARGEST_MESSAGE // MEGABYTE} MB")
    return found


def unpacked(data: Any, compression: str, size: int, name: str) -> Any:
    """Return a chunk of `size` bytes unpacked: none, lz4, zstd or bz2. Raises `UnreadableFile`."""
    try:
        if compression in ("", "none"):
            return data
        if compression in ("lz4", "zstd"):
            return pa.Codec(compression).decompress(data, size).to_pybytes() if size else b""
        if compression == "bz2":
            found = bz2.BZ2Decompressor().decompress(bytes(data), size)
            if len(found) != size:
                raise OSError(f"{len(found)} bytes where {size} were announced")
            return found
    except (pa.ArrowException, OSError, ValueError, EOFError) as error:
        raise UnreadableFile(name, f"a chunk cannot be unpacked ({compression}: {str(error)[:100]})") from error
    raise UnreadableFile(name, f"has a chunk packed by {compression[:20]!r}; none, lz4, zstd and bz2 are read")
