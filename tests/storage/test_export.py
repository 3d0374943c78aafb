"""Exported samples can be read back: the same samples, and all that is needed to understand them."""

import io
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bench_service.formats.content_hash import content_hash
from bench_service.formats.description import ImportDescription
from bench_service.formats.export import ExportFormat, export, extract
from bench_service.formats.import_file import ImportFile, read_import
from bench_service.model.records import NewRecording
from procedures.core.errors import BadParameter, MissingChannel
from procedures.core.recording import RawArray, RecordingInfo, Station

New = Callable[..., NewRecording]
Samples = Callable[..., RawArray]


@pytest.fixture
def info(new_recording: New) -> RecordingInfo:
    new = new_recording()
    return RecordingInfo("r-1", "U-1", new.channels, 400.0, 1000, 12.5, Station(3, "up"), "f00d", True)


def _out(info: RecordingInfo, raw: RawArray, form: ExportFormat, **ask: object) -> bytes:
    part = extract(info, raw.dtype.name, **ask)  # pyright: ignore[reportArgumentType]
    columns = [info.column(c.name) for c in part.info.channels]
    chosen = raw[part.start : part.stop, columns]

    def blocks() -> Iterator[RawArray]:
        for start in range(0, len(chosen), 300):
            yield chosen[start : start + 300]

    return b"".join(export(part, blocks(), form))


def _table(data: bytes, form: ExportFormat) -> pa.Table:
    return pq.read_table(io.BytesIO(data)) if form is ExportFormat.PARQUET else pa.ipc.open_stream(data).read_all()


def _floats(raw: RawArray) -> RawArray:
    return np.where(raw == 0, -0.0, raw * 0.1 + 1e-9)


@pytest.mark.parametrize("floating", [False, True])
@pytest.mark.parametrize("form", [ExportFormat.ARROW, ExportFormat.PARQUET])
def test_columns_come_back_bit_for_bit_with_their_meaning(
    info: RecordingInfo, samples: Samples, form: ExportFormat, floating: bool
) -> None:
    raw = _floats(samples(1000)) if floating else samples(1000)
    table = _table(_out(info, raw, form), form)
    assert table.column_names == [c.name for c in info.channels]
    assert np.column_stack([c.to_numpy() for c in table.columns]).tobytes() == raw.tobytes()
    about = table.schema.metadata
    assert (float(about[b"rate_hz"]), about[b"unit"], about[b"content_hash_of_whole_recording"]) == (
        400.0,
        b"U-1",
        b"f00d",
    )
    for channel, field in zip(info.channels, table.schema, strict=True):
        assert field.metadata[b"unit"].decode() == channel.unit
        assert field.metadata[b"quantity"].decode() == channel.quantity.value
        assert float(field.metadata[b"scale"]) == channel.scale
        assert float(field.metadata[b"offset"]) == channel.offset


@pytest.mark.parametrize("floating", [False, True])
def test_text_comes_back_through_our_own_import(info: RecordingInfo, samples: Samples, floating: bool) -> None:
    raw = _floats(samples(1000)) if floating else samples(1000)
    text = _out(info, raw, ExportFormat.CSV)
    comments = [line for line in text.decode().splitlines() if line.startswith("#")]
    assert "# rate_hz: 400.0" in comments
    assert "# channel gyro_x: quantity=angle_increment unit=rad scale=6.545e-06 offset=0.5" in comments
    description = ImportDescription.model_validate(
        {
            "unit": "U-1",
            "header_lines": len(comments),
            "time_column": "time_s",
            "channels": [
                {"name": c.name, "quantity": c.quantity, "unit": c.unit, "scale": c.scale, "offset": c.offset}
                for c in info.channels
            ],
        }
    )
    back = read_import([ImportFile("export.csv", io.BytesIO(text))], description)
    assert back.channels == info.channels
    assert back.rate_hz == pytest.approx(400.0, rel=1e-12)
    np.testing.assert_array_equal(np.concatenate(list(back.blocks())), raw)


