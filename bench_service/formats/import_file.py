"""Import of recorded files: columns of one or several files become the samples and uniform rate of one recording.

The files are read twice, a block at a time: once to check every number and every time step, once to hand the samples
on. Nothing is interpolated: what does not fit is refused with file, row and the way out, and what is left out or
marked was asked for.
"""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import numpy as np

from bench_service.formats.bounds import Bounds
from bench_service.formats.clock.judgement import ClockFindings
from bench_service.formats.description import ImportDescription
from bench_service.formats.import_request import ImportFile
from bench_service.formats.joined_files import Opened, in_order, joined, opened_files, surveyed
from bench_service.formats.own_exports.recognition import provenance
from bench_service.formats.rebuild import Rebuild
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.recording import Channel, RawArray

_NO_ROWS = np.empty(0, np.int64)


@dataclass(frozen=True)
class ImportedRecording:
    """Files that were checked and fit together: the recording that they give, and its samples."""

    description: ImportDescription
    channels: tuple[Channel, ...]
    rate_hz: float
    count: int
    dtype: type[np.int32] | type[np.float64]
    source: dict[str, Any]
    """File names, their SHA-256, the description, `warnings` and what was found of the clock."""
    _files: tuple[Opened, ...] = field(repr=False)
    _clock: ClockFindings | None = field(repr=False)
    _bounds: Bounds = field(repr=False)

    def blocks(self) -> Iterator[RawArray]:
        """Yield the samples in order, each block (n, channels); reads the files a second time."""
        clock = self._clock
        gone = (_NO_ROWS, _NO_ROWS, _NO_ROWS) if clock is None else (clock.repeats, clock.gaps, clock.lost)
        rebuild = Rebuild(self.description.channels, *gone)
        for parts in joined(self._files, self.description, self._bounds):
            for samples in rebuild.rows(in_order(parts, self.description)):
                yield samples.astype(np.int32) if self.dtype is np.int32 else samples


def read_import(files: Sequence[ImportFile], description: ImportDescription) -> ImportedRecording:
    """Check files against their description, all rows, and return the recording that they give. Raises
    `UnreadableFile`, `UnfitRecording`, `BadParameter`.
    """
    used = {channel.file for channel in description.channels}
    if used != set(range(len(files))):
        raise BadParameter("channels.file", sorted(used), f"every one of the {len(files)} files, numbered from 0")
    prints = [_fingerprint(file.stream) for file in files]
    bounds = Bounds.of(sum(int(p["bytes"]) for p in prints))
    opened = opened_files(files, description.format)
    said = provenance(opened)
    if said.simulated:  # whatever the description says
        description = description.model_copy(update={"simulated": True})
    findings = surveyed(opened, description, bounds)
    second, doubts = _second_clock(opened, description, bounds)
    source: dict[str, Any] = {
        "files": [{"name": file.name, **p} for file, p in zip(files, prints, strict=True)],
        "description": description.declared(),
        "warnings": [*said.warnings, *_said_by_logs(opened), *findings.warnings, *doubts],
    }
    if said.exports:
        source["exports"] = list(said.exports)
    if said.origin is not None:
        source["origin"] = said.origin
    if findings.clock is not None:
        source["clock"] = findings.clock.document
        source["rate_of_time_column_hz"] = findings.clock.rate_hz
    if second is not None:
        source["second_clock"] = second
    return ImportedRecording(
        description=description,
        channels=tuple(channel.channel() for channel in description.channels),
        rate_hz=findings.rate_hz,
        count=findings.count,
        dtype=findings.dtype,
        source=source,
        _files=opened,
        _clock=findings.clock,
        _bounds=bounds,
    )


def _said_by_logs(opened: Sequence[Opened]) -> list[str]:
    return [f"{o.file.name}: {words}" for o in opened if o.log is not None for words in o.log.warnings]


def _second_clock(
    opened: Sequence[Opened], description: ImportDescription, bounds: Bounds
) -> tuple[dict[str, Any] | None, tuple[str, ...]]:
    """Inspect the other clock of a log as the first is; what is wrong with it is no reason to refuse the samples."""
    column = description.second_time_column
    if column is None:
        return None, ()
    asked = description.model_copy(
        update={"time_column": column, "rate_hz": None, "gaps": "mark", "repeats": "drop", "unwrap_clock": True}
    )
    try:
        clock = surveyed(opened, asked, bounds).clock
    except (UnfitRecording, BadParameter) as error:
        return {"column": column, "problem": str(error)}, (f"the second clock {column!r}: {error}",)
    found = {} if clock is None else clock.document
    return {"column": column, **found}, tuple(
        f"the second clock {column!r}: {w}" for w in (clock.warnings if clock else ())
    )


def _fingerprint(stream: BinaryIO) -> dict[str, Any]:
    stream.seek(0)
    digest, size = hashlib.sha256(), 0
    while piece := stream.read(1024 * 1024):
        digest.update(piece)
        size += len(piece)
    return {"sha256": digest.hexdigest(), "bytes": size}
