"""Reader of HDF5 files, MATLAB 7.3 among them, by h5py: datasets of one length as one table, in blocks of rows."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np

from bench_service.formats.bounds import MEGABYTE, quoted
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.arrays_by_name.tables import (
    FACT_BYTES,
    MOST_ARRAYS,
    NamedArray,
    StatedFacts,
    StatedRates,
    lies,
    tables_by_length,
)
from bench_service.formats.logs.optional import needed
from bench_service.formats.logs.table import BLOCK_ROWS, LogTable, Numbers

NAME = "hdf5"
TITLE = "HDF5, and MATLAB .mat version 7.3"
MAGIC = b"\x89HDF\r\n\x1a\n"
LARGEST_CHUNK = 64 * MEGABYTE
NARROW = 16
"""Columns of a dataset up to which a block is turned as a whole."""
MOST_FACTS = 64
"""Most attributes of a file, or of a data set, that are taken as facts."""
_UNITS = ("unit", "units", "Unit", "Units", "UNITS", "unit_string")
_MATLAB_NUMBERS = (
    b"double",
    b"single",
    b"int8",
    b"int16",
    b"int32",
    b"int64",
    b"uint8",
    b"uint16",
    b"uint32",
    b"uint64",
)
_TABLES = (
    "tables, timetables and datetimes of MATLAB are objects whose numbers cannot be read here: in MATLAB save "
    "T{:,:} or T.Variables, and seconds(T.Time), as plain matrices"
)


def begins(start: bytes) -> bool:
    """Return whether a file that begins so is HDF5: its signature stands at 0, 512, 1024, …."""
    return any(start[at : at + 8] == MAGIC for at in (0, 512, 1024, 2048))


def opened(stream: BinaryIO, name: str) -> "Hdf5":
    """Return a reader of an HDF5 file. Raises `UnreadableFile`."""
    return Hdf5(stream, name)


@dataclass(frozen=True)
class _Place:
    """A dataset as samples in rows. `turned`: it is stored transposed, as MATLAB does; `field`: of a compound type."""

    array: NamedArray
    path: str
    turned: bool = False
    field: str = ""


class Hdf5:
    """Reader of one HDF5 file, MATLAB 7.3 among them. Implements `Log`."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._name = name
        self.warnings: list[str] = []
        self._notes: list[str] = []
        self._arrays: dict[str, _Place] = {}
        self._rates = StatedRates()
        self._stated = StatedFacts()
        self.facts, self.column_facts = self._stated.facts, self._stated.column_facts
        h5py = needed("h5py", name)
        stream.seek(0)
        try:
            self._file = h5py.File(_by_descriptor(stream) or stream, "r", rdcc_nbytes=2 * MEGABYTE)
            self._collect(h5py)
        except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
            raise UnreadableFile(name, f"cannot be read as HDF5: {_words(error)}") from error

    def _collect(self, h5py: Any) -> None:
        def visit(path: str, item: Any) -> None:
            self._rates.add_all(f"{path}.", item.attrs)
            if isinstance(item, h5py.Dataset) and len(self._arrays) < MOST_ARRAYS and not path.startswith("#"):
                self._dataset(path, item)
            elif item.attrs.get("MATLAB_class") in (b"table", b"timetable", b"datetime"):
                self._note(_TABLES)

        self._file.visititems(visit)
        self._rates.add_all("", self._file.attrs)
        self.facts |= _texts(self._file.attrs)

    def _dataset(self, path: str, item: Any) -> None:
        matlab = item.attrs.get("MATLAB_class")
        if matlab == b"char" and StatedFacts.is_fact(path.replace("/", ".")) and item.size <= FACT_BYTES:
            self._stated.add(path.replace("/", "."), "".join(map(chr, np.asarray(item[()]).reshape(-1).tolist())))
            return
        if matlab is not None and ("MATLAB_empty" in item.attrs or matlab not in _MATLAB_NUMBERS):
            if matlab in (b"table", b"timetable", b"datetime"):
                self._note(_TABLES)
            return
        unit = next((_text(item.attrs[key]) for key in _UNITS if key in item.attrs), "")
        title = path.replace("/", ".") if matlab is not None else path
        if matlab is None and (said := _texts(item.attrs)):
            self.column_facts[path] = said
        if item.dtype.names:
            if len(item.shape) == 1:
                for field in item.dtype.names:
                    part = item.dtype[field]
                    if part.base.kind in "iufb" and len(part.shape) <= 1:
                        width = part.shape[0] if part.shape else 1
                        self._add(f"{title}.{field}", item, item.shape[0], width, unit, path, field=field)
            return
        if item.dtype.kind in "iuf" and item.size == 1:
            self._rates.add(path, item[()])
            if matlab is not None and StatedFacts.is_fact(path.replace("/", ".")):
                self._stated.add(path.replace("/", "."), repr(float(np.asarray(item[()]).reshape(-1)[0])))
        if item.dtype.kind not in "iufb" or len(item.shape) not in (1, 2):
            return
        shape = item.shape if len(item.shape) == 2 else (item.shape[0], 1)
        turned = matlab is not None and len(item.shape) == 2
        rows, width = (shape[1], shape[0]) if turned else shape
        if rows == 1 and width > 1:
            rows, width, turned = width, 1, not turned
        if lies(rows, width):
            self._note(f"{quoted(title)} is {rows} x {width}: its columns are taken as the samples")
            rows, width, turned = width, rows, not turned
        self._add(title, item, rows, width, unit, path, turned=turned)

    def _add(self, title: str, item: Any, rows: int, width: int, unit: str, path: str, **more: Any) -> None:
        if item.chunks is not None and np.prod(item.chunks) * item.dtype.itemsize > LARGEST_CHUNK:
            self._note(f"{quoted(title)} has chunks of more than {LARGEST_CHUNK // MEGABYTE} MB and is not read")
            return
        self._arrays[title] = _Place(NamedArray(title, rows, width, unit), path, **more)

    def _note(self, words: str) -> None:
        if words not in self._notes and len(self._notes) < 20:
            self._notes.append(words)

    def tables(self) -> list[LogTable]:
        """Return the datasets as tables, those of one length as one. Raises `UnreadableFile` where there is none."""
        found = tables_by_length([p.array for p in self._arrays.values()], self._notes, self._rates)
        if not found:
            raise UnreadableFile(
                self._name, f"holds no dataset of samples: {'; '.join(self._notes) or 'it has none of numbers'}"
            )
        return found

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of rows: for each named column its values, (n,). Raises `UnreadableFile`."""
        places = {name: (p, i) for p in self._arrays.values() for i, name in enumerate(p.array.columns)}
        wanted = [places[name] for name in columns]
        count = table.rows or 0
        start = 0
        try:
            items = {place.path: self._file[place.path] for place, _ in wanted}
            while start < count:
                stop = min(count, start + BLOCK_ROWS)
                read: dict[str, Any] = {}
                yield [_part(place, items[place.path], index, slice(start, stop), read) for place, index in wanted]
                start = stop
        except (OSError, RuntimeError) as error:
            raise UnreadableFile(
                self._name, f"rows {start + 1} to {min(count, start + BLOCK_ROWS)} cannot be read: {_words(error)}"
            ) from error


def _part(place: _Place, item: Any, index: int, rows: slice, read: dict[str, Any]) -> Numbers:
    """A column of a block of rows; `read` keeps what was read of each dataset, columns first."""
    if place.path not in read:
        if len(item.shape) == 1:
            read[place.path] = item[rows]
        elif place.turned:
            read[place.path] = item[:, rows]
        else:  # one pass over a narrow block takes a seventh of the time of a pass for each column
            block = item[rows, :].T
            read[place.path] = np.ascontiguousarray(block) if len(block) <= NARROW else block
    data = read[place.path]
    if place.field:
        values = data[place.field] if data[place.field].ndim == 1 else data[place.field][:, index]
        return np.ascontiguousarray(values).astype(values.dtype.newbyteorder("="), copy=False)
    column = data if data.ndim == 1 else data[index]
    return np.ascontiguousarray(column).astype(column.dtype.newbyteorder("="), copy=False)


def _by_descriptor(stream: BinaryIO) -> str | None:
    """Return a path to the open file of a stream, which HDF5 reads faster than through Python; None: it has none.

    HDF5 2.0 resolves the link, which an unlinked temporary file, such as an upload's, does not survive.
    """
    try:
        path = f"/proc/self/fd/{stream.fileno()}"
    except (OSError, ValueError, AttributeError):
        return None
    return path if os.path.exists(os.path.realpath(path)) else None


def _texts(attributes: Any) -> dict[str, str]:
    """Attributes that are short texts. One that is damaged is left out."""
    found: dict[str, str] = {}
    for key in list(attributes)[:MOST_FACTS]:
        value = attributes.get(key)
        if isinstance(value, (str, bytes)) and len(value) <= FACT_BYTES:
            found[str(key)] = _text(value)
    return found


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _words(error: Exception) -> str:
    said = " ".join(str(error).split())[:140]
    if "truncated" in said:
        return f"it is cut off ({said})"
    return f"it is damaged or cut off ({said})"
