"""Any file becomes a recording or a refusal of bounded length."""

import gzip
import io
from time import thread_time
from typing import Any

import numpy as np
import pytest

from bench_service.formats.description import ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.import_file import ImportFile, read_import
from tests.validation.imports import parsers


def test_random_and_mutated_files_are_read_or_refused() -> None:
    tally = parsers(500)
    assert tally.faults == []
    assert tally.recordings >= 50
    assert sum(tally.refusals.values()) >= 200


def _refusal(data: bytes, **changes: Any) -> str:
    channel = {"name": "gyro_x", "column": 0, "quantity": "angular_rate", "unit": "rad/s"}
    asked = {"unit": "U-1", "rate_hz": 100.0, "channels": [channel], "header": False, **changes}
    with pytest.raises(UnreadableFile) as refused:
        read_import([ImportFile("a.csv", io.BytesIO(data))], ImportDescription.model_validate(asked))
    return str(refused.value)


@pytest.mark.parametrize("blanks", [40_000, 200_000])
def test_blanks_within_a_line_take_a_time_in_proportion(blanks: int) -> None:
    channel = {"name": "gyro_x", "column": 1, "quantity": "angular_rate", "unit": "rad/s"}
    asked = {"unit": "U-1", "rate_hz": 100.0, "channels": [channel], "header": False, "delimiter": "whitespace"}
    data = b"\t 1" + b" \t" * (blanks // 2) + b"2  \n1 3\n"
    begun = thread_time()  # of this thread's own work: a busy machine does not count
    imported = read_import([ImportFile("a.csv", io.BytesIO(data))], ImportDescription.model_validate(asked))
    np.testing.assert_array_equal(np.concatenate(list(imported.blocks())), [[2], [3]])
    assert thread_time() - begun < 5.0  # by its square, 40 kB took 17 s and 200 kB would take 7 minutes


def test_bounds_are_named() -> None:
    assert "line 1 has more than 262144 bytes" in _refusal(b"1" * 300_000)
    assert "line 3 has more than 262144 bytes" in _refusal(b"1\n2\n" + b"3" * 300_000 + b"\n4\n")
    assert "line 300001 has more than 262144 bytes" in _refusal(b"1\n" * 300_000 + b"3" * 5_000_000)
    assert "has 5000 columns, at most 4096 are read" in _refusal(b",".join([b"1"] * 5000) + b"\n")


def test_a_message_does_not_repeat_the_file() -> None:
    names = ",".join(f"a_rather_long_name_{i}" for i in range(4000)).encode() + b"\n1\n"
    words = _refusal(names, header=True, channels=[{"name": "x", "quantity": "angular_rate", "unit": "count"}])
    assert "(4000 columns)" in words
    assert len(words) < 700
    assert len(_refusal(b"1\n" + b"x" * 200_000 + b"\n")) < 300


@pytest.mark.parametrize(
    ("start", "words"),
    [
        (b"PK\x03\x04" + bytes(100), "is a zip archive that is damaged or cut off"),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), "cannot be read as HDF5"),
        (b"ULog\x01\x12\x35" + bytes(100), "byte 16 is not the start of a message of a ULog"),
        (
            gzip.compress(b"ULog\x01\x12\x35" + bytes(100), mtime=0),
            "a ULog of a flight controller: it is read as it is",
        ),
        (b"\x80\x04\x95" + bytes(100), "a Python pickle, which is never opened"),
        (b'{"a": [1, 2]}', "JSON: save it as CSV"),
        (b"\x01\x00\x02\xff" * 500, "it contains zero bytes"),
    ],
)
def test_files_of_other_kinds_are_named(start: bytes, words: str) -> None:
    assert words in _refusal(start)
