"""A damaged recording is refused with a sentence that names what is damaged, and never with "try again"."""

import sqlite3
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bench_service.cli.asking.client import connect
from bench_service.formats.chunk import rows_per_chunk
from bench_service.settings import Settings
from tests.service.client import Client

CHUNK = rows_per_chunk(1, np.dtype(np.float64))


@pytest.fixture(scope="module")
def damaged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Client, dict]]:
    """A service with an imported recording of three chunks, one byte of the middle one flipped; and the recording."""
    file = Path(tmp_path_factory.mktemp("damaged")) / "bench.sqlite"
    with connect(Settings(database_url=f"sqlite:///{file}"), None, drive=False) as http:
        client = Client(http)
        gyro = {"name": "gyro_x", "column": "x", "quantity": "angular_rate", "unit": "rad/s"}
        table = pa.table({"x": np.arange(2 * CHUNK + 1000) + 0.5})
        sink = pa.BufferOutputStream()
        pq.write_table(table, sink)
        answer = client.import_files(
            {"unit": "U-1", "rate_hz": 400.0, "channels": [gyro]}, sink.getvalue().to_pybytes()
        )
        assert answer.status_code == 201, answer.text
        recording = answer.json()
        with sqlite3.connect(file) as books:
            (payload,) = books.execute("SELECT payload FROM chunks WHERE number = 1").fetchone()
            altered = payload[:100] + bytes([payload[100] ^ 1]) + payload[101:]
            books.execute("UPDATE chunks SET payload = ? WHERE number = 1", (altered,))
        yield client, recording


def test_an_export_is_refused_before_its_first_byte(damaged: tuple[Client, dict]) -> None:
    client, recording = damaged
    answer = client.http.get(f"/api/v1/recordings/{recording['id']}/data")
    assert answer.status_code == 409
    detail = answer.json()["detail"]
    assert f"chunk 1, samples {CHUNK} to {2 * CHUNK - 1}: its bytes do not have the hash" in detail
    assert "Retry-After" not in answer.headers


def test_the_sound_part_can_be_exported(damaged: tuple[Client, dict]) -> None:
    client, recording = damaged
    whole_s = CHUNK / 400.0
    answer = client.http.get(f"/api/v1/recordings/{recording['id']}/data", params={"stop_s": whole_s})
    assert answer.status_code == 200
    assert pa.ipc.open_stream(answer.content).read_all().num_rows == CHUNK


def test_an_analysis_is_refused_with_what_is_damaged(damaged: tuple[Client, dict]) -> None:
    client, recording = damaged
    answer = client.analyse("noise_analysis", recordings=[recording["id"]])
    assert answer.status_code == 409, answer.text
    assert f"chunk 1 of recording {recording['id']} is damaged" in answer.json()["detail"]
