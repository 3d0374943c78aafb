"""Registry of the formats of log files, and the choice of a file's format."""

from types import ModuleType
from typing import BinaryIO, cast

from bench_service.formats.logs import (
    dataflash,
    hg4930,
    imr,
    ixcom_log,
    kvh1750,
    novatel,
    stim300,
    ulog,
    vectornav,
    zipped,
)
from bench_service.formats.logs.arrays_by_name import hdf5, mat5, tdms
from bench_service.formats.logs.ros import mcap, rosbag1, rosbag2
from bench_service.formats.logs.table import Log, LogFormat
from procedures.core.errors import BadParameter

GLANCE_BYTES = 65_536
TABLES = "table"
"""Format of files that are read as tables by `delimited` and `columnar`."""


def _format(module: ModuleType) -> LogFormat:
    return cast(LogFormat, module)


BY_SIGNATURE = tuple(map(_format, (hdf5, mat5, ulog, rosbag1, rosbag2, mcap, tdms, imr, dataflash, zipped)))
"""Formats with a signature at the beginning."""
BY_FRAMES = tuple(map(_format, (vectornav, novatel, kvh1750, ixcom_log, stim300, hg4930)))
"""Formats that are recognised by frames with right checksums."""
FORMATS = {form.NAME: form for form in (*BY_SIGNATURE, *BY_FRAMES)}


def format_of(stream: BinaryIO, wanted: str | None = None) -> LogFormat | None:
    """Return the format of a file by its beginning, or the one that is wanted; None: it is a table of text or of
    columns.

    Raises `BadParameter` for a format that is not known.
    """
    if wanted == TABLES:
        return None
    if wanted is not None:
        if wanted not in FORMATS:
            raise BadParameter("format", wanted, f"one of {', '.join((TABLES, *FORMATS))}")
        return FORMATS[wanted]
    stream.seek(0)
    start = stream.read(GLANCE_BYTES)
    return next((form for form in (*BY_SIGNATURE, *BY_FRAMES) if form.begins(start)), None)


def opened_log(stream: BinaryIO, name: str, wanted: str | None = None) -> Log | None:
    """Return a reader of a file as a log; None: it is a table. Raises `UnreadableFile`, `BadParameter`."""
    form = format_of(stream, wanted)
    return None if form is None else form.opened(stream, name)
