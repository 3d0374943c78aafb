"""Logs are read in the limited process: what it says is what is read here, and its memory does not grow with a file."""

import io
from collections.abc import Generator
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin

from bench_service.formats.description import ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.import_request import ImportFile
from bench_service.formats.reader.client import FileReader
from procedures.core.errors import BadParameter
from tests.formats import frame_files
from tests.formats.reading import FORCES, RATES, proposed
from tests.formats.ros_files import bag2


@pytest.fixture(scope="module")
def reader() -> Generator[FileReader]:
    found = FileReader()
    yield found
    found.close()


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return bag2(tmp_path_factory.mktemp("bag") / "db", StoragePlugin.SQLITE3)


def test_a_proposal_and_its_import_come_through(reader: FileReader, database: bytes) -> None:
    """An SQLite file has no name there: it is a descriptor of an unnamed file."""
    file = ImportFile("a.db3", io.BytesIO(database))
    there = reader.describe(file, "SN-1", None, None)
    assert there == proposed(database, "a.db3")
    with reader.reading([file], ImportDescription.model_validate(there.description)) as imported:
        values = np.concatenate(list(imported.blocks()))
    np.testing.assert_array_equal(values, np.hstack([RATES, FORCES]))
    assert imported.source["second_clock"]["column"] == "log_time"


def test_refusals_come_through_as_the_same_errors(reader: FileReader) -> None:
    file = ImportFile("a.bin", io.BytesIO(frame_files.stim300()))
    with pytest.raises(UnreadableFile, match=r"a.bin: has no whole messages of an HG4930"):
        reader.describe(file, None, "hg4930", None)
    with pytest.raises(BadParameter, match="format"):
        reader.describe(file, None, "nothing", None)
    with pytest.raises(UnreadableFile, match="there is no table 'x'"):
        reader.describe(file, None, None, "x")


def test_a_simulated_export_stays_so_through_the_process(reader: FileReader, tmp_path: Path) -> None:
    text = (
        "# recording: R\n# unit: SIM-1\n# rate_hz: 10.0\n# first_sample: 0\n# simulated: true\n"
        "# content_hash_of_whole_recording: 0\n# samples_of_whole_recording: 2\n"
        "# channel gyro_x: quantity=angular_rate unit=rad/s scale=0.5 offset=0.0\ntime_s,gyro_x\n0,1\n0.1,2\n"
    )
    path = tmp_path / "a.csv"
    path.write_text(text)
    channel = {"name": "gyro_x", "quantity": "angular_rate", "unit": "rad/s"}
    wanted = ImportDescription.model_validate({"unit": "U", "rate_hz": 10.0, "channels": [channel]})
    with path.open("rb") as stream, reader.reading([ImportFile("a.csv", stream)], wanted) as imported:
        assert imported.description.simulated
        assert any("stays marked as simulated" in words for words in imported.source["warnings"])
