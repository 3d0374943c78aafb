"""Recorded files coming in: columns of one or several files become the samples and the uniform rate of one recording.

The files are read twice, a block at a time: once to check every number and every time step, once to hand the samples
on. Nothing is interpolated, cut or filled: what does not fit is refused, with file, row and what was expected.
"""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import numpy as np

from bench_service.formats.columnar import columnar_columns, is_columnar
from bench_service.formats.delimited import text_columns
from bench_service.formats.description import ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.time_steps import TimeSteps
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.recording import Channel, RawArray

_INT32 = np.iinfo(np.int32)
STRETCH = 256
"""Steps of time whose mean is compared with that of all: jitter of a fifth of a step is 0.2 % of it."""


@dataclass(frozen=True)
class ImportFile:
    """A file: its name for messages, and a stream that can be read from the beginning again and again."""

    name: str
    stream: BinaryIO = field(repr=False)


@dataclass(frozen=True)
class ImportedRecording:
    """Files that were checked and fit together: what a recording of them is, and its samples."""

    description: ImportDescription
    channels: tuple[Channel, ...]
    rate_hz: float
    count: int
    dtype: type[np.int32] | type[np.float64]
    source: dict[str, Any]
    """File names, their SHA-256, and the description: to be kept with the recording."""
    _files: tuple[ImportFile, ...] = field(repr=False)

    def blocks(self) -> Iterator[RawArray]:
        """The samples in order, each block (n, channels)."""
        for parts in _joined(self._files, self.description):
            samples = _samples(parts, self.description)
            yield samples.astype(np.int32) if self.dtype is np.int32 else samples


def read_import(files: Sequence[ImportFile], description: ImportDescription) -> ImportedRecording:
    """Check files against their description. Raises `UnreadableFile`, `UnfitRecording`, `BadParameter`."""
    used = {channel.file for channel in description.channels}
    if used != set(range(len(files))):
        raise BadParameter("channels.file", sorted(used), f"every one of the {len(files)} files, numbered from 0")
    survey = _Survey(files, description)
    for parts in _joined(files, description):
        survey.add(parts)
    rate_hz = survey.rate_hz()
    source: dict[str, Any] = {
        "files": [{"name": file.name, **_fingerprint(file.stream)} for file in files],
        "description": description.declared(),
    }
    if description.time_column is not None:
        source["rate_of_time_column_hz"] = survey.steps[0].rate_hz()
    return ImportedRecording(
        description=description,
        channels=tuple(channel.channel() for channel in description.channels),
        rate_hz=rate_hz,
        count=survey.count,
        dtype=survey.dtype(),
        source=source,
        _files=tuple(files),
    )


class _Survey:
    """The first pass: what must be known of all samples before the first is stored."""

    def __init__(self, files: Sequence[ImportFile], description: ImportDescription) -> None:
        self._files = files
        self._description = description
        self.count = 0
        self.steps = [TimeSteps(file.name, description.gap_tolerance) for file in files]
        self._stretches = _Stretches(files[0].name, description)
        self._integral = True
        self._outside: str | None = None

    def add(self, parts: Sequence[Array]) -> None:
        """Check the next rows of every file."""
        if self._description.time_column is not None:
            scale = self._description.time_scale_s
            for steps, part in zip(self.steps, parts, strict=True):
                steps.add(part[:, 0] * scale)
            for steps in self.steps[1:]:
                steps.agree_with(self.steps[0])
            self._stretches.add(parts[0][:, 0] * scale)
        samples = _samples(parts, self._description)
        if self._integral and not np.array_equal(samples, np.rint(samples)):
            self._integral = False
        if self._integral and self._outside is None:
            outside = np.argwhere((samples < _INT32.min) | (samples > _INT32.max))
            if len(outside):
                row, column = (int(index) for index in outside[0])
                channel = self._description.channels[column]
                self._outside = (
                    f"{self._files[channel.file].name}: row {self.count + row + 1}, channel {channel.name!r}: "
                    f"{samples[row, column]:.0f} does not fit 32 bits; counts between {_INT32.min} and {_INT32.max} "
                    "are expected"
                )
        self.count += len(samples)

    def dtype(self) -> type[np.int32] | type[np.float64]:
        """Integers where all values are; raises `UnfitRecording` where one does not fit."""
        if self._integral and self._outside is not None:
            raise UnfitRecording(self._outside)
        return np.int32 if self._integral else np.float64

    def rate_hz(self) -> float:
        """The rate that was declared, or that of the time column.

        Raises `BadParameter`, `UnreadableFile`, and `UnfitRecording` where the time column's own rate wanders.
        """
        declared = self._description.rate_hz
        if not self.count:
            raise UnreadableFile(self._files[0].name, "has no rows of data")
        if self._description.time_column is None:
            return float(declared or 0.0)
        measured = self.steps[0].rate_hz()
        self._stretches.require(measured)
        if declared is None:
            return measured
        if abs(measured / declared - 1.0) > self._description.rate_tolerance:
            raise BadParameter("rate_hz", declared, f"the time column of {self._files[0].name} says {measured:.6g} Hz")
        return declared


