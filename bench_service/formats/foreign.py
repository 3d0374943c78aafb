"""Detection of other file types by their first bytes, each with the way to a readable table."""

import struct

_SAVE = "save it as CSV, Parquet or Arrow"
_AS_IT_IS = 'it is read as it is, not packed by gzip and without format = "table"'
_KINDS: tuple[tuple[bytes, str], ...] = (
    (b"PK\x03\x04", f"a zip archive or a workbook: unpack it, or {_SAVE}"),
    (b"BZh", "compressed by bzip2: unpack it, or compress it by gzip"),
    (b"\xfd7zXZ\x00", "compressed by xz: unpack it, or compress it by gzip"),
    (b"\x28\xb5\x2f\xfd", "compressed by zstd: unpack it, or compress it by gzip"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive: unpack it"),
    (b"\x89HDF\r\n\x1a\n", f"an HDF5 file: {_AS_IT_IS}"),
    (b"MATLAB 5.0 MAT-file", f"a MATLAB file: {_AS_IT_IS}"),
    (b"ULog\x01\x12\x35", f"a ULog of a flight controller: {_AS_IT_IS}"),
    (b"\xa3\x95\x80", f"a DataFlash log of a flight controller: {_AS_IT_IS}"),
    (b"#ROSBAG", f"a ROS bag: {_AS_IT_IS}"),
    (b"\x89MCAP0\r\n", f"an MCAP file: {_AS_IT_IS}"),
    (b"SQLite format 3\x00", f"an SQLite database: {_AS_IT_IS}"),
    (b"TDSm", f"a TDMS file: {_AS_IT_IS}"),
    (b"MDF ", f"an MDF file: {_SAVE}"),
    (b"\x93NUMPY", f"a NumPy file: {_SAVE}"),
    (b"\x80\x04\x95", f"a Python pickle, which is never opened: {_SAVE}"),
    (b"$IMURAW", f"a Waypoint IMR file: {_AS_IT_IS}"),
    (b"%PDF", "a PDF: no table can be read from it"),
    (b"\xd0\xcf\x11\xe0", f"an old workbook (xls): {_SAVE}"),
    (b"<", f"HTML or XML: {_SAVE}"),
    (b"{", f"JSON: {_SAVE}"),
)


_MATLAB_4 = "a MATLAB file of version 4: in MATLAB or Octave save it again (save -v7)"
_TYPES_4 = {1000 * machine + 10 * number + text for machine in range(5) for number in range(6) for text in range(3)}


def _is_matlab_4(start: bytes) -> bool:
    """Return whether a file begins with the five numbers of a matrix of version 4 and its name."""
    if len(start) < 22:
        return False
    kind, rows, columns, is_complex, length = struct.unpack(">5I" if start[0] == 0 and start[3] else "<5I", start[:20])
    name = start[20 : 19 + length]
    sized = rows > 0 and columns > 0 and is_complex in (0, 1) and 1 < length <= 64
    return kind in _TYPES_4 and sized and name.replace(b"_", b"a").isalnum()


def foreign_kind(start: bytes) -> str | None:
    """Return the kind of a file that begins so, and the way to a readable table; None: it may be text."""
    if _is_matlab_4(start):
        return _MATLAB_4
    begin = start.lstrip(b" \t\r\n") if start[:1] in b" \t\r\n" else start
    return next((words for magic, words in _KINDS if begin.startswith(magic)), None)
