"""Streams of devices: frames by makers' libraries where there are any, else by layouts worked by hand."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ixcom import data as ixcom_data
from ixcom import protocol as ixcom_protocol
from novatel_edie import oem

from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs import novatel
from bench_service.formats.logs.framing import crc32_mpeg2
from tests.formats import frame_files
from tests.formats.reading import FORCES, RATE_HZ, RATES, ROWS, proposed, read, require_motion

AG58_ANGLE, AG58_VELOCITY = 2.0**-33, 0.3048 * 2.0**-27


def test_the_crc_of_stim300_and_kvh_has_its_published_check_value() -> None:
    assert crc32_mpeg2(b"123456789") == 0x0376E6E7
    assert frame_files.mpeg2_crc(b"123456789") == 0x0376E6E7


def _edie(data: bytes) -> list[object]:
    parser = oem.Parser()
    parser.write(data)
    return list(parser)


def test_raw_counts_of_novatel_in_the_order_z_minus_y_x() -> None:
    data = frame_files.rawimusx(AG58_ANGLE, AG58_VELOCITY)
    decoded = _edie(data)
    assert len(decoded) == ROWS  # the maker's own decoder takes our frames: header, body and CRC
    first = decoded[0].to_dict()  # pyright: ignore
    assert first["accel_z"] * AG58_VELOCITY == pytest.approx(FORCES[0, 2] / RATE_HZ, abs=AG58_VELOCITY)
    assert first["gyro_y"] * AG58_ANGLE == pytest.approx(-RATES[0, 1] / RATE_HZ, abs=AG58_ANGLE)
    proposal, recording = require_motion(data, 0.5 * AG58_VELOCITY, increments=True)
    assert [c.scale for c in proposal.columns[:2]] == [AG58_ANGLE, -AG58_ANGLE]
    assert any("HG1700 AG58" in words for words in proposal.notes)
    assert recording.dtype is np.int32


def test_ascii_logs_by_the_makers_encoder_and_both_kinds_in_one_file() -> None:
    data = frame_files.rawimusx(AG58_ANGLE, AG58_VELOCITY)
    lines = b"".join(m.to_ascii().message for m in _edie(data))  # pyright: ignore
    assert lines.startswith(b"%RAWIMUSXA,")
    require_motion(lines, 0.5 * AG58_VELOCITY, increments=True)
    half = data.find(b"\xaa\x44\x13", len(data) // 2)
    first_rows = data[:half].count(b"\xaa\x44\x13")
    split = lines.split(b"%")
    mixed = data[:half] + b"%" + b"%".join(split[first_rows + 1 :])
    require_motion(mixed, 0.5 * AG58_VELOCITY, increments=True)


def test_an_unknown_type_of_unit_is_left_as_counts() -> None:
    proposal = proposed(frame_files.rawimusx(AG58_ANGLE, AG58_VELOCITY, kind=99))
    assert {c.unit for c in proposal.columns} == {"count"}
    assert any("types of unit that the file names: 99" in words for words in proposal.unknown)


@pytest.mark.shared_data
@pytest.mark.parametrize(("name", "kind", "rows"), [("ins1.gps", "CORRIMUS", 10), ("ins2.gps", "IMURATECORRIMUS", 766)])
def test_genuine_logs_of_novatel_against_the_makers_decoder(shared_data: Path, name: str, kind: str, rows: int) -> None:
    data = (shared_data / "formats" / "novatel" / name).read_bytes()
    log = novatel.opened(io.BytesIO(data), name)
    table = next(t for t in log.tables() if t.name == kind)
    names = ["pitch", "roll", "yaw", "lateral", "longitudinal", "vertical"]
    parts = zip(*log.rows(table, [table.clocks[0].column, *names]), strict=True)
    time_ns, *ours = [np.concatenate(part) for part in parts]
    theirs = [m.to_dict() for m in _edie(data) if type(m).__name__.startswith(kind)]  # pyright: ignore
    assert len(theirs) == len(time_ns) == table.rows == rows
    np.testing.assert_array_equal(np.column_stack(ours), [_values(t) for t in theirs])
    seconds = [t.get("seconds", t["header"]["milliseconds"] / 1000) for t in theirs]
    np.testing.assert_allclose(time_ns * 1e-9 % 604_800, seconds, atol=1e-6)
    assert any("gravity" in words for words in proposed(data).unknown)


def _values(message: dict[str, Any]) -> list[float]:
    """Return rates and accelerations of a corrected log as the maker's decoder names them."""
    if "corr_wb_ib" in message:
        return [*message["corr_wb_ib"], *message["corr_fb"]]
    return [message[key] for key in ("pitch", "roll", "azimuth", "lateral", "longitudinal", "vertical")]


def _ixcom() -> bytes:
    found = b""
    for row in range(ROWS):
        message = ixcom_protocol.ProtocolMessage()
        message.payload = ixcom_data.IMURAW_Payload()
        message.payload.data["acc"] = list(FORCES[row])
        message.payload.data["omg"] = list(RATES[row])
        message.header.msgID = 0
        message.header.frameCounter = row % 256
        message.header.week, message.header.timeOfWeek_sec = 2100, 1000 + row // 200
        message.header.timeOfWeek_usec = row % 200 * 5000
        found += bytes(message.to_bytes())
    return found


