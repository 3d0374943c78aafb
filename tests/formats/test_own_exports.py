"""Our own exports come back, from every format: simulated stays simulated, corrected stays corrected, a part a part."""

import gzip
import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.io import loadmat, savemat

from bench_service.formats.errors import UnreadableFile
from bench_service.formats.export import ExportFormat, Extract, export, extract
from bench_service.formats.proposal.model import Proposal
from bench_service.formats.samples_out.archive import archived
from bench_service.formats.samples_out.naming import file_stem
from bench_service.formats.samples_out.sheet import Sheet, Treatment, physical_sheet, raw_sheet
from bench_service.formats.samples_out.sheet_files import SheetFormat, written
from procedures.core.errors import BadParameter
from procedures.core.imu_model import triad_calibration
from procedures.core.recording import Channel, Quantity, RecordingInfo
from tests.formats.reading import proposed, read
from tests.kit.sample_sheets import CHANNELS, INFO, RATE, RAW, blocks, part_of, values

TABLES = [SheetFormat.PARQUET, SheetFormat.ARROW, SheetFormat.ARROW_FILE, SheetFormat.HDF5, SheetFormat.MATLAB]
"""Formats with a place for facts and for columns of any meaning."""
CALIBRATION = triad_calibration(
    "gyro", "rad/s", "rad/s", np.column_stack([[1e-3, 2e-3, -3e-3], 1.01 * np.eye(3)]).ravel(), np.zeros((12, 12))
)
SI = (Quantity.ANGULAR_RATE,) * 3 + (Quantity.SPECIFIC_FORCE,) * 3 + (Quantity.TEMPERATURE,)


def file_of(made: Sheet, form: SheetFormat) -> bytes:
    return b"".join(written(made, form))


def physical(treatment: Treatment | None = None, part: Extract | None = None) -> Sheet:
    chosen = part or part_of()
    return physical_sheet(chosen, blocks(chosen), treatment)


def data_file(form: ExportFormat, part: Extract | None = None) -> bytes:
    chosen = part or part_of()
    return b"".join(export(chosen, blocks(chosen), form))


def come_back(data: bytes, name: str = "log", **changes: Any) -> tuple[Proposal, Any, np.ndarray]:
    """The proposal of a file in which nothing is unknown, and what an import by it reads."""
    proposal = proposed(data, name, unit=None)
    assert proposal.unknown == [], proposal
    recording, found = read(data, {**proposal.description, **changes}, name)
    return proposal, recording, found


@pytest.mark.parametrize("form", TABLES)
def test_raw_samples_come_back_with_their_scales_and_as_simulated(form: SheetFormat) -> None:
    part = part_of()
    proposal, recording, _ = come_back(file_of(raw_sheet(part, blocks(part)), form), simulated=False)
    assert recording.channels == CHANNELS
    assert recording.description.simulated
    assert (recording.rate_hz, recording.description.start_s, recording.dtype) == (RATE, 12.5, np.int32)
    np.testing.assert_array_equal(np.concatenate(list(recording.blocks())), RAW)
    assert proposal.notes == ["an export of our recording r-1: its description is as it was"]
    assert recording.source["exports"][0]["content_hash_of_whole_recording"] == "f00d"
    assert any("stays marked as simulated" in words for words in recording.source["warnings"])


@pytest.mark.parametrize("form", TABLES)
def test_physical_samples_come_back_as_rates_in_si(form: SheetFormat) -> None:
    proposal, recording, found = come_back(file_of(physical(), form))
    assert [c.name for c in recording.channels] == [c.name for c in CHANNELS]
    assert tuple(c.quantity for c in recording.channels) == SI
    assert recording.description.simulated
    np.testing.assert_allclose(found, values(), rtol=1e-14)
    assert proposal.notes == ["an export of our recording r-1 in SI units, not as it is stored"]


@pytest.mark.parametrize("form", [*TABLES, SheetFormat.MCAP])
def test_a_correction_is_said_when_its_samples_come_back(form: SheetFormat) -> None:
    treatment = Treatment((CALIBRATION,), ("c-1",), 4)
    proposal, recording, found = come_back(file_of(physical(treatment), form))
    assert recording.description.simulated
    kept = recording.source["exports"][0]
    assert (kept["calibration_gyro"], kept["decimated_by"]) == ("c-1", "4")
    assert kept["correction_gyro"].startswith("v = inv(K)*(u - b), b = [0.001, 0.002, -0.003], K = [[1.01, 0.0, 0.0]")
    for said in (proposal.suspicious, recording.source["warnings"]):
        assert any("corrected by calibration c-1" in words for words in said)
        assert any("the mean of 4 samples" in words for words in said)
    means = values().reshape(250, 4, 7).mean(axis=1)
    np.testing.assert_allclose(found[:, :3], (means[:, :3] - [1e-3, 2e-3, -3e-3]) / 1.01, rtol=1e-9, atol=1e-12)
    if form is not SheetFormat.MCAP:  # its messages have stamps of their own, from zero
        assert recording.description.start_s == pytest.approx(12.5 + 1.5 / RATE, abs=1e-12)
    assert recording.rate_hz == pytest.approx(RATE / 4, rel=1e-9)


