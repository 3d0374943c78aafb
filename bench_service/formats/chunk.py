"""One chunk of a recording as a self-contained Parquet payload.

Knows how samples become bytes and come back bit for bit. Must not know where the bytes are kept.

Counts of a unit at rest are near-constant plus noise, so int32 columns are delta-encoded (miniblocks as narrow as
the noise) and then zstd; float64 columns are split into byte streams, so that equal exponents lie side by side.
Arrow is imported where a chunk is encoded or decoded: a service that starts does without.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from procedures.core.recording import RawArray

RAW_BYTES = 2 * 1024 * 1024
"""Raw size of a full chunk: the payload stays under a megabyte for noise up to 10 bits, and decodes in milliseconds."""

SampleType = np.dtype[np.int32] | np.dtype[np.float64]
"""Type of a sample: counts, or values that a unit computed itself."""

ENCODINGS = {"int32": "DELTA_BINARY_PACKED", "float64": "BYTE_STREAM_SPLIT"}
"""Parquet encoding of a column, by the type of the samples."""


class UnreadableChunk(Exception):
    """Raised where the payload is not the requested chunk, or cannot be decoded."""


@dataclass(frozen=True)
class ChunkPlace:
    """Metadata of a chunk: its recording, its first sample and its rate."""

    recording_id: str
    start: int
    rate_hz: float


def sample_type(name: str) -> SampleType:
    """Return the type of samples by its name, "int32" or "float64"."""
    return np.dtype(np.int32) if name == "int32" else np.dtype(np.float64)


def rows_per_chunk(channels: int, dtype: SampleType) -> int:
    """Return the number of samples of each channel that fill a chunk, about a megabyte."""
    return max(1, RAW_BYTES // (channels * dtype.itemsize))


def encode_chunk(samples: RawArray, names: Sequence[str], place: ChunkPlace) -> bytes:
    """Return samples, shape (n, channels), as the bytes of a Parquet file with one column for each channel."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    encoding = ENCODINGS[samples.dtype.name]
    schema = pa.schema(
        [pa.field(name, pa.from_numpy_dtype(samples.dtype), nullable=False) for name in names],
        metadata={
            "recording": place.recording_id,
            "start_sample": str(place.start),
            "rate_hz": repr(float(place.rate_hz)),
        },
    )
    columns = [arrow_array(row) for row in np.ascontiguousarray(samples.T[: len(names)])]
    sink = pa.BufferOutputStream()
    pq.write_table(
        pa.Table.from_arrays(columns, schema=schema),
        sink,
        compression="zstd",
        use_dictionary=False,
        write_statistics=False,
        column_encoding=dict.fromkeys(names, encoding),
    )
    return sink.getvalue().to_pybytes()


def decode_chunk(payload: bytes, names: Sequence[str]) -> RawArray:
    """Return the named channels of a chunk in that order, shape (n, len(names)). Raises `UnreadableChunk`.

    Each channel lies in one piece of memory, as in the chunk and as analyses take it.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.ParquetFile(pa.BufferReader(payload)).read(columns=list(names), use_threads=False)
        columns = [_numbers(table.column(name)) for name in names]
    except (pa.ArrowException, OSError, KeyError) as error:
        raise UnreadableChunk(str(error)) from error
    out = np.empty((len(names), table.num_rows), dtype=columns[0].dtype)
    for row, column in zip(out, columns, strict=True):
        row[:] = column
    return out.T


def arrow_array(values: NDArray[Any]) -> Any:
    """Numbers as an Arrow array over the same memory, without missing values.

    `pyarrow.array` imports pandas wherever that is installed: half a second and 50 MB, for values of other kinds.
    """
    import pyarrow as pa

    values = np.ascontiguousarray(values)
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), len(values), [None, pa.py_buffer(values)])


def _numbers(column: Any) -> NDArray[Any]:
    """A column of numbers by DLPack: its own `to_numpy` would import pandas too. Raises `ArrowException`."""
    pieces = [np.from_dlpack(piece) for piece in column.chunks]
    if not pieces:
        return np.empty(0, column.type.to_pandas_dtype())
    return pieces[0] if len(pieces) == 1 else np.concatenate(pieces)
