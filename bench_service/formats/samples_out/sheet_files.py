"""Sheets as files: CSV, Parquet, Arrow (stream and file), NumPy, HDF5, MATLAB 5 and MCAP, in memory that is bounded.

HDF5 and the Arrow file are written to a temporary file first, for they are complete only at their end. MATLAB 5 has no
place for a column that grows: the whole is held in memory and therefore bounded.
"""

import io
import re
import tempfile
from collections.abc import Callable, Iterator
from enum import StrEnum
from typing import IO, Any, cast

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from pyarrow import csv

from bench_service.formats.chunk import arrow_array
from bench_service.formats.samples_out.distinct_names import distinct
from bench_service.formats.samples_out.mcap_file import mcap
from bench_service.formats.samples_out.sheet import Sheet
from procedures.core.errors import BadParameter
from procedures.importing import IMPORTING

PIECE = 1 << 20
MOST_IN_MATLAB = 8_000_000
"""Numbers of one MATLAB file: 64 MB, and as much again while it is written."""

LONGEST_IN_MATLAB = 63
"""Most letters of a name in MATLAB, of a variable as of a field."""
STRUCTS_IN_MATLAB = ("about", "units", "channels")
"""Variables of a MATLAB file that are no columns."""
NUMBERS = ("scale", "offset")
"""Attributes of a column that are numbers."""


class SheetFormat(StrEnum):
    """File format in which a table of samples is exported."""

    CSV = "csv"
    PARQUET = "parquet"
    ARROW = "arrow"
    ARROW_FILE = "feather"
    NPY = "npy"
    HDF5 = "h5"
    MATLAB = "mat"
    MCAP = "mcap"


def written(sheet: Sheet, form: SheetFormat) -> Iterator[bytes]:
    """Yield the bytes of a file. Raises `BadParameter` for a sheet that the format cannot hold, before the first."""
    if form is SheetFormat.MATLAB and sheet.rows * len(sheet.columns) > MOST_IN_MATLAB:
        allowed = f"h5, parquet or csv, or fewer samples: a .mat file takes {MOST_IN_MATLAB} numbers, these are "
        raise BadParameter("format", form.value, f"{allowed}{sheet.rows * len(sheet.columns)}")
    writers: dict[SheetFormat, Callable[[Sheet], Iterator[bytes]]] = {
        SheetFormat.CSV: _csv,
        SheetFormat.PARQUET: _parquet,
        SheetFormat.ARROW: _arrow,
        SheetFormat.ARROW_FILE: _arrow_file,
        SheetFormat.NPY: _npy,
        SheetFormat.HDF5: _hdf5,
        SheetFormat.MATLAB: _matlab,
        SheetFormat.MCAP: mcap,
    }
    return writers[form](sheet)


def _schema(sheet: Sheet) -> Any:
    fields = [
        pa.field(c.name, pa.from_numpy_dtype(c.kind), nullable=False, metadata=dict(c.attributes))
        for c in sheet.columns
    ]
    return pa.schema(fields, metadata=dict(sheet.about))


def _batches(sheet: Sheet, schema: Any) -> Iterator[Any]:
    for block in sheet.blocks:
        yield pa.RecordBatch.from_arrays([arrow_array(column) for column in block], schema=schema)


def _csv(sheet: Sheet) -> Iterator[bytes]:
    """One line of names, then rows: nothing that a reader must skip."""
    yield (",".join(c.name for c in sheet.columns) + "\n").encode()
    options = csv.WriteOptions(include_header=False, quoting_style="none")
    for batch in _batches(sheet, _schema(sheet)):
        sink = pa.BufferOutputStream()
        csv.write_csv(batch, sink, options)
        yield sink.getvalue().to_pybytes()


def _arrow(sheet: Sheet) -> Iterator[bytes]:
    schema, sink = _schema(sheet), io.BytesIO()
    with pa.ipc.new_stream(sink, schema) as writer:
        for batch in _batches(sheet, schema):
            writer.write_batch(batch)
            yield _taken(sink)
    yield _taken(sink)


def _taken(sink: io.BytesIO) -> bytes:
    data = sink.getvalue()
    sink.seek(0)
    sink.truncate()
    return data


def _arrow_file(sheet: Sheet) -> Iterator[bytes]:
    schema = _schema(sheet)
    with tempfile.TemporaryFile() as file:
        with pa.ipc.new_file(file, schema) as writer:
            for batch in _batches(sheet, schema):
                writer.write_batch(batch)
        yield from _pieces(file)


def _parquet(sheet: Sheet) -> Iterator[bytes]:
    schema = _schema(sheet)
    with tempfile.TemporaryFile() as file:
        with pq.ParquetWriter(file, schema, compression="zstd") as writer:
            for batch in _batches(sheet, schema):
                writer.write_batch(batch)
        yield from _pieces(file)


def _npy(sheet: Sheet) -> Iterator[bytes]:
    """One array (n, columns) of 64-bit floats, time first; NumPy's format has no place for names."""
    head = io.BytesIO()
    shape = (sheet.rows, len(sheet.columns))
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": shape})
    yield head.getvalue()
    for block in sheet.blocks:
        yield np.column_stack(block).astype("<f8").tobytes()


def _hdf5(sheet: Sheet) -> Iterator[bytes]:
    """One data set a column, with its unit and quantity as attributes; those of the file describe the recording."""
    import h5py  # a quarter of a second that no other format needs

    with tempfile.TemporaryFile() as file:
        with h5py.File(file, "w") as store:
            store.attrs.update(sheet.about)
            sets = [
                store.create_dataset(c.name, shape=(0,), maxshape=(None,), dtype=c.kind, chunks=(8192,), shuffle=True)
                for c in sheet.columns
            ]
            for data_set, column in zip(sets, sheet.columns, strict=True):
                data_set.attrs.update(column.attributes)
            done = 0
            for block in sheet.blocks:
                for data_set, values in zip(sets, block, strict=True):
                    data_set.resize((done + len(values),))
                    data_set[done:] = values
                done += len(block[0])
        yield from _pieces(file)


def _matlab(sheet: Sheet) -> Iterator[bytes]:
    """One column vector a column, and the structs `about`, `units` and `channels`; `units` are those of the numbers as
    they are, and ``scale·(raw − offset)`` is in the unit of `channels`.
    """
    with IMPORTING:
        from scipy.io import savemat

    blocks = list(sheet.blocks)
    names = distinct([_matlab_name(c.name) for c in sheet.columns], LONGEST_IN_MATLAB, STRUCTS_IN_MATLAB)
    variables: dict[str, Any] = {
        name: np.concatenate([block[i] for block in blocks]) if blocks else np.zeros(0, sheet.columns[i].kind)
        for i, name in enumerate(names)
    }
    variables["about"] = dict(sheet.about)
    variables["units"] = {name: c.unit_of_numbers for name, c in zip(names, sheet.columns, strict=True)}
    variables["channels"] = {
        name: {"column": c.name} | {k: float(v) if k in NUMBERS else v for k, v in c.attributes.items()}
        for name, c in zip(names, sheet.columns, strict=True)
    }
    out = io.BytesIO()
    savemat(cast("Any", out), variables, format="5", oned_as="column", long_field_names=True)
    data = out.getbuffer()
    for start in range(0, len(data), PIECE):
        yield bytes(data[start : start + PIECE])


def _matlab_name(name: str) -> str:
    """A name of letters, digits and underscores, as MATLAB takes it."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return plain if plain[:1].isalpha() else f"c_{plain}"


def _pieces(file: IO[bytes]) -> Iterator[bytes]:
    file.seek(0)
    while piece := file.read(PIECE):
        yield piece
