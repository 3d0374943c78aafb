"""Files that are joined to one table: opened by their formats, read side by side, surveyed once."""

from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass

import numpy as np

from bench_service.formats.blocks import Block
from bench_service.formats.bounds import Bounds
from bench_service.formats.columnar import columnar_columns, is_columnar
from bench_service.formats.delimited import text_columns
from bench_service.formats.description import ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.import_request import ImportFile
from bench_service.formats.logs.columns import log_columns
from bench_service.formats.logs.registry import opened_log
from bench_service.formats.logs.table import Log
from bench_service.formats.survey import Findings, Survey
from procedures.core.arrays import Array


@dataclass(frozen=True)
class Opened:
    """A file, and where it is a log its opened reader."""

    file: ImportFile
    log: Log | None


def opened_files(files: Sequence[ImportFile], form: str | None) -> tuple[Opened, ...]:
    """Open files by their formats, or by the format `form`, and return them. Raises `UnreadableFile`,
    `BadParameter`.
    """
    return tuple(Opened(file, opened_log(file.stream, file.name, form)) for file in files)


def surveyed(opened: Sequence[Opened], description: ImportDescription, bounds: Bounds) -> Findings:
    """Read all rows once and return the findings. Raises `UnreadableFile`, `UnfitRecording`, `BadParameter`."""
    with closing(Survey([o.file.name for o in opened], description, bounds)) as survey:
        for parts in joined(opened, description, bounds):
            survey.add(parts, in_order(parts, description))
        return survey.findings()


def in_order(parts: Sequence[Block], description: ImportDescription) -> Array:
    """Return the channels' columns out of the files' blocks, in the order of the channels, (n, channels)."""
    if len(parts) == 1:
        return parts[0].values
    next_column = [0] * len(parts)
    columns: list[Array] = []
    for channel in description.channels:
        columns.append(parts[channel.file].values[:, next_column[channel.file]])
        next_column[channel.file] += 1
    return np.column_stack(columns)


def joined(files: Sequence[Opened], description: ImportDescription, bounds: Bounds) -> Iterator[list[Block]]:
    """Yield the blocks of all files side by side, with equal numbers of rows. Raises `UnreadableFile` where one has
    fewer.
    """
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
        counts = ", ".join(f"{o.file.name} has {count}" for o, count in zip(files, rest, strict=True))
        raise UnreadableFile(files[0].file.name, f"files that are joined need the same number of rows: {counts}")


def _columns(opened: Opened, index: int, description: ImportDescription, bounds: Bounds) -> Iterator[Block]:
    columns, file = description.columns_of(index), opened.file
    if opened.log is not None:
        return log_columns(opened.log, file.name, columns, description, bounds)
    if is_columnar(file.stream):
        return columnar_columns(file.stream, file.name, columns, description, bounds)
    return text_columns(file.stream, file.name, columns, description, bounds)
