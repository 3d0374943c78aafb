"""Ordinary variants of text exports, archives and array files: what is proposed of them, and what is asked."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import nptdms
import numpy as np
import pytest

from bench_service.formats.errors import UnreadableFile
from tests.formats.packed_files import kitti_drive, mat_file, zipped
from tests.formats.reading import FORCES, RATES, ROWS, TIMES_NS, proposed, require_motion

DEG = np.degrees(1.0)
GRAVITY = 9.80665
ROUNDED = 1e-8
"""Nine digits of 9.7, in deg/s of 17, are cut at 5e-9 and 1e-10."""


def _text(head: str, cells: Callable[[int], Any], separator: str = ",", end: str = "\n") -> str:
    return head + "".join(separator.join(map(str, cells(row))) + end for row in range(ROWS))


def _six(row: int, rates: float = 1.0, forces: float = 1.0) -> list[str]:
    return [f"{v:.9g}" for v in (*(RATES[row] * rates), *(FORCES[row] * forces))]


def _commas(cells: list[str]) -> list[str]:
    return [cell.replace(".", ",") for cell in cells]


def test_xsens_with_decimal_commas_has_its_rate_from_the_head_and_takes_no_counter_for_a_clock() -> None:
    names = "PacketCounter;Acc_X;Acc_Y;Acc_Z;Gyr_X;Gyr_Y;Gyr_Z;Mag_X"
    head = f"// Update Rate: 200,0Hz\r\n// Filter Profile: human (46.1)\r\n{names}\r\n"
    text = _text(head, lambda r: [r, *_commas(_six(r)[3:] + _six(r)[:3]), "0,1"], ";", "\r\n")
    proposal, _ = require_motion(text.encode(), ROUNDED, "MT_0380.txt")
    assert (proposal.description["rate_hz"], proposal.unknown) == (200.0, [])
    assert any("Mag_X" in words and "left out" in words for words in proposal.notes)


def test_xsens_dot_counts_microseconds_and_gives_degrees() -> None:
    head = (
        "sep=,\nDeviceTag:,DOT1\nOutputRate:,200Hz\nPacketCounter,SampleTimeFine,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z\n"
    )
    text = _text(head, lambda r: [r, 1000 + 5000 * r, *_six(r, DEG)[3:], *_six(r, DEG)[:3]])
    proposal, _ = require_motion(text.encode(), ROUNDED, "dot.csv")
    assert (proposal.title, proposal.unknown, proposal.suspicious) == ("Xsens DOT", [], [])
    slow = require_motion(text.replace("200Hz", "60Hz").encode(), ROUNDED, "dot.csv")[0].suspicious
    assert any("states a rate of 60 Hz, its stamps have 200 Hz" in words for words in slow)


def test_xsens_increments_of_velocity_are_read_and_quaternions_are_not() -> None:
    head = "// Update Rate: 200.0Hz\nPacketCounter\tVelInc_X\tVelInc_Y\tVelInc_Z\tOriInc_q0\tOriInc_q1\n"
    proposal = proposed(_text(head, lambda r: [r, *(FORCES[r] / 200), 1, 0.0001], "\t").encode(), "MT.txt")
    assert [(c.channel, c.quantity, c.unit) for c in proposal.columns] == [
        (f"accelerometer_{axis}", "velocity_increment", "m/s") for axis in "xyz"
    ]
    assert any("OriInc is a quaternion" in words for words in proposal.unknown)


@pytest.mark.parametrize(
    ("rate", "force"), [("gyro_{}_rad_per_s", "accelerometer_{}_m_per_s2"), ("gyr_{}_rads", "acc_{}_m_s2")]
)
def test_units_at_the_end_of_names_are_units_and_no_index_of_an_axis(rate: str, force: str) -> None:
    """The first pair are the names of our own physical exports; the 2 of "s2" was taken for the third axis."""
    head = ",".join(["time_s", *(rate.format(axis) for axis in "xyz"), *(force.format(axis) for axis in "xyz")])
    proposal, _ = require_motion(
        _text(head + "\n", lambda r: [f"{0.005 * r:.3f}", *_six(r)]).encode(), ROUNDED, "x.csv"
    )
    assert [(c.channel, c.unit) for c in proposal.columns] == [
        *((f"gyro_{axis}", "rad/s") for axis in "xyz"),
        *((f"accelerometer_{axis}", "m/s^2") for axis in "xyz"),
    ]
    assert proposal.unknown == []


def test_columns_of_a_ros_message_have_their_units_and_the_senders_stamp() -> None:
    parts = [f"field.{kind}.{axis}" for kind in ("angular_velocity", "linear_acceleration") for axis in "xyz"]
    head = f"%time,field.header.seq,field.header.stamp,field.header.frame_id,{','.join(parts)}\n"
    text = _text(head, lambda r: [TIMES_NS[r] + 300 * (r % 7), r, TIMES_NS[r], "imu", *_six(r)])
    proposal, _ = require_motion(text.encode(), ROUNDED, "imu.csv")
    assert (proposal.format, proposal.unknown) == ("ros", [])
    assert proposal.description["time_column"] == "field.header.stamp"
    assert {c.quantity for c in proposal.columns} == {"angular_rate", "specific_force"}


def test_physics_toolbox_has_forces_in_g_and_linear_acceleration_is_left_out() -> None:
    text = _text(
        "time,gFx,gFy,gFz,ax,ay,az,wx,wy,wz,\n",
        lambda r: [r * 0.005, *_six(r, 1, 1 / GRAVITY)[3:], 0, 0, 0, *_six(r)[:3], ""],
    )
    proposal, _ = require_motion(text.encode(), 10 * ROUNDED, "toolbox.csv")
    assert any("the unit of the gyros" in words for words in proposal.unknown)


def test_core_motion_has_the_sign_turned_and_it_is_said() -> None:
    """An iPhone flat on a table gives −1 g along z, where the specific force is +1 g."""
    names = [f"accelerometerAcceleration{a}(G)" for a in "XYZ"] + [f"gyroRotation{a}(rad/s)" for a in "XYZ"]
    head = f"accelerometerTimestamp_sinceReboot(s),{','.join(names)}\n"
    text = _text(head, lambda r: [f"{100 + r * 0.005:.3f}", *_six(r, 1, -1 / GRAVITY)[3:], *_six(r)[:3]])
    proposal, _ = require_motion(text.encode(), 10 * ROUNDED, "sensorlog.csv")
    assert sum("look that the axis that pointed up has +g" in words for words in proposal.unknown) == 3


@pytest.mark.parametrize("encoding", ["cp1252", "utf-8-sig", "utf-16"])
def test_names_in_the_code_page_of_windows_are_read(encoding: str) -> None:
    head = f"Zeit [ms];{';'.join(f'Gyro {a} [°/s]' for a in 'XYZ')};{';'.join(f'Acc {a} [g]' for a in 'XYZ')}\r\n"
    text = _text(head, lambda r: _commas([str(5 * r), *_six(r, DEG, 1 / GRAVITY)]), ";", "\r\n")
    require_motion(text.encode(encoding), 10 * ROUNDED, "messung.csv")


def test_a_mark_that_stands_apart_from_the_names_is_no_column() -> None:
    text = _text("# timestamp w_x w_y w_z a_x a_y a_z\n", lambda r: [f"{r * 0.005:.3f}", *_six(r)], " ")
    proposal, _ = require_motion(text.encode(), ROUNDED, "imu.txt")
    assert proposal.description["time_column"] == "timestamp"


@pytest.mark.parametrize(
    "units", ["s,deg/s,deg/s,deg/s,m/s2,m/s2,m/s2", "[s],[deg/s],[deg/s],[deg/s],[m/s^2],[m/s^2],[m/s^2]"]
)
def test_a_line_of_units_below_the_names_is_understood(units: str) -> None:
    text = _text(f"# a comment\ntime,gx,gy,gz,ax,ay,az\n{units}\n", lambda r: [f"{r * 0.005:.3f}", *_six(r, DEG)])
    proposal, _ = require_motion(text.encode(), ROUNDED, "labview.csv")
    assert (proposal.unknown, proposal.description["header_lines"], proposal.description["header"]) == ([], 3, False)
    packed = require_motion(zipped({"labview.csv": text}), ROUNDED, "labview.zip")[0]
    assert packed.unknown == []


def test_a_table_of_pandas_with_its_index_keeps_its_columns_apart() -> None:
    """The first name is empty, and the second column holds the text of a clock."""

    def cells(row: int) -> list[str]:
        return [str(row), f"2023-11-14 22:13:{20 + row // 200:02d}.{row % 200 * 5:03d}", *_six(row)]

    proposal, _ = require_motion(_text(",timestamp,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z\n", cells).encode(), ROUNDED)
    assert {"time_column": "timestamp", "time_unit": "clock"}.items() <= proposal.description.items()


def test_whole_numbers_are_counts_whose_scale_is_asked_for() -> None:
    text = _text(
        "t_ms,ax,ay,az,gx,gy,gz\n",
        lambda r: [5 * r, *(round(v / GRAVITY * 16384) for v in FORCES[r]), *(round(v * DEG * 131) for v in RATES[r])],
    )
    proposal = proposed(text.encode(), "mpu.csv")
    assert {c.unit for c in proposal.columns} == {"count"}
    assert sum("give unit and scale" in words for words in proposal.unknown) == 2


def test_of_a_phones_archive_no_table_without_gravity_is_proposed() -> None:
    def text(values: Any) -> str:
        return _text("time,seconds_elapsed,z,y,x\n", lambda r: [TIMES_NS[r], f"{r * 0.005:.7f}", *values[r, ::-1]])

    data = zipped(
        {"Accelerometer.csv": text(FORCES / 100), "TotalAcceleration.csv": text(FORCES), "Gravity.csv": text(FORCES)}
    )
    proposal = proposed(data)
    assert (proposal.table, proposal.unknown) == ("TotalAcceleration.csv", [])
    assert {c.unit for c in proposal.columns} == {"m/s^2"}
    doubted = proposed(data, table="Accelerometer.csv")
    assert any("without gravity" in words for words in doubted.unknown)


def test_a_drive_packed_from_inside_and_two_drives_in_one_archive() -> None:
    require_motion(zipped(kitti_drive("")), 0.0)
    both = zipped({**kitti_drive("a/oxts/"), **kitti_drive("b/oxts/")})
    found = proposed(both)
    assert [t.name for t in found.tables] == ["a/oxts/", "b/oxts/"]
    assert any("are also in b/oxts/: give table" in words for words in found.notes)
    require_motion(both, 0.0, table="b/oxts/")


@pytest.mark.parametrize("packed", [False, True])
def test_matrices_of_matlab_that_lie_and_a_rate_that_is_stated(packed: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench_service.formats.logs.arrays_by_name.mat5.BLOCK_ROWS", 7)
    data = mat_file({"imu": {"wb": RATES.T, "fb": FORCES.T, "freq": 200.0, "heart_rate": 70.0}}, do_compression=packed)
    proposal, _ = require_motion(data, 0.0)
    assert proposal.description["rate_hz"] == 200.0
    assert any("'imu.wb' is 3 x 600: its columns are taken as the samples" in words for words in proposal.notes)


def test_two_stated_rates_are_none() -> None:
    proposal = proposed(mat_file({"gyro": RATES, "fs": 200.0, "mag": {"fs": 50.0}}))
    assert any("rate_hz" in words for words in proposal.unknown)
    assert any("'fs' = 200, 'mag.fs' = 50" in words for words in proposal.notes)


def test_a_file_of_matlab_4_is_refused_with_the_way_out() -> None:
    with pytest.raises(UnreadableFile, match="a MATLAB file of version 4: in MATLAB or Octave save it again"):
        proposed(mat_file({"gyro": RATES}, format="4"))


def _hdf5(fill: Callable[[Any], None]) -> bytes:
    sink = io.BytesIO()
    with h5py.File(sink, "w") as file:
        fill(file)
    return sink.getvalue()


def test_vectors_in_a_compound_type_and_units_of_a_time_are_read() -> None:
    def fill(file: Any) -> None:
        rows = np.zeros(ROWS, [("us", "<u8"), ("gyro", ">f8", (3,)), ("acc", "<f8", (3,))])
        rows["gyro"], rows["acc"] = RATES, FORCES
        file["left/imu"] = rows
        file["left/time"] = TIMES_NS // 1000
        file["left/time"].attrs["units"] = "microseconds"

    proposal, _ = require_motion(_hdf5(fill), 0.0)
    assert {"time_column": "left/time", "time_unit": "us"}.items() <= proposal.description.items()
    assert not any("unit of time" in words for words in proposal.unknown)


def test_datasets_that_lie_are_turned_and_the_rate_is_an_attribute() -> None:
    def fill(file: Any) -> None:
        file["acce"], file["gyro"], file["linacce"] = FORCES.T, RATES.T, FORCES.T / 100
        file.attrs["sampling_rate_hz"] = 200

    proposal, _ = require_motion(_hdf5(fill), 0.0)
    assert proposal.description["rate_hz"] == 200.0
    assert any("left out" in words and "linacce" in words for words in proposal.notes)


def test_volts_of_a_converter_are_no_rate(tmp_path: Path) -> None:
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        properties = {"unit_string": "V", "wf_increment": 0.005}
        writer.write_segment(
            [nptdms.ChannelObject("g", f"gyro {a}", RATES[:, i], properties) for i, a in enumerate("xyz")]
        )
    proposal = proposed((tmp_path / "a.tdms").read_bytes())
    assert {c.unit for c in proposal.columns} == {"count"}
    assert sum("'V', is none of its quantity" in words for words in proposal.unknown) == 3
