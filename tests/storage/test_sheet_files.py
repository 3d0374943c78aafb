"""Samples as people's tools read them: pandas, h5py, scipy, pyarrow and numpy, without a word of explanation."""

import io
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from pyarrow import feather
from scipy.io import loadmat

from bench_service.formats.samples_out.sheet import Sheet, Treatment, physical_sheet, raw_sheet
from bench_service.formats.samples_out.sheet_files import SheetFormat, written
from procedures.core.errors import BadParameter
from procedures.core.imu_model import TriadCalibration, correct, triad_calibration
from tests.kit.sample_sheets import RATE, RAW, blocks, part_of, sheet, values

NAMES = [
    "time_s", "gyro_x_rad_per_s", "gyro_y_rad_per_s", "gyro_z_rad_per_s", "accelerometer_x_m_per_s2",
    "accelerometer_y_m_per_s2", "accelerometer_z_m_per_s2", "temperature_case_degC",
]  # fmt: skip


def a_calibration(triad: str = "gyro", unit: str = "rad/s") -> TriadCalibration:
    k = np.eye(3) + np.random.Generator(np.random.PCG64(5)).uniform(-0.02, 0.02, (3, 3))
    return triad_calibration(triad, unit, unit, np.column_stack([[1e-3, 2e-3, -3e-3], k]).ravel(), np.zeros((12, 12)))


def read(form: SheetFormat, data: bytes, folder: Path) -> pd.DataFrame:
    """Columns of the file as an engineer's own reader has them."""
    file = folder / f"samples.{form.value}"
    file.write_bytes(data)
    readers: dict[SheetFormat, Callable[[], pd.DataFrame]] = {
        SheetFormat.CSV: lambda: pd.read_csv(file),
        SheetFormat.PARQUET: lambda: pd.read_parquet(file),
        SheetFormat.ARROW: lambda: __import__("pyarrow").ipc.open_stream(data).read_all().to_pandas(),
        SheetFormat.ARROW_FILE: lambda: feather.read_feather(file),
        SheetFormat.NPY: lambda: pd.DataFrame(np.load(file), columns=NAMES),
        SheetFormat.HDF5: lambda: pd.DataFrame({n: h5py.File(file)[n][:] for n in NAMES}),
        SheetFormat.MATLAB: lambda: pd.DataFrame({n: loadmat(file)[n].ravel() for n in NAMES}),
    }
    return readers[form]()


@pytest.mark.parametrize("form", [f for f in SheetFormat if f is not SheetFormat.MCAP])
def test_each_reader_finds_time_and_si_values_under_names_with_units(form: SheetFormat, tmp_path: Path) -> None:
    found = read(form, b"".join(written(sheet(start=100, stop=900), form)), tmp_path)
    assert list(found.columns) == NAMES
    np.testing.assert_allclose(found["time_s"], np.arange(100, 900) / RATE, rtol=1e-15)
    np.testing.assert_allclose(found[NAMES[1:]], values()[100:900], rtol=1e-14)


@pytest.mark.parametrize("form", ["csv", "parquet", "arrow", "feather"])
def test_polars_and_duckdb_read_the_same_without_an_option(form: str, tmp_path: Path) -> None:
    """In the Arrow formats duckdb reads what polars or pyarrow opened: it has no reader of their files."""
    import duckdb
    import polars as pl

    file = tmp_path / f"samples.{form}"
    file.write_bytes(b"".join(written(sheet(), SheetFormat(form))))
    by_polars = {"csv": pl.read_csv, "parquet": pl.read_parquet, "arrow": pl.read_ipc_stream, "feather": pl.read_ipc}[
        form
    ](file)
    source = f"'{file}'" if form in ("csv", "parquet") else "by_polars"
    by_duckdb = duckdb.sql(f"SELECT * FROM {source}").fetchnumpy()
    assert by_polars.columns == list(by_duckdb) == NAMES
    for name, column in zip(NAMES[1:], values().T, strict=True):
        np.testing.assert_allclose(by_polars[name].to_numpy(), column, rtol=1e-14)
        np.testing.assert_allclose(np.asarray(by_duckdb[name]), column, rtol=1e-14)


def test_units_and_origin_travel_in_hdf5_and_matlab(tmp_path: Path) -> None:
    (tmp_path / "s.h5").write_bytes(b"".join(written(sheet(), SheetFormat.HDF5)))
    with h5py.File(tmp_path / "s.h5") as store:
        assert store["gyro_x_rad_per_s"].attrs["unit"] == "rad/s"
        assert (store.attrs["recording"], store.attrs["simulated"]) == ("r-1", "true")
    found = loadmat(io.BytesIO(b"".join(written(sheet(), SheetFormat.MATLAB))), simplify_cells=True)
    assert found["units"]["accelerometer_z_m_per_s2"] == "m/s^2"
    assert found["about"]["unit"] == "U-1"


def test_raw_samples_keep_their_type_and_say_how_to_scale_them(tmp_path: Path) -> None:
    part = part_of()
    (tmp_path / "s.h5").write_bytes(b"".join(written(raw_sheet(part, blocks(part)), SheetFormat.HDF5)))
    with h5py.File(tmp_path / "s.h5") as store:
        column = store["accelerometer_y"]
        assert column.dtype == np.int32
        assert column[:].tolist() == RAW[:, 4].tolist()
        assert (float(column.attrs["scale"]), float(column.attrs["offset"])) == (1e-6, 3.0)


def test_a_calibration_corrects_its_triad_and_leaves_the_other() -> None:
    one = a_calibration()
    made = sheet(Treatment((one,), ("c-1",)))
    rows = np.concatenate([np.column_stack(block) for block in made.blocks])
    np.testing.assert_allclose(rows[:, 1:4], correct(values()[:, :3], one), rtol=0, atol=1e-16)
    np.testing.assert_allclose(rows[:, 4:], values()[:, 3:], rtol=1e-15)
    assert made.about["calibration_gyro"] == "c-1"


def test_decimation_takes_means_across_blocks_with_the_time_of_their_middle() -> None:
    made = sheet(Treatment(decimate=30), start=10)
    rows = np.concatenate([np.column_stack(block) for block in made.blocks])
    whole = values()[10:1000].reshape(33, 30, 7).mean(axis=1)
    assert len(rows) == made.rows == 33
    np.testing.assert_allclose(rows[:, 1:], whole, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(rows[:, 0], (10 + 30 * np.arange(33) + 14.5) / RATE, rtol=1e-14)
    assert float(made.about["rate_hz"]) == pytest.approx(RATE / 30)


def test_what_does_not_fit_is_refused_in_words() -> None:
    part = part_of(channels=["gyro_x", "gyro_y"])
    with pytest.raises(BadParameter, match="gyro_z not among the channels"):
        physical_sheet(part, blocks(part), Treatment((a_calibration(),), ("c-1",)))
    with pytest.raises(BadParameter, match="outputs in count"):
        sheet(Treatment((a_calibration(unit="count"),), ("c-1",)))
    with pytest.raises(BadParameter, match="decimate = 0"):
        sheet(Treatment(decimate=0))
    large = Sheet(sheet().columns, {}, 2_000_000, ())
    with pytest.raises(BadParameter, match="h5, parquet or csv"):
        written(large, SheetFormat.MATLAB)
