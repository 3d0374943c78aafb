"""Text exports and zips of phones and data sets: what is proposed of them, and what stays unknown; our own exports."""

import io
import zipfile
from typing import Any

import numpy as np
import pytest

from bench_service.formats.chunk import sample_type
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.export import ExportFormat, export, extract
from bench_service.formats.logs.oxts import OXTS
from bench_service.formats.proposal.model import Proposal
from procedures.core.recording import Channel, Quantity, RecordingInfo
from tests.formats.packed_files import kitti_drive, zipped
from tests.formats.reading import FORCES, RATES, ROWS, TIMES_NS, proposed, read, require_motion


def _lines(head: str, cells: Any, separator: str = ",") -> bytes:
    return (head + "".join(separator.join(cells(row)) + "\n" for row in range(ROWS))).encode()


def _six(row: int, forces: float = 1.0) -> list[str]:
    return [repr(float(v)) for v in (*RATES[row], *(FORCES[row] * forces))]


def test_euroc() -> None:
    names = [f"{k}_RS_S_{a} [{u}]" for k, u in (("w", "rad s^-1"), ("a", "m s^-2")) for a in "xyz"]
    data = _lines(f"#timestamp [ns],{','.join(names)}\n", lambda row: [str(TIMES_NS[row]), *_six(row)])
    proposal, _ = require_motion(data, 0.0, "data.csv")
    assert (proposal.format, proposal.unknown) == ("euroc", [])
    assert proposal.description["time_unit"] == "ns"


def test_xsens_with_its_ticks_of_a_tenth_of_a_millisecond_that_wrap() -> None:
    names = "PacketCounter SampleTimeFine Acc_X Acc_Y Acc_Z Gyr_X Gyr_Y Gyr_Z".replace(" ", "\t")
    head = f"// General information:\n//  Sample rate: 200.0Hz\n{names}\n"

    def cells(row: int) -> list[str]:
        six = _six(row)
        return [str((65_500 + row) % 65_536), str((2**32 - 5000 + 50 * row) % 2**32), *six[3:], *six[:3]]

    proposal, recording = require_motion(_lines(head, cells, "\t"), 0.0, "MT_01.txt")
    assert (proposal.format, proposal.unknown) == ("xsens", [])
    assert {"time_unit": "100us", "unwrap_clock": True}.items() <= proposal.description.items()
    assert recording.source["clock"]["wraps"][0]["period"] == "2^32 ticks of 0.1 ms"


def test_a_text_with_decimal_commas_whose_units_have_to_be_said() -> None:
    def cells(row: int) -> list[str]:
        return [cell.replace(".", ",") for cell in (f"{row * 0.005:.3f}", *_six(row, 1 / 9.80665))]

    data = _lines("Zeit;wx;wy;wz;ax;ay;az\n", cells, ";")
    proposal, _ = require_motion(data, 1e-14, "mess.csv")
    assert any("taken as g (the mean of |f|" in words for words in proposal.notes)
    assert any("the unit of the gyros (wx, wy, wz) is not said" in words for words in proposal.unknown)
    assert any("'Zeit', is taken as the time by its place alone" in words for words in proposal.unknown)