def test_ixcom_messages_by_the_makers_client() -> None:
    proposal, _ = require_motion(_ixcom(), 5e-7)  # float32 of 9.7: half a step is 4.8e-7
    assert proposal.format == "ixcom"
    assert proposal.description["time_column"] == "gps_time"


def test_a_false_sync_and_a_broken_message_lose_no_other_message() -> None:
    data = _ixcom()
    spoilt = data[: 44 * 10] + b"\x7e\x00\x01" + data[44 * 10 :]
    broken = bytearray(spoilt)
    broken[44 * 300 + 3 + 20] ^= 0xFF
    proposal = proposed(bytes(broken))
    assert proposal.rows == ROWS - 1
    said = " ".join(proposal.suspicious)
    assert f"2 of {ROWS + 1} messages have a wrong checksum and were left out, the first at byte 440" in said
    assert "47 bytes in 2 places belong to no frame and were skipped, the first at byte 440" in said
    assert "1 sample is missing" in said
    assert proposal.description["gaps"] == "mark"


@pytest.mark.parametrize(("identifier", "line_ends"), [(0x91, False), (0x91, True), (0xA7, False)])
def test_datagrams_of_a_stim300(identifier: int, line_ends: bool) -> None:
    data = frame_files.stim300(identifier, line_ends)
    proposal, _ = require_motion(data, 0.5 * 9.80665 * 2.0**-19)
    assert proposal.format == "stim300"
    assert any("accelerometers' range" in words for words in proposal.unknown)
    assert proposal.table is None
    if identifier == 0xA7:
        temperature = next(c for c in proposal.columns if c.channel == "temperature_gyro_x")
        assert temperature.mean == pytest.approx(30.0)


def test_lost_datagrams_are_counted_by_the_counter() -> None:
    proposal = proposed(frame_files.stim300(skip=lambda row: row in (100, 101)))
    assert any("2 samples are missing in 1 place: 2 between rows 100 and 101" in w for w in proposal.suspicious)


def test_wrong_checksums_everywhere_are_said_with_their_usual_cause() -> None:
    data = bytearray(frame_files.stim300())
    data[0::28] = b"\x90" * len(data[0::28])
    with pytest.raises(UnreadableFile, match="a wrong checksum everywhere usually means another datagram"):
        proposed(bytes(data), format="stim300")


def test_frames_of_a_kvh_1750() -> None:
    data = frame_files.kvh1750()
    proposal = proposed(data)
    assert proposal.format == "kvh1750"
    assert any("rate_hz" in words for words in proposal.unknown)
    recording, values = read(data, {**proposal.description, "rate_hz": RATE_HZ})
    np.testing.assert_allclose(values[:, :6], np.hstack([RATES, FORCES]), atol=5e-7)
    assert recording.count == ROWS
    lost = proposed(data[: 36 * 50] + data[36 * 53 :])
    assert any("3 frames are missing by their sequence number, first before row 51" in w for w in lost.suspicious)


def test_messages_of_an_hg4930() -> None:
    data = frame_files.hg4930()
    proposal = proposed(data)
    assert (proposal.format, proposal.table, proposal.rate_hz) == ("hg4930", "inertial", 100.0)
    assert any("1 messages are the pattern that is sent after power-up" in w for w in proposal.suspicious)
    recording, values = read(data, proposal.description)
    np.testing.assert_allclose(values[:, :3], RATES / 100, atol=2.0**-34)
    np.testing.assert_allclose(values[:, 3:], FORCES / 100, atol=2.0**-28 * 0.3048)
    control, values = read(data, proposed(data, table="control").description)
    assert (control.rate_hz, control.count) == (600.0, 6 * ROWS)
    np.testing.assert_allclose(values[::6, :3], RATES, atol=300 * 2.0**-20)
    assert recording.count == ROWS


def test_messages_of_a_vectornav() -> None:
    data = frame_files.vectornav()
    proposal = proposed(data)
    assert proposal.format == "vectornav"
    assert proposal.unknown == [
        "messages have no time: give rate_hz, the unit's asynchronous output rate",
        "rate_hz: neither a clock nor the file's head gives the rate",
    ]
    _, values = read(data, {**proposal.description, "rate_hz": RATE_HZ})
    np.testing.assert_allclose(values[:, :6], np.hstack([RATES, FORCES]), atol=5.1e-7)


def test_a_stream_of_noise_is_no_log() -> None:
    noise = np.random.default_rng(4).integers(0, 256, 200_000).astype(np.uint8).tobytes()
    with pytest.raises(UnreadableFile, match=r"is not delimited text: it contains zero bytes|no table of numbers"):
        proposed(noise)
    with pytest.raises(UnreadableFile, match=r"has no whole iXCOM messages|wrong checksum"):
        proposed(noise, format="ixcom")
