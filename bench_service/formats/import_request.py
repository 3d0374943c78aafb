"""Values on both sides of an import: a file to read, and what was found in it. Loads no reader."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, BinaryIO, Protocol

import numpy as np

from bench_service.formats.description import ImportDescription
from procedures.core.recording import Channel, RawArray

MOST_FILES = 64
"""Greatest number of files that are joined to one recording."""


@dataclass(frozen=True)
class ImportFile:
    """A file to import: its name for messages, and a stream that can be read repeatedly from the beginning."""

    name: str
    stream: BinaryIO = field(repr=False)


class Imported(Protocol):
    """Files that were checked and fit together, whichever process reads them. Interface."""

    @property
    def description(self) -> ImportDescription: ...
    @property
    def channels(self) -> tuple[Channel, ...]: ...
    @property
    def rate_hz(self) -> float: ...
    @property
    def count(self) -> int: ...
    @property
    def dtype(self) -> type[np.int32] | type[np.float64]: ...
    @property
    def source(self) -> dict[str, Any]:
        """File names, their SHA-256, the description, the findings, as JSON: stored with the recording."""
        ...

    def blocks(self) -> Iterator[RawArray]:
        """Yield the samples in order, each block (n, channels)."""
        ...
