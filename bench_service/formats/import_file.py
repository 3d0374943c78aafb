"""Import of recorded files: columns of one or several files become the samples and uniform rate of one recording.

The files are read twice, a block at a time: once to check every number and every time step, once to hand the samples
on. Nothing is interpolated: what does not fit is refused with file, row and the way out, and what is left out or
marked was asked for.
"""

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from typing import Any, BinaryIO, Protocol

import numpy as np

from bench_service.formats.blocks import Block
from bench_service.formats.bounds import Bounds
from bench_service.formats.clock.judgement import ClockFindings
from bench_service.formats.columnar import columnar_columns, is_columnar
from bench_service.formats.delimited import text_columns
from bench_service.formats.description import ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.rebuild import Rebuild
from bench_service.formats.survey import Survey
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.recording import Channel, RawArray

_NO_ROWS = np.empty(0, np.int64)


@dataclass(frozen=True)
class ImportFile:
    """A file to import: its name for messages, and a stream that can be read repeatedly from the beginning."""

    name: str
    stream: BinaryIO = field(repr=False)


class Imported(Protocol):
    """Files that were checked and fit together, whichever process reads them."""

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
        """File names, their SHA-256, the description, the findings: to be kept with the recording."""
        ...

    def blocks(self) -> Iterator[RawArray]:
        """The samples in order, each block (n, channels)."""
        ...


@dataclass(frozen=True)
class ImportedRecording:
    """Files that were checked and fit together: what a recording of them is, and its samples."""

    description: ImportDescription
    channels: tuple[Channel, ...]
    rate_hz: float
    count: int
    dtype: type[np.int32] | type[np.float64]
    source: dict[str, Any]
    """File names, their SHA-256, the description, `warnings` and what was found of the clock."""
    _files: tuple[ImportFile, ...] = field(repr=False)
    _clock: ClockFindings | None = field(repr=False)
    _bounds: Bounds = field(repr=False)

    def blocks(self) -> Iterator[RawArray]:
        """The samples in order, each block (n, channels)."""
        clock = self._clock
        gone = (_NO_ROWS, _NO_ROWS, _NO_ROWS) if clock is None else (clock.repeats, clock.gaps, clock.lost)
        rebuild = Rebuild(self.description.channels, *gone)
        for parts in _joined(self._files, self.description, self._bounds):
            for samples in rebuild.rows(in_order(parts, self.description)):
                yield samples.astype(np.int32) if self.dtype is np.int32 else samples


def read_import(files: Sequence[ImportFile], description: ImportDescription) -> ImportedRecording:
    """Check files against their description. Raises `UnreadableFile`, `UnfitRecording`, `BadParameter`."""
    used = {channel.file for channel in description.channels}
    if used != set(range(len(files))):
        raise BadParameter("channels.file", sorted(used), f"every one of the {len(files)} files, numbered from 0")
    prints = [_fingerprint(file.stream) for file in files]
    bounds = Bounds.of(sum(int(p["bytes"]) for p in prints))
    with closing(Survey([file.name for file in files], description, bounds)) as survey:
        for parts in _joined(files, description, bounds):
            survey.add(parts, in_order(parts, description))
        findings = survey.findings()
    source: dict[str, Any] = {
        "files": [{"name": file.name, **p} for file, p in zip(files, prints, strict=True)],
        "description": description.declared(),
        "warnings": list(findings.warnings),
    }
    if findings.clock is not None:
        source["clock"] = findings.clock.document
        source["rate_of_time_column_hz"] = findings.clock.rate_hz
    return ImportedRecording(
        description=description,
        channels=tuple(channel.channel() for channel in description.channels),
        rate_hz=findings.rate_hz,
        count=findings.count,
        dtype=findings.dtype,
        source=source,
        _files=tuple(files),
        _clock=findings.clock,
        _bounds=bounds,
    )


def in_order(parts: Sequence[Block], description: ImportDescription) -> Array:
    """The channels' columns out of the files' blocks, in the order of the channels, (n, channels)."""
    if len(parts) == 1:
        return parts[0].values
    next_column = [0] * len(parts)
    columns: list[Array] = []
    for channel in description.channels:
        columns.append(parts[channel.file].values[:, next_column[channel.file]])
        next_column[channel.file] += 1
    return np.column_stack(columns)


def _joined(files: Sequence[ImportFile], description: ImportDescription, bounds: Bounds) -> Iterator[list[Block]]:
    """Blocks of all files side by side, with equal numbers of rows. Raises `UnreadableFile`."""
    readers = [_columns(file, index, description, bounds) for index, file in enumerate(files)]
    waiting = [next(reader, None) for reader in readers]
    rows = 0
    while all(block is not None for block in waiting):
        blocks = [block for block in waiting if block is not None]
        size = min(len(block) for block in blocks)
        rows += size
        yield [block.part(0, size) for block in blocks]
        waiting = [
            block.part(size, len(block)) if len(block) > size else next(reader, None)
            for block, reader in zip(blocks, readers, strict=True)
        ]
    if any(block is not None for block in waiting):
        rest = [
            rows + (0 if block is None else len(block) + sum(len(more) for more in reader))
            for block, reader in zip(waiting, readers, strict=True)
        ]
        counts = ", ".join(f"{file.name} has {count}" for file, count in zip(files, rest, strict=True))
        raise UnreadableFile(files[0].name, f"files that are joined need the same number of rows: {counts}")


def _columns(file: ImportFile, index: int, description: ImportDescription, bounds: Bounds) -> Iterator[Block]:
    columns = description.columns_of(index)
    if is_columnar(file.stream):
        return columnar_columns(file.stream, file.name, columns, description, bounds)
    return text_columns(file.stream, file.name, columns, description, bounds)


def _fingerprint(stream: BinaryIO) -> dict[str, Any]:
    stream.seek(0)
    digest, size = hashlib.sha256(), 0
    while piece := stream.read(1024 * 1024):
        digest.update(piece)
        size += len(piece)
    return {"sha256": digest.hexdigest(), "bytes": size}
