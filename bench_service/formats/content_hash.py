"""Hash that names the content of a recording, however it is cut, compressed or stored.

SHA-256 over one JSON line that describes rate, sample type and channels (name, quantity, unit, scale, offset), and then
the samples, little-endian, row by row. Must not know chunks, files or databases.
"""

import hashlib
import json
from collections.abc import Iterable, Sequence

import numpy as np

from bench_service.formats.chunk import SampleType
from procedures.core.recording import Channel, RawArray


class ContentHash:
    """Running content hash of a recording, while its samples arrive."""

    def __init__(self, channels: Sequence[Channel], rate_hz: float, dtype: SampleType) -> None:
        self._dtype = np.dtype(dtype).newbyteorder("<")
        header = {
            "channels": [[c.name, c.quantity.value, c.unit, float(c.scale), float(c.offset)] for c in channels],
            "dtype": np.dtype(dtype).name,
            "rate_hz": float(rate_hz),
        }
        line = json.dumps(header, sort_keys=True, separators=(",", ":"), ensure_ascii=True) + "\n"
        self._sha = hashlib.sha256(line.encode())

    def update(self, samples: RawArray) -> None:
        """Add samples, shape (n, channels), of the type that was announced."""
        self._sha.update(np.ascontiguousarray(samples, dtype=self._dtype).data)

    def copy(self) -> "ContentHash":
        """Return an independent continuation of the hash."""
        twin = object.__new__(ContentHash)
        twin._dtype = self._dtype
        twin._sha = self._sha.copy()
        return twin

    def hexdigest(self) -> str:
        """Return the hash of all samples so far, as 64 hexadecimal digits."""
        return self._sha.hexdigest()


def content_hash(channels: Sequence[Channel], rate_hz: float, samples: RawArray) -> str:
    """Return the content hash of a recording held in memory, 64 hexadecimal digits."""
    return hash_of_blocks(channels, rate_hz, samples.dtype, [samples])


def hash_of_blocks(channels: Sequence[Channel], rate_hz: float, dtype: SampleType, blocks: Iterable[RawArray]) -> str:
    """Return the content hash of a recording that comes in blocks, shape (n, channels). Raises what `blocks` does."""
    whole = ContentHash(channels, rate_hz, dtype)
    for block in blocks:
        whole.update(block)
    return whole.hexdigest()