@pytest.mark.parametrize("form", list(ExportFormat))
def test_a_part_by_channel_and_time(info: RecordingInfo, samples: Samples, form: ExportFormat) -> None:
    raw = samples(1000)
    data = _out(info, raw, form, channels=["gyro_z", "gyro_x"], start_s=0.5, stop_s=1.25)
    expected = raw[200:500, [2, 0]]
    if form is ExportFormat.CSV:
        rows = np.loadtxt(io.BytesIO(data), delimiter=",", skiprows=data.count(b"\n# ") + 2)
        np.testing.assert_array_equal(rows[:, 1:], expected)
        np.testing.assert_array_equal(rows[:, 0], np.arange(200, 500) / 400.0)
    elif form is ExportFormat.NPY:
        assert np.load(io.BytesIO(data)).dtype == raw.dtype
        np.testing.assert_array_equal(np.load(io.BytesIO(data)), expected)
    else:
        table = _table(data, form)
        assert table.schema.metadata[b"first_sample"] == b"200"
        assert float(table.schema.metadata[b"start_s"]) == 13.0
        np.testing.assert_array_equal(np.column_stack([c.to_numpy() for c in table.columns]), expected)


@pytest.mark.parametrize("form", list(ExportFormat))
def test_an_empty_part_is_a_file_without_rows(info: RecordingInfo, samples: Samples, form: ExportFormat) -> None:
    data = _out(info, samples(1000), form, start_s=1.0, stop_s=1.0)
    if form is ExportFormat.NPY:
        assert np.load(io.BytesIO(data)).shape == (0, 6)
    elif form is not ExportFormat.CSV:
        assert _table(data, form).num_rows == 0
    assert data


def test_what_is_not_there_is_refused(info: RecordingInfo) -> None:
    with pytest.raises(MissingChannel, match="gyro_w"):
        extract(info, "int32", ["gyro_w"])
    for start_s, stop_s in ((-1.0, None), (0.0, 2.6), (2.0, 1.0), (float("nan"), None)):
        with pytest.raises(BadParameter, match="_s ="):
            extract(info, "int32", None, start_s, stop_s)
    with pytest.raises(BadParameter, match="channels"):
        extract(info, "int32", ["gyro_x", "gyro_x"])


def test_neighbouring_parts_share_no_sample_and_miss_none(info: RecordingInfo) -> None:
    odd = replace(info, rate_hz=100.0 / 3.0, count=997)
    cuts = [0.0, 0.03, 0.1, 3.333, 7.77, 12.0, odd.duration_s]
    parts = [extract(odd, "int32", None, a, b) for a, b in pairwise(cuts)]
    assert [p.start for p in parts[1:]] == [p.stop for p in parts[:-1]]
    assert (parts[0].start, parts[-1].stop) == (0, 997)


def test_bytes_leave_while_blocks_arrive(info: RecordingInfo, samples: Samples) -> None:
    """Memory stays bounded: of a long recording, most has left before the last block is asked for."""
    raw = samples(1000)
    for form in ExportFormat:
        asked = 0
        left: list[int] = []

        def blocks() -> Iterator[RawArray]:
            nonlocal asked
            for _ in range(50):
                asked += 1
                yield raw

        sent = 0
        for piece in export(extract(replace(info, count=50_000), "int32"), blocks(), form):
            sent += len(piece)
            left.append(asked)
        assert sent > 0
        assert len([n for n in left if n < 50]) >= 40, form


def test_the_hash_knows_samples_rate_and_channels(new_recording: New, samples: Samples) -> None:
    raw, channels = samples(10), new_recording().channels
    other = raw.copy()
    other[9, 5] += 1
    hashes = {
        content_hash(channels, 400.0, raw),
        content_hash(channels, 400.0, other),
        content_hash(channels, 100.0, raw),
        content_hash(channels[::-1], 400.0, raw),
        content_hash(channels, 400.0, raw.astype(np.float64)),
    }
    assert len(hashes) == 5
