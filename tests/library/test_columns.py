"""Files that the library reads: with and without a header, from numpy, and those that it refuses."""

from pathlib import Path

import numpy as np
import pytest

import procedures.library as inertial


def test_a_text_file_gives_its_named_columns(tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    file.write_text("\ufeff# a remark\ntime_s, gyro_x\n0.0, 1.5\n0.1, nan\n")
    found = inertial.load(str(file))
    assert (tuple(found), len(found)) == (("time_s", "gyro_x"), 2)
    np.testing.assert_array_equal(found["gyro_x"], [1.5, np.nan])
    with pytest.raises(inertial.DomainError, match="no channel 'gyro_y'; it has time_s, gyro_x"):
        found["gyro_y"]


def test_a_file_without_a_header_gives_numbered_columns(tmp_path: Path) -> None:
    file = tmp_path / "log.txt"
    file.write_text("1 2\n3 4\n")
    found = inertial.load(str(file), delimiter=" ")
    assert found.names == ("column_0", "column_1")
    np.testing.assert_array_equal(found.values, [[1.0, 2.0], [3.0, 4.0]])


def test_numpy_files_give_their_columns(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.arange(6).reshape(3, 2))
    np.savez(tmp_path / "b.npz", gyro_x=np.arange(3), gyro_y=np.ones(3))
    assert inertial.load(str(tmp_path / "a.npy")).values.shape == (3, 2)
    np.testing.assert_array_equal(inertial.load(str(tmp_path / "b.npz"))["gyro_y"], np.ones(3))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "cannot be read"),
        ("a,a\n1,2\n", "its header has a name twice"),
        ("a,b\n1,\n", "cannot be read"),
        ("a,b\n1,2\n1,2,3\n", "cannot be read"),
        ("a,b\n1,x\n", "'x'"),
    ],
)
def test_a_file_that_is_no_table_is_refused(text: str, sentence: str, tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    file.write_text(text)
    with pytest.raises(inertial.DomainError, match=sentence):
        inertial.load(str(file))


def test_objects_in_a_numpy_file_are_not_unpickled(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(inertial.DomainError, match="cannot be read"):
        inertial.load(str(tmp_path / "a.npy"))