class _Stretches:
    """Whether the rate of a time column stays what it is: steps may each be within the tolerance of a gap, and yet a
    clock that slows down makes a recording that no single rate describes.
    """

    def __init__(self, name: str, description: ImportDescription) -> None:
        self._name = name
        self._allowed = description.rate_tolerance
        self._jitter = description.gap_tolerance
        self._rows = 0
        self._begin_s = self._last_s = 0.0
        self._extremes: list[tuple[float, int]] = []
        """The shortest and the longest whole stretch [s], with the row of its beginning, counted from 0."""

    def add(self, time_s: Array) -> None:
        """The next rows."""
        first = -self._rows % STRETCH
        begins = time_s[first::STRETCH]
        if len(begins):
            row = self._rows + first
            known = np.concatenate([[self._begin_s], begins]) if self._rows else begins
            durations = np.diff(known)
            row -= STRETCH if self._rows else 0
            for k in {int(np.argmin(durations)), int(np.argmax(durations))} if len(durations) else ():
                self._extremes.append((float(durations[k]), row + k * STRETCH))
            self._extremes = [min(self._extremes), max(self._extremes)] if self._extremes else []
            self._begin_s = float(begins[-1])
        self._rows += len(time_s)
        self._last_s = float(time_s[-1])

    def require(self, rate_hz: float) -> None:
        """Every stretch has the rate of the whole, but for jitter of its ends. Raises `UnfitRecording`."""
        rest = (self._rows - 1) % STRETCH
        last = self._rows - 1 - rest
        stretches = [(duration, row, STRETCH) for duration, row in self._extremes]
        stretches += [(self._last_s - self._begin_s, last, rest)] if rest else []

        def allowed(steps: int) -> float:
            return self._allowed + 2.0 * self._jitter / steps

        def off(stretch: tuple[float, int, int]) -> float:
            """Parts of what is allowed."""
            return abs(stretch[0] * rate_hz / stretch[2] - 1.0) / allowed(stretch[2])

        worst = max(stretches, key=off)
        if off(worst) > 1.0:
            duration, row, steps = worst
            raise UnfitRecording(
                f"{self._name}: the rate is not uniform: rows {row + 1} to {row + steps + 1} take {duration:.6g} s "
                f"where {steps / rate_hz:.6g} s ± {100.0 * allowed(steps):.2g} % are expected at the mean rate of "
                f"{rate_hz:.6g} Hz"
            )


def _samples(parts: Sequence[Array], description: ImportDescription) -> Array:
    """The channels' columns out of the files' blocks, in the order of the channels."""
    next_column = [0 if description.time_column is None else 1] * len(parts)
    columns: list[Array] = []
    for channel in description.channels:
        columns.append(parts[channel.file][:, next_column[channel.file]])
        next_column[channel.file] += 1
    return np.column_stack(columns)


def _joined(files: Sequence[ImportFile], description: ImportDescription) -> Iterator[list[Array]]:
    """Blocks of all files side by side, with equal numbers of rows. Raises `UnreadableFile`."""
    readers = [_columns(file, index, description) for index, file in enumerate(files)]
    waiting = [next(reader, None) for reader in readers]
    rows = 0
    while all(block is not None for block in waiting):
        blocks = [block for block in waiting if block is not None]
        size = min(len(block) for block in blocks)
        rows += size
        yield [block[:size] for block in blocks]
        waiting = [
            block[size:] if len(block) > size else next(reader, None)
            for block, reader in zip(blocks, readers, strict=True)
        ]
    if any(block is not None for block in waiting):
        rest = [
            rows + (0 if block is None else len(block) + sum(len(more) for more in reader))
            for block, reader in zip(waiting, readers, strict=True)
        ]
        told = ", ".join(f"{file.name} has {count}" for file, count in zip(files, rest, strict=True))
        raise UnreadableFile(files[0].name, f"files that are joined need the same number of rows: {told}")


def _columns(file: ImportFile, index: int, description: ImportDescription) -> Iterator[Array]:
    columns = description.columns_of(index)
    if is_columnar(file.stream):
        return columnar_columns(file.stream, file.name, columns)
    return text_columns(file.stream, file.name, columns, description)


def _fingerprint(stream: BinaryIO) -> dict[str, Any]:
    stream.seek(0)
    digest, size = hashlib.sha256(), 0
    while piece := stream.read(1024 * 1024):
        digest.update(piece)
        size += len(piece)
    return {"sha256": digest.hexdigest(), "bytes": size}
