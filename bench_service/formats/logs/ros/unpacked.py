"""Chunks of bags unpacked, to a size that is known beforehand."""

import bz2
from typing import Any

import pyarrow as pa

from bench_service.formats.errors import UnreadableFile


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