def test_an_mcap_comes_back_as_simulated_by_its_channel_alone() -> None:
    """Other programs copy the metadata of a channel with it, and may drop those of the file."""
    data = file_of(physical(), SheetFormat.MCAP)
    record = b"\x0c"
    at = data.index(record, data.index(b"/imu"))
    while data[at + 9 : at + 18] != b"\x05\x00\x00\x00bench":
        at = data.index(record, at + 1)
    length = int.from_bytes(data[at + 1 : at + 9], "little")
    stripped = data[:at] + b"\x7f" + data[at + 1 : at + 9 + length] + data[at + 9 + length :]  # a record of no meaning
    for copy in (data, stripped):
        proposal = proposed(copy, "copy.mcap", unit="U-9")
        assert proposal.description["simulated"] is True
        recording, _ = read(copy, {**proposal.description, "simulated": False}, "copy.mcap")
        assert recording.description.simulated


@pytest.mark.parametrize("packed", ["plain", "gz", "crlf", "bom", "utf-16", "utf-16-be"])
def test_a_csv_comes_back_however_it_was_packed_or_encoded(packed: str) -> None:
    text = data_file(ExportFormat.CSV)
    data = {
        "plain": text,
        "gz": gzip.compress(text),
        "crlf": text.replace(b"\n", b"\r\n"),
        "bom": b"\xef\xbb\xbf" + text,
        "utf-16": text.decode().encode("utf-16"),
        "utf-16-be": b"\xfe\xff" + text.decode().encode("utf-16-be"),
    }[packed]
    _, recording, _ = come_back(data)
    assert recording.channels == CHANNELS
    assert recording.description.simulated
    np.testing.assert_array_equal(np.concatenate(list(recording.blocks())), RAW)


def test_a_csv_without_a_place_for_facts_is_simulated_by_its_name() -> None:
    name = f"{file_stem(part_of(), 'physical')}.csv"
    assert name == "r-1-physical-simulated.csv"
    data = file_of(physical(), SheetFormat.CSV)
    for known in (name, "r-1-physical-simulated (1).csv", "r-1-physical-simulated.csv.gz"):
        packed = gzip.compress(data) if known.endswith("gz") else data
        proposal = proposed(packed, known)
        assert proposal.description["simulated"] is True
        assert read(packed, {**proposal.description, "simulated": False}, known)[0].description.simulated
    assert "simulated" not in proposed(data, "simulated-drive.csv").description


def test_a_zip_of_a_job_is_simulated_by_the_names_in_it() -> None:
    data = file_of(physical(), SheetFormat.CSV)
    packed = b"".join(archived([(f"001-{file_stem(part_of(), 'physical')}.csv", [data], {})], {}))
    proposal = proposed(packed, "job.zip")
    assert (proposal.unknown, proposal.description["simulated"]) == ([], True)
    recording, found = read(packed, {**proposal.description, "simulated": False}, "job.zip")
    assert recording.description.simulated
    np.testing.assert_allclose(found, values(), rtol=1e-14)


def test_what_a_mixed_bench_recorded_stays_so() -> None:
    info = replace(INFO, simulated=False)
    part = extract(info, "int32", origin="mixed")
    made = b"".join(export(part, blocks(part), ExportFormat.PARQUET))
    _, recording, _ = come_back(made)
    assert (recording.source["origin"], recording.description.simulated) == ("mixed", False)
    assert any("real and simulated devices" in words for words in recording.source["warnings"])
    real = extract(info, "int32", origin="real")
    _, recording, _ = come_back(b"".join(export(real, blocks(real), ExportFormat.PARQUET)))
    assert "origin" not in recording.source  # a file cannot prove it


def test_a_part_says_which_and_is_not_called_as_it_was() -> None:
    gyros = extract(INFO, "int32", ["gyro_x", "gyro_y", "gyro_z"])
    proposal, _, _ = come_back(data_file(ExportFormat.PARQUET, gyros))
    assert "as it was" not in " ".join(proposal.notes)
    assert "without the channels accelerometer_x, accelerometer_y, accelerometer_z, temp" in " ".join(proposal.notes)
    proposal, _, _ = come_back(data_file(ExportFormat.CSV, extract(INFO, "int32", None, 0.25, 2.0)))
    assert "700 rows of its 1000 samples, from sample 100 on" in " ".join(proposal.notes)
    table = pq.read_table(io.BytesIO(data_file(ExportFormat.PARQUET))).drop_columns(["gyro_y"])
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink)
    proposal, _, _ = come_back(sink.getvalue().to_pybytes())
    assert "without the channels gyro_y" in " ".join(proposal.notes)


ODD = ("time_s", "about", "units", "channels", "a" * 60 + "_one", "a" * 60 + "_two", "time_s_2")
ODD_CHANNELS = tuple(Channel(name, Quantity.ANGULAR_RATE, "rad/s", 0.5 + k) for k, name in enumerate(ODD))


