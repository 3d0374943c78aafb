"""Export of a recording as Arrow, Parquet, CSV or NumPy, a block at a time: memory does not grow with its length.

Samples go out as they are stored, raw; scale, offset, unit and quantity of each channel, the rate and the content hash
of the whole recording travel with them (not in NumPy's format, which has no place for them).
``value = scale·(raw − offset)``. Must not know where the blocks come from. Arrow is imported where something goes out.
"""

import io
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np

from bench_service.formats.chunk import RAW_BYTES, arrow_array, sample_type
from bench_service.formats.samples_out.distinct_names import distinct
from bench_service.formats.samples_out.written_bytes import WrittenBytes
from procedures.core.errors import BadParameter
from procedures.core.recording import RawArray, RecordingInfo


class ExportFormat(StrEnum):
    """File format of an exported recording."""

    ARROW = "arrow"
    PARQUET = "parquet"
    CSV = "csv"
    NPY = "npy"

    @property
    def media_type(self) -> str:
        """Return the format's media type for HTTP."""
        return {
            "arrow": "application/vnd.apache.arrow.stream",
            "parquet": "application/vnd.apache.parquet",
            "csv": "text/csv; charset=utf-8",
            "npy": "application/octet-stream",
        }[self.value]


HELD = {ExportFormat.ARROW: 4, ExportFormat.PARQUET: 5, ExportFormat.CSV: 8, ExportFormat.NPY: 4}
"""Memory that an export holds, by format, in raw bytes of a chunk: as read, as columns, and as text or as a page of the
file."""


@dataclass(frozen=True)
class Extract:
    """A part of a recording: some channels, samples start…stop (half open)."""

    info: RecordingInfo
    """Description of the whole recording, its channels limited to the exported ones."""
    start: int
    stop: int
    dtype: str
    """Sample type, "int32" or "float64"."""
    of_channels: tuple[str, ...] = ()
    """Names of all channels of the recording."""
    origin: str = ""
    """Origin of the recording: real, mixed, simulated, synthetic or imported; empty: not known."""


def extract(
    info: RecordingInfo,
    dtype: str,
    channels: Iterable[str] | None = None,
    start_s: float | None = None,
    stop_s: float | None = None,
    origin: str = "",
) -> Extract:
    """Return a part of a recording, by names of channels and by time since its first sample [s]; a sample belongs to
    its beginning. `origin` travels with it.

    Raises `MissingChannel`, `BadParameter`.
    """
    names = [c.name for c in info.channels] if channels is None else list(channels)
    if not names or len(set(names)) != len(names):
        raise BadParameter("channels", names, "at least one, each once")
    chosen = tuple(info.channels[info.column(name)] for name in names)
    first = _sample(info, "start_s", 0.0 if start_s is None else start_s)
    last = info.count if stop_s is None else _sample(info, "stop_s", stop_s)
    if last < first:
        raise BadParameter("stop_s", stop_s, f"not before start_s = {start_s}")
    everything = tuple(c.name for c in info.channels)
    return Extract(replace(info, channels=chosen), first, last, dtype, everything, origin)


def require_samples(part: Extract, start_s: float | None, stop_s: float | None) -> None:
    """Refuse a stretch in which no sample begins. Raises `BadParameter` with the range of the recording."""
    info, begin_s = part.info, start_s or 0.0
    if part.start < part.stop or info.count == 0:
        return
    field, given, end_s = ("start_s", begin_s, info.duration_s) if stop_s is None else ("stop_s", stop_s, stop_s)
    allowed = (
        f"a stretch with samples: of {info.rate_hz:g} a second none begins within {begin_s:g} … {end_s:g} s; start_s "
        f"and stop_s count from the first sample, 0 … {info.duration_s:g}"
    )
    raise BadParameter(field, given, allowed)


def _sample(info: RecordingInfo, field: str, moment_s: float) -> int:
    """The first sample that begins at a moment or after it."""
    if not 0.0 <= moment_s <= info.duration_s * (1 + 1e-12):
        raise BadParameter(field, moment_s, f"0 … {info.duration_s:g}, the length of the recording in seconds")
    return min(info.count, math.ceil(moment_s * info.rate_hz - 1e-6))


def export_bytes(form: ExportFormat) -> int:
    """Estimate the memory that an export holds at a time [bytes], a chunk's samples and their form in the file."""
    return RAW_BYTES * HELD[form]


def export(part: Extract, blocks: Iterable[RawArray], form: ExportFormat) -> Iterator[bytes]:
    """Yield the bytes of a file. `blocks` are the samples of the part, in order, each (n, channels)."""
    writers: dict[ExportFormat, Callable[[Extract, Iterable[RawArray]], Iterator[bytes]]] = {
        ExportFormat.ARROW: _arrow,
        ExportFormat.PARQUET: _parquet,
        ExportFormat.CSV: _csv,
        ExportFormat.NPY: _npy,
    }
    return writers[form](part, blocks)


