"""Refusals of an import name the file, the row and what was expected; what leaves something open, beforehand."""

import gzip
import io
from typing import Any

import pytest
from pydantic import ValidationError

from bench_service.formats.description import ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.import_file import ImportedRecording, ImportFile, read_import
from procedures.core.errors import BadParameter, DomainError, UnfitRecording

GYRO_X = {"name": "gyro_x", "column": "x", "quantity": "angular_rate", "unit": "rad/s"}
GYRO_Y = {**GYRO_X, "name": "gyro_y", "column": "y"}


def _description(**changes: Any) -> ImportDescription:
    given: dict[str, Any] = {"unit": "U-1", "channels": [GYRO_X, GYRO_Y], "rate_hz": 100.0}
    return ImportDescription.model_validate({**given, **changes})


def _read(text: str | bytes, **changes: Any) -> ImportedRecording:
    data = text if isinstance(text, bytes) else text.encode()
    return read_import([ImportFile("a.csv", io.BytesIO(data))], _description(**changes))


def _timed(times: list[float]) -> str:
    return "t,x,y\n" + "".join(f"{t!r},{i},{-i}\n" for i, t in enumerate(times))


Refusal = tuple[str | bytes, dict[str, Any], type[DomainError], str]
HEAD = "x,y\n"
REFUSALS: dict[str, Refusal] = {
    "empty file": ("", {}, UnreadableFile, "line 1 is empty"),
    "nothing but a header": (HEAD, {}, UnreadableFile, "no rows"),
    "shorter than its header": ("a\nb\n", {"header_lines": 5}, UnreadableFile, "line 6 is empty"),
    "unknown column": ("x,z\n1,2\n", {}, UnreadableFile, "has no column 'y'; the columns are x, z"),
    "column twice": (
        "x,y,y\n1,2,3\n",
        {},
        UnreadableFile,
        "has more than one column 'y'; the columns are x, y, y; 2 have this name: give the column by its number",
    ),
    "index too large": (
        "1,2\n",
        {"header": False, "channels": [{**GYRO_X, "column": 2}]},
        UnreadableFile,
        "no column 2",
    ),
    "name without header": ("1,2\n", {"header": False}, UnreadableFile, "has no column 'x'; the columns are 0 … 1"),
    "word": (HEAD + "1,2\n3,four\n", {}, UnreadableFile, "line 3, column 'y': 'four' where a finite number"),
    "nan": (HEAD + "1,2\nnan,4\n", {}, UnreadableFile, "line 3, column 'x': 'nan' where a finite number"),
    "infinity": (HEAD + "1,2\n3,-inf\n", {}, UnreadableFile, "line 3, column 'y': '-inf' where a finite number"),
    "empty cell": (HEAD + "1,2\n3,\n", {}, UnreadableFile, "line 3, column 'y': '' where a finite number"),
    "line cut off": (
        HEAD + "1,2\n3",
        {},
        UnreadableFile,
        "line 3 has 1 columns, 2 were expected; the file seems to be cut",
    ),
    "line too long": (HEAD + "1,2\n3,4,5\n6,7\n", {}, UnreadableFile, "line 3 has 3 columns, 2 were expected"),
    "bad line after blank ones": (HEAD + "\n\n1,2\n3\n", {}, UnreadableFile, "line 5 has 1 columns"),
    "whitespace, cut": (
        "1 2\n3",
        {"header": False, "delimiter": "whitespace", "channels": [{**GYRO_X, "column": 1}]},
        UnreadableFile,
        "line 2 has 1 columns",
    ),
    "gzip cut off": (
        gzip.compress(HEAD.encode() + b"1,2\n" * 9999)[:-20],
        {},
        UnreadableFile,
        "a compressed file that is cut off",
    ),
    "gzip damaged": (
        gzip.compress(HEAD.encode() + b"1,2\n" * 99)[:-8] + b"\0" * 8,
        {},
        UnreadableFile,
        "compressed file",
    ),
    "too large for 32 bits": (
        HEAD + "1,2\n3,2147483648\n",
        {},
        UnfitRecording,
        "row 2, channel 'gyro_y': 2147483648 does not fit",
    ),
    "time stands still": (
        _timed([0, 0.01, 0.01, 0.02]),
        {"time_column": "t"},
        UnfitRecording,
        "the time has no room for 1 of the rows: 1 between rows 2 and 3 (0.01 s from the first)",
    ),
    "time goes back": (_timed([0, 0.01, 0.02, 0.015]), {"time_column": "t"}, UnfitRecording, "row 3, 0.015 s in row 4"),
    "gap": (
        _timed([0, 0.01, 0.02, 0.05, 0.06]),
        {"time_column": "t"},
        UnfitRecording,
        "at 100 Hz 2 samples are missing in 1 place: 2 between rows 3 and 4 (0.02 s from the first)",
    ),
    "another rate": (
        _timed([0, 0.01, 0.02]),
        {"time_column": "t", "rate_hz": 400.0},
        BadParameter,
        "rate_hz = 400.0: the time column of a.csv says 100 Hz",
    ),
    "one row": (_timed([0]), {"time_column": "t", "rate_hz": None}, UnreadableFile, "fewer than two rows"),
    "wrong unit of time": (
        _timed([0, 10, 20]),
        {"time_column": "t", "time_unit": "us"},
        BadParameter,
        "says 100000 Hz",
    ),
    "binary": (bytes(range(256)) * 9, {}, UnreadableFile, "a.csv"),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_what_does_not_fit_is_refused_in_words(case: str) -> None:
    data, changes, error, words = REFUSALS[case]
    with pytest.raises(error) as refusal:
        _read(data, **changes)
    assert words in str(refusal.value)
    assert "a.csv" in str(refusal.value)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"channels": [{k: v for k, v in GYRO_X.items() if k != "unit"}]}, "Field required"),
        ({"channels": [{**GYRO_X, "unit": "knots"}]}, "'knots' is none of rad/s, mrad/s, deg/s, mdeg/s, deg/h, count"),
        ({"channels": [{**GYRO_X, "scale": 0.0}]}, "the scale not zero"),
        ({"channels": [{**GYRO_X, "scale": float("nan")}]}, "finite number"),
        ({"channels": [{**GYRO_X, "scale": 1e-100}]}, "channels.0.scale\n  Value error, scale 1e-100"),
        ({"channels": [{**GYRO_X, "scale": -1e300}]}, "1e-20 … 1e+20"),
        ({"channels": [{**GYRO_X, "offset": 1e300}]}, "channels.0.offset\n  Input should be less than"),
        ({"channels": [{**GYRO_X, "colour": "red"}]}, "Extra inputs"),
        ({"channels": [GYRO_X, GYRO_X]}, "each needs its own name"),
        ({"channels": []}, "at least 1"),
        ({"rate_hz": None}, "give rate_hz, or time_column, or both"),
        ({"rate_hz": float("inf")}, "finite number"),
        ({"rate_hz": -1.0}, "greater than 0"),
        ({"rate_hz": 1e-300}, "1e-09 … 1e+09 Hz"),
        ({"sampling": 1}, "Extra inputs"),
    ],
)
def test_a_description_that_leaves_something_open_is_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ValidationError) as refusal:
        _description(**changes)
    assert words in str(refusal.value)