@pytest.mark.parametrize("form", [*TABLES, ExportFormat.CSV, ExportFormat.PARQUET])
@pytest.mark.parametrize("raw", [True, False])
def test_channels_of_any_name_keep_their_values_apart(form: SheetFormat | ExportFormat, raw: bool) -> None:
    """Names that are a table's own, and such as differ after the 63rd letter alone, which MATLAB cuts off."""
    info = RecordingInfo("r-2", "U-1", ODD_CHANNELS, 100.0, 50)
    samples = np.arange(350, dtype=np.int32).reshape(50, 7)
    part = extract(info, "int32")
    if isinstance(form, ExportFormat):
        data = b"".join(export(part, [samples], form))
    else:
        data = file_of(raw_sheet(part, [samples]) if raw else physical_sheet(part, [samples]), form)
    _, recording, found = come_back(data)
    assert [c.name for c in recording.channels] == list(ODD)
    np.testing.assert_allclose(found, samples * (0.5 + np.arange(7)), rtol=1e-14)


def test_matlab_has_the_unit_of_each_number_and_its_scale(tmp_path: Path) -> None:
    part = part_of()
    raw = loadmat(io.BytesIO(file_of(raw_sheet(part, blocks(part)), SheetFormat.MATLAB)), simplify_cells=True)
    assert raw["units"]["gyro_x"] == "count"
    said = raw["channels"]["accelerometer_y"]
    assert (said["unit"], said["scale"], said["offset"]) == ("m/s", 1e-6, 3.0)
    np.testing.assert_allclose(said["scale"] * (raw["accelerometer_y"] - said["offset"]), (RAW[:, 4] - 3.0) * 1e-6)
    si = loadmat(io.BytesIO(file_of(physical(), SheetFormat.MATLAB)), simplify_cells=True)
    assert si["units"]["gyro_x_rad_per_s"] == "rad/s"
    assert si["channels"]["gyro_x_rad_per_s"]["quantity"] == "angular_rate"
    # saved anew, and as MATLAB writes version 7.3: text as numbers of its letters, structs as groups
    again = io.BytesIO()
    savemat(again, {k: v for k, v in raw.items() if not k.startswith("__")}, oned_as="column", do_compression=True)
    _, recording, _ = come_back(again.getvalue())
    assert (recording.description.simulated, recording.channels) == (True, CHANNELS)
    with h5py.File(tmp_path / "new.mat", "w", userblock_size=512) as store:
        _as_matlab(store, raw)
    _, recording, _ = come_back((tmp_path / "new.mat").read_bytes())
    assert recording.description.simulated
    np.testing.assert_array_equal(np.concatenate(list(recording.blocks())), RAW)


def _as_matlab(group: Any, content: dict[str, Any]) -> None:
    """Store variables as MATLAB's version 7.3 does."""
    for name, value in content.items():
        if name.startswith("__"):
            continue
        if isinstance(value, dict):
            inner = group.create_group(name)
            inner.attrs["MATLAB_class"] = np.bytes_("struct")
            _as_matlab(inner, value)
        elif np.asarray(value).dtype.kind == "U":
            made = group.create_dataset(name, data=np.array([[ord(c)] for c in str(value)], np.uint16))
            made.attrs["MATLAB_class"] = np.bytes_("char")
        else:
            array = np.atleast_2d(np.asarray(value))
            made = group.create_dataset(name, data=array)
            kind = {"i": "int32", "f": "double"}[array.dtype.kind]
            made.attrs["MATLAB_class"] = np.bytes_(kind)


def test_too_much_decimation_and_facts_that_are_no_numbers_are_refused() -> None:
    with pytest.raises(BadParameter, match="recording r-1 has no more samples"):
        physical(Treatment(decimate=1001))
    damaged = data_file(ExportFormat.CSV).replace(b"# rate_hz: 400.0", b"# rate_hz: nan")
    with pytest.raises(UnreadableFile, match="no finite numbers"):
        proposed(damaged)


def test_units_in_the_metadata_of_others_columns_are_taken() -> None:
    """pandas, and those who follow the CF conventions, put a unit into a field's metadata."""
    names = [f"gyro_{a}" for a in "xyz"] + [f"acc_{a}" for a in "xyz"]
    fields = [pa.field(n, pa.float64(), metadata={"unit": "deg/s" if "gyro" in n else "mg"}) for n in names]
    fields += [pa.field("temp", pa.float64(), metadata={"units": "degC", "scale_factor": "0.01"})]
    columns = [np.linspace(1, 2, 300)] * 6 + [np.arange(300.0)]
    sink = pa.BufferOutputStream()
    stamps = pa.field("t", pa.float64())
    table = pa.table([np.arange(300) / 100.0, *columns], schema=pa.schema([stamps, *fields]))
    pq.write_table(table, sink)
    found = proposed(sink.getvalue().to_pybytes())
    assert [c.unit for c in found.columns] == ["deg/s"] * 3 + ["mg"] * 3 + ["degC"]
    assert len(found.unknown) == 1
    assert "scale_factor = '0.01'" in found.unknown[0]
