"""Reader of TDMS files of LabVIEW: groups of channels, scaled as npTDMS scales them, chunk by chunk."""

from collections.abc import Iterator, Sequence
from typing import Any, BinaryIO

import numpy as np

from bench_service.formats.bounds import MEGABYTE
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.arrays_by_name.tables import with_unit
from bench_service.formats.logs.names import hint, is_time
from bench_service.formats.logs.optional import needed
from bench_service.formats.logs.table import LogClock, LogColumn, LogTable, Numbers

NAME = "tdms"
TITLE = "TDMS (LabVIEW)"
MAGIC = b"TDSm"
SAMPLE_TIME = "wf_time"
LARGEST_CHUNK = 64 * MEGABYTE
_SECOND_NS = 1_000_000_000


def begins(start: bytes) -> bool:
    """Return whether a file that begins so is a TDMS."""
    return start.startswith(MAGIC)


def opened(stream: BinaryIO, name: str) -> "Tdms":
    """Return a reader of a TDMS file. Raises `UnreadableFile`."""
    return Tdms(stream, name)


class Tdms:
    """Reader of one TDMS file: its metadata in memory, its data in chunks. Implements `Log`."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._name = name
        self.warnings: list[str] = []
        nptdms = needed("nptdms", name)
        stream.seek(0)
        try:
            self._file = nptdms.TdmsFile.open(stream)
            self._groups = {g.name: {c.name: c for c in g.channels()} for g in self._file.groups()}
        except Exception as error:  # whatever a damaged file does to the reader
            raise UnreadableFile(name, f"cannot be read as TDMS: {_words(error)}") from error
        status = getattr(self._file, "file_status", None)
        if status is not None and status.incomplete_final_segment:
            self.warnings.append("the last segment of the file is cut off: what is before it was read")

    def tables(self) -> list[LogTable]:
        """Return the groups as tables; channels of one length in a group are one table. Raises `UnreadableFile` where
        there is none.
        """
        found: list[LogTable] = []
        for group, channels in self._groups.items():
            lengths = sorted({len(c) for c in channels.values() if len(c) > 1}, reverse=True)
            for length in lengths:
                same = {n: c for n, c in channels.items() if len(c) == length}
                found.append(self._table(group if len(lengths) == 1 else f"{group}, {length} rows", same, length))
        if not found:
            cut = ": the file is cut off" if self.warnings else ""
            raise UnreadableFile(self._name, f"holds no channel with more than one value{cut}")
        return found

    def _table(self, title: str, channels: dict[str, Any], rows: int) -> LogTable:
        columns: list[LogColumn] = []
        clocks: list[LogClock] = []
        notes: list[str] = []
        steps = {c.properties.get("wf_increment") for c in channels.values()} - {None, 0}
        for name, channel in channels.items():
            kind = np.dtype(channel.dtype).kind
            if kind == "M":
                clocks.append(
                    LogClock(name, 1e-9, "time stamps of the channel itself (npTDMS cuts them to microseconds)")
                )
            elif kind in "iufb":
                columns.append(_column(name, channel))
                if is_time(name):
                    clocks.append(LogClock(name, None, f"channel {name!r}"))
        rate = None
        if len(steps) == 1:
            step = float(next(iter(steps)))
            rate = 1.0 / step
            clocks.insert(0, LogClock(SAMPLE_TIME, 1e-9, f"wf_increment of the channels, {step:g} s a sample"))
            notes.append("the rate is what the program that wrote the file put into wf_increment, not a measured one")
        elif len(steps) > 1:
            notes.append("the channels have different wf_increment: those that are joined need the same rate")
        return LogTable(title, tuple(columns), tuple(clocks), rate, rows, tuple(notes))

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of rows, chunk by chunk: for each named column its values, (n,). Raises `UnreadableFile`."""
        group = table.name if table.name in self._groups else table.name.rpartition(", ")[0]
        waiting: dict[str, list[Numbers]] = {name: [] for name in columns if name != SAMPLE_TIME}
        done = 0
        step_ns = _SECOND_NS / table.rate_hz if table.rate_hz else 0.0
        for chunk in self._chunks():
            part = chunk[group]
            for name, kept in waiting.items():
                values = np.asarray(part[name][:])
                if len(values):
                    kept.append(values)
            ready = min((sum(map(len, kept)) for kept in waiting.values()), default=0)
            if ready:
                yield self._block(waiting, columns, ready, done, step_ns)
                done += ready
        if not waiting and table.rows:
            yield [np.rint(np.arange(table.rows) * step_ns).astype(np.int64)]

    def _block(
        self, waiting: dict[str, list[Numbers]], columns: Sequence[str], ready: int, done: int, step_ns: float
    ) -> list[Numbers]:
        taken: dict[str, Numbers] = {}
        for name, kept in waiting.items():
            whole = np.concatenate(kept) if len(kept) > 1 else kept[0]
            taken[name] = _plain(whole[:ready])
            kept[:] = [whole[ready:]] if len(whole) > ready else []
        if SAMPLE_TIME in columns:
            taken[SAMPLE_TIME] = np.rint(np.arange(done, done + ready) * step_ns).astype(np.int64)
        return [taken[name] for name in columns]

    def _chunks(self) -> Iterator[Any]:
        try:
            yield from self._file.data_chunks()
        except MemoryError:
            raise
        except Exception as error:
            raise UnreadableFile(self._name, f"the data cannot be read as TDMS: {_words(error)}") from error


def _plain(values: Numbers) -> Numbers:
    return values.astype("datetime64[ns]").astype(np.int64) if values.dtype.kind == "M" else values


def _column(name: str, channel: Any) -> LogColumn:
    guess = hint(name)
    said = str(channel.properties.get("unit_string", ""))
    if guess.quantity is None:
        return LogColumn(name)
    return with_unit(
        LogColumn(name, guess.quantity, guess.unit, channel=guess.channel, doubt=guess.doubt), said, "channel"
    )


def _words(error: Exception) -> str:
    said = " ".join(str(error).split())[:140] or type(error).__name__
    return f"it is damaged or cut off ({said})"