def test_two_files_of_a_phone_in_a_zip() -> None:
    """Sensor Logger writes z, y, x: the axes come by name, and a file without gravity is doubted."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, values in (("Gyroscope.csv", RATES), ("TotalAcceleration.csv", FORCES)):
            head = "time,seconds_elapsed,z,y,x\n"
            text = _lines(
                head, lambda r, v=values: [str(TIMES_NS[r]), repr(r * 0.005), *map(repr, v[r, ::-1].tolist())]
            )
            archive.writestr(f"2026-11-30/{name}", text)
        archive.writestr("2026-11-30/Metadata.csv", "device\nphone\n")
    data = packed.getvalue()
    for member, truth in (("Gyroscope", RATES), ("TotalAcceleration", FORCES)):
        proposal = proposed(data, table=f"2026-11-30/{member}.csv")
        assert proposal.format == "zip"
        recording, values = read(data, proposal.description)
        np.testing.assert_array_equal(values, truth)
        assert recording.rate_hz == pytest.approx(200.0, rel=1e-9)


def test_a_file_of_a_phone_without_gravity_is_doubted() -> None:
    data = _lines(
        "time,seconds_elapsed,z,y,x\n", lambda r: [str(TIMES_NS[r]), repr(r * 0.005), "0.1", "-0.1", f"0.{r}"]
    )
    proposal = proposed(data, "Accelerometer.csv")
    assert any("is without gravity" in words for words in proposal.unknown)
    assert any("gravity seems to be taken off" in words for words in proposal.suspicious)


def test_a_drive_of_kitti_in_a_zip() -> None:
    data = zipped(kitti_drive("drive/oxts/"))
    proposal, _ = require_motion(data, 0.0)
    assert proposal.description["time_column"] == "timestamp"
    with pytest.raises(UnreadableFile, match="is a zip archive that is damaged or cut off"):
        proposed(data[:-100])


def test_samples_of_kitti_in_one_text_need_their_rate_said() -> None:
    def cells(row: int) -> list[str]:
        values = [0.0] * len(OXTS)
        for place, value in zip([*range(17, 20), *range(11, 14)], [*RATES[row], *FORCES[row]], strict=True):
            values[place] = float(value)
        return list(map(repr, values))

    proposal = proposed(_lines("", cells, " "))
    assert proposal.format == "kitti"
    assert any("rate_hz" in words for words in proposal.unknown)
    _, values = read(_lines("", cells, " "), {**proposal.description, "rate_hz": 200.0})
    np.testing.assert_array_equal(values, np.hstack([RATES, FORCES]))


def test_a_text_without_names_is_not_guessed() -> None:
    proposal = proposed(_lines("", lambda r: [repr(r * 0.005), *_six(r)]))
    assert any("which column is which channel" in words for words in proposal.unknown)
    assert "channels" not in proposal.description


def test_increments_at_a_wrong_rate_are_seen_by_gravity() -> None:
    """Half of gravity: the declared rate, or the number of samples summed, is wrong by two."""
    names = ",".join(f"d{k}_{a}" for k in ("theta", "v") for a in "xyz")
    data = _lines(
        f"time_s,{names}\n", lambda r: [repr(r * 0.01), *(repr(float(v) / 200) for v in (*RATES[r], *FORCES[r]))]
    )
    said = " ".join(proposed(data).suspicious)
    assert "the mean specific force is 4.9" in said
    assert "off by a factor of 0.5: the rate, or the number of samples summed, is wrong" in said


CHANNELS = (
    Channel("gyro_x", Quantity.ANGLE_INCREMENT, "rad", 1.23456789e-9, 3.0),
    Channel("accelerometer_x", Quantity.VELOCITY_INCREMENT, "m/s", 2.0**-27, -7.5),
)


def _exported(form: ExportFormat, simulated: bool = True, dtype: str = "int32") -> tuple[bytes, RecordingInfo, Any]:
    samples = np.random.default_rng(1).integers(-500, 500, (400, 2)).astype(sample_type(dtype))
    if dtype == "float64":
        samples = samples + 0.25  # whole numbers would be stored as counts
    info = RecordingInfo("R-1", "SIM-0001", CHANNELS, 400.0, 400, 12.5, simulated=simulated, content_hash="0" * 64)
    return b"".join(export(extract(info, dtype), [samples[:150], samples[150:]], form)), info, samples


@pytest.mark.parametrize("form", [ExportFormat.ARROW, ExportFormat.PARQUET, ExportFormat.CSV])
@pytest.mark.parametrize("dtype", ["int32", "float64"])
def test_our_own_exports_come_back_as_they_were(form: ExportFormat, dtype: str) -> None:
    data, info, samples = _exported(form, dtype=dtype)
    proposal = proposed(data, unit=None)
    assert proposal.unknown == []
    assert "simulated" in proposal.title
    recording, _ = read(data, proposal.description)
    assert (recording.channels, recording.rate_hz, recording.description.start_s) == (CHANNELS, 400.0, 12.5)
    assert recording.description.unit == info.unit
    assert recording.description.simulated
    assert "header_lines" not in proposal.description
    np.testing.assert_array_equal(np.concatenate(list(recording.blocks())), samples)


def test_a_simulated_recording_stays_simulated_whatever_a_description_says() -> None:
    data, _, _ = _exported(ExportFormat.PARQUET)
    description: dict[str, Any] = {**proposed(data).description, "simulated": False}
    recording, _ = read(data, description)
    assert recording.description.simulated
    assert any("stays marked as simulated" in words for words in recording.source["warnings"])
    measured, _, _ = _exported(ExportFormat.CSV, simulated=False)
    again: Proposal = proposed(measured)
    assert not read(measured, again.description)[0].description.simulated