def describe(part: Extract) -> dict[str, str]:
    """Return the description of the recording for the reader of the file, as name -> text."""
    info = part.info
    return {
        "recording": info.id,
        "unit": info.unit,
        "rate_hz": repr(float(info.rate_hz)),
        "first_sample": str(part.start),
        "start_s": repr(info.start_s + part.start / info.rate_hz),
        "station": "" if info.station is None else info.station.label,
        "simulated": str(info.simulated).lower(),
        "origin": part.origin or ("simulated" if info.simulated else "not known"),
        "content_hash_of_whole_recording": info.content_hash,
        "samples_of_whole_recording": str(info.count),
        "channels_of_whole_recording": ",".join(part.of_channels or [c.name for c in info.channels]),
    }


def _schema(part: Extract) -> Any:
    import pyarrow as pa

    kind = pa.from_numpy_dtype(sample_type(part.dtype))
    fields = [
        pa.field(
            channel.name,
            kind,
            nullable=False,
            metadata={
                "quantity": channel.quantity.value,
                "unit": channel.unit,
                "scale": repr(float(channel.scale)),
                "offset": repr(float(channel.offset)),
            },
        )
        for channel in part.info.channels
    ]
    return pa.schema(fields, metadata=describe(part))


def _batches(schema: Any, blocks: Iterable[RawArray]) -> Iterator[Any]:
    import pyarrow as pa

    for block in blocks:
        columns = [arrow_array(block[:, index]) for index in range(block.shape[1])]
        yield pa.RecordBatch.from_arrays(columns, schema=schema)


def _arrow(part: Extract, blocks: Iterable[RawArray]) -> Iterator[bytes]:
    import pyarrow as pa

    outbox, schema = WrittenBytes(), _schema(part)
    with pa.ipc.new_stream(pa.PythonFile(outbox, mode="w"), schema) as writer:
        for batch in _batches(schema, blocks):
            writer.write_batch(batch)
            yield outbox.take()
    yield outbox.take()


def _parquet(part: Extract, blocks: Iterable[RawArray]) -> Iterator[bytes]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    outbox, schema = WrittenBytes(), _schema(part)
    with pq.ParquetWriter(
        pa.PythonFile(outbox, mode="w"),
        schema,
        compression="zstd",
        use_dictionary=False,
        column_encoding=dict.fromkeys(
            schema.names, "DELTA_BINARY_PACKED" if part.dtype == "int32" else "BYTE_STREAM_SPLIT"
        ),
    ) as writer:
        for batch in _batches(schema, blocks):
            writer.write_batch(batch)
            yield outbox.take()
    yield outbox.take()


def _csv(part: Extract, blocks: Iterable[RawArray]) -> Iterator[bytes]:
    """Lines that begin with "#" describe; then names; then rows: time since the first sample [s], raw samples."""
    import pyarrow as pa
    from pyarrow import csv

    lines = [f"# {key}: {value}" for key, value in describe(part).items()]
    lines += [
        f"# channel {c.name}: quantity={c.quantity.value} unit={c.unit} scale={c.scale!r} offset={c.offset!r}"
        for c in part.info.channels
    ]
    names = distinct(["time_s", *(channel.name for channel in part.info.channels)])
    yield ("\n".join([*lines, ",".join(names)]) + "\n").encode()
    options = csv.WriteOptions(include_header=False, quoting_style="none")
    sample = part.start
    for block in blocks:
        time_s = np.arange(sample, sample + len(block)) / part.info.rate_hz
        columns = [arrow_array(time_s), *(arrow_array(block[:, i]) for i in range(block.shape[1]))]
        sink = pa.BufferOutputStream()
        csv.write_csv(pa.Table.from_arrays(columns, names=names), sink, options)
        yield sink.getvalue().to_pybytes()
        sample += len(block)


def _npy(part: Extract, blocks: Iterable[RawArray]) -> Iterator[bytes]:
    """NumPy's own format: one array of raw samples, (n, channels), for `numpy.load`."""
    kind = np.dtype(sample_type(part.dtype)).newbyteorder("<")
    head = io.BytesIO()
    shape = (part.stop - part.start, len(part.info.channels))
    np.lib.format.write_array_header_1_0(head, {"descr": kind.str, "fortran_order": False, "shape": shape})
    yield head.getvalue()
    for block in blocks:
        yield np.ascontiguousarray(block, dtype=kind).tobytes()
