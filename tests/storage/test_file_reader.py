"""Files are read in a process of their own: it has limits, and what becomes of it the service says in words."""

import io
import os
import signal
from collections.abc import Generator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

from bench_service.formats.bounds import Bounds
from bench_service.formats.description import ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.import_file import ImportFile, read_import
from bench_service.formats.reader.client import FileReader, NoRoom
from procedures.core.errors import BadParameter, UnfitRecording

CHANNEL = {"name": "gyro_x", "column": "x", "quantity": "angular_rate", "unit": "rad/s"}


@pytest.fixture(scope="module")
def reader() -> Generator[FileReader]:
    found = FileReader()
    yield found
    found.close()


def _description(**changes: Any) -> ImportDescription:
    return ImportDescription.model_validate({"unit": "U-1", "rate_hz": 100.0, "channels": [CHANNEL], **changes})


def _read(reader: FileReader, data: bytes, **changes: Any) -> tuple[Any, np.ndarray[Any, Any]]:
    with reader.reading([ImportFile("a.csv", io.BytesIO(data))], _description(**changes)) as imported:
        return imported, np.concatenate(list(imported.blocks()))


@pytest.mark.parametrize("integral", [True, False])
def test_what_comes_through_is_what_is_read_here(reader: FileReader, integral: bool) -> None:
    values = np.arange(400_000) if integral else np.arange(400_000) * 0.5
    data = b"t,x\n" + b"".join(b"%.2f,%r\n" % (i / 100, v) for i, v in enumerate(values.tolist()))
    asked = {"time_column": "t"}
    here = read_import([ImportFile("a.csv", io.BytesIO(data))], _description(**asked))
    there, samples = _read(reader, data, **asked)
    for name in ("rate_hz", "count", "dtype", "source", "channels"):
        assert getattr(there, name) == getattr(here, name), name
    assert samples.dtype == here.dtype
    np.testing.assert_array_equal(samples[:, 0], values)


@pytest.mark.parametrize(
    ("data", "changes", "error"),
    [
        (b"x\n1\ntwo\n", {}, UnreadableFile),
        (b"t,x\n0,1\n0,2\n", {"time_column": "t"}, UnfitRecording),
        (b"t,x\n0,1\n1,2\n2,3\n", {"time_column": "t"}, BadParameter),
    ],
)
def test_a_refusal_comes_through_as_the_same_error(
    reader: FileReader, data: bytes, changes: dict[str, Any], error: type[Exception]
) -> None:
    with pytest.raises(error) as here:
        read_import([ImportFile("a.csv", io.BytesIO(data))], _description(**changes))
    with pytest.raises(error) as there:
        _read(reader, data, **changes)
    assert str(there.value) == str(here.value)
    assert vars(there.value) == vars(here.value)


def test_a_small_file_that_unpacks_to_too_much_is_refused_for_its_memory(reader: FileReader) -> None:
    table = pa.table({"x": np.zeros(40_000_000)})
    sink = io.BytesIO()
    with pa.ipc.new_file(sink, table.schema, options=pa.ipc.IpcWriteOptions(compression="zstd")) as writer:
        writer.write_table(table)
    assert len(sink.getvalue()) < 1_000_000
    with pytest.raises(UnreadableFile, match="takes more than 250 MB of memory to read"):
        _read(reader, sink.getvalue())
    assert len(_read(reader, b"x\n1\n2\n")[1]) == 2


def test_a_file_that_takes_too_long_is_given_up(reader: FileReader, monkeypatch: pytest.MonkeyPatch) -> None:
    class Hurried(Bounds):
        @classmethod
        def of(cls, file_bytes: int) -> Bounds:
            return Bounds(time_s=0.05)

    monkeypatch.setattr("bench_service.formats.reader.client.Bounds", Hurried)
    with pytest.raises(UnreadableFile, match=r"took longer than 0 s to read"):
        _read(reader, b"x\n" + b"12345.678\n" * 3_000_000)
    monkeypatch.undo()
    assert len(_read(reader, b"x\n1\n2\n")[1]) == 2


def test_a_reader_that_dies_on_a_file_is_a_refusal(reader: FileReader) -> None:
    data = b"x\n" + b"12345.678\n" * 300_000
    with reader.reading([ImportFile("a.csv", io.BytesIO(data))], _description()) as imported:
        blocks = imported.blocks()
        next(blocks)
        _kill_children_of_host(reader)
        with pytest.raises(UnreadableFile, match="the process that read it ended"):
            list(blocks)
    assert len(_read(reader, b"x\n1\n2\n")[1]) == 2


def _children(reader: FileReader) -> list[int]:
    """The processes that read for it now, or have ended and not been waited for."""
    host = reader._host
    assert host is not None
    return [int(child) for child in Path(f"/proc/{host.pid}/task/{host.pid}/children").read_text().split()]


def _kill_children_of_host(reader: FileReader) -> None:
    for child in _children(reader):
        os.kill(child, signal.SIGKILL)


def test_a_host_that_died_is_begun_again(reader: FileReader) -> None:
    assert len(_read(reader, b"x\n1\n2\n")[1]) == 2
    assert reader._host is not None
    reader._host.kill()
    reader._host.wait()
    assert len(_read(reader, b"x\n1\n2\n")[1]) == 2


def test_a_reading_that_is_left_ends_its_process(reader: FileReader) -> None:
    data = b"x\n" + b"12345.678\n" * 300_000
    with reader.reading([ImportFile("a.csv", io.BytesIO(data))], _description()):
        (left,) = _children(reader)
    for _ in range(500):
        if left not in _children(reader):  # others may be there still: each reading has one, which ends after it
            break
        assert len(_read(reader, b"x\n1\n2\n")[1]) == 2
    else:
        raise AssertionError("a child is still there")


def test_a_full_temporary_folder_is_no_fault_of_the_file(reader: FileReader, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> object:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("bench_service.formats.reader.client.tempfile.TemporaryFile", full)
    with pytest.raises(NoRoom, match="No space left"):
        _read(reader, b"x\n1\n2\n")
