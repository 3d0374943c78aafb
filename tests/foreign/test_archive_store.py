"""The archive of raw data in a store of objects with the interface of S3: moto's server, a program by others."""

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import httpx
import numpy as np
import pytest
from pyarrow.fs import S3FileSystem

from bench_service.evidence.raw_data.service import RawDataService, StorageSettings
from bench_service.model.errors import ArchiveAway
from bench_service.model.raw_data import RawState
from bench_service.persistence import open_stores
from bench_service.persistence.archive.places import place_at
from bench_service.persistence.upkeep.contents import DatabaseContents
from bench_service.wall_clock import monotonic_s, pause
from tests.foreign.peer import python_of
from tests.kit.white_recordings import store_white

KEYS = {
    "AWS_ACCESS_KEY_ID": "a key",
    "AWS_SECRET_ACCESS_KEY": "a secret",
    "AWS_REGION": "us-east-1",
    "AWS_EC2_METADATA_DISABLED": "true",
}


@pytest.fixture
def store(free_port: int, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Address of an archive in a bucket of a store that runs for this test."""
    for name, value in KEYS.items():
        monkeypatch.setenv(name, value)
    command = [str(python_of("moto")), "-m", "moto.server", "-H", "127.0.0.1", "-p", str(free_port)]
    quiet = subprocess.DEVNULL
    with subprocess.Popen(command, stdout=quiet, stderr=quiet, env={**os.environ, **KEYS}) as server:
        try:
            deadline = monotonic_s() + 60
            while True:
                try:
                    httpx.get(f"http://127.0.0.1:{free_port}/")
                    break
                except httpx.TransportError:
                    assert server.poll() is None
                    assert monotonic_s() < deadline
                    pause(0.1)
            here = {"endpoint_override": f"127.0.0.1:{free_port}", "scheme": "http"}
            S3FileSystem(**here, region="us-east-1", allow_bucket_creation=True).create_dir("laboratory")
            yield f"s3://laboratory/bench?endpoint_override=127.0.0.1:{free_port}&scheme=http&region=us-east-1"
        finally:
            server.terminate()


def test_raw_data_go_to_a_store_of_objects_and_come_back(sqlite_url: str, store: str, tmp_path: Path) -> None:
    stores, database = open_stores(sqlite_url)
    (recording,) = store_white(stores, 1, 1_000_000)  # two chunks
    before = np.concatenate(list(stores.recordings.load(recording).blocks()))
    rules = StorageSettings(archive=store)
    raw = RawDataService(stores, DatabaseContents(database), rules, stores.raw_data.archive_at)
    pause(0.05)
    assert raw.archive(1e-7, dry_run=False).done == 1
    assert stores.recordings.get(recording).raw is RawState.ARCHIVED
    assert np.array_equal(np.concatenate(list(stores.recordings.load(recording).blocks())), before)
    place = place_at(store)
    assert len(place.names(f"samples/recording={recording}")) == 2
    assert len(place.names("tables/recordings")) == 1
    assert place.names("nothing") == []
    with pytest.raises(ArchiveAway, match="absent"):
        place.read("absent")
    place.remove(f"samples/recording={recording}/chunk-000001.parquet")
    with pytest.raises(ArchiveAway, match="chunk-000001"):
        list(stores.recordings.load(recording).blocks())
    database.dispose()
