"""Stores on an empty database, and the smallest things to put into them."""

from collections.abc import Callable, Iterator
from datetime import UTC, datetime

import numpy as np
import pytest

from bench_service.campaigns.stores import Stores
from bench_service.model.job import Job, JobState
from bench_service.model.records import NewRecording, StoredResult
from bench_service.persistence import Database, open_stores
from bench_service.wall_clock import new_id
from procedures.core.limits import Verdict
from procedures.core.recording import ACCELEROMETER, GYRO, Channel, Quantity, RawArray, Station
from procedures.core.table_angles import TableAngles

NOW = datetime(2031, 5, 6, 7, 8, 9, 123456, tzinfo=UTC)
CHANNELS = tuple(Channel(name, Quantity.ANGLE_INCREMENT, "rad", 6.545e-6, 0.5) for name in GYRO) + tuple(
    Channel(name, Quantity.VELOCITY_INCREMENT, "m/s", 3.7e-4) for name in ACCELEROMETER
)
STATIONS = tuple(
    Station(index, f"orientation {index + 1}", TableAngles(0.0, 90.0 * index, -45.0), 20.5, 1.0, 60.0)
    for index in range(3)
)


@pytest.fixture
def opened(database_url: str) -> Iterator[tuple[Stores, Database]]:
    stores, database = open_stores(database_url)
    yield stores, database
    database.dispose()


@pytest.fixture
def stores(opened: tuple[Stores, Database]) -> Stores:
    return opened[0]


@pytest.fixture
def database(opened: tuple[Stores, Database]) -> Database:
    return opened[1]


@pytest.fixture
def new_job() -> Callable[..., Job]:
    """A queued job; anything may be said otherwise."""

    def make(**changes: object) -> Job:
        given: dict[str, object] = {
            "id": new_id(),
            "procedure": "static_run",
            "procedure_version": "1",
            "unit": "U-1",
            "bench": "sim",
            "state": JobState.QUEUED,
            "created_at": NOW,
            "queued_at": NOW,
            "requested_parameters": {"record_s": 60},
            "parameters": {"zeta": 1.0, "alpha": [1e16, -0.0, 0.1]},
            "context": {"unit": {"serial": "U-1"}},
            "stations": STATIONS,
            "duration_s": 183.25,
            "code_version": "abc",
            "simulated": True,
            "seed": 2**62 + 1,
            "labels": {"lot": "7"},
        }
        return Job(**{**given, **changes})  # pyright: ignore[reportArgumentType]

    return make


@pytest.fixture
def new_recording() -> Callable[..., NewRecording]:
    """A recording of six integer channels; anything may be said otherwise."""

    def make(**changes: object) -> NewRecording:
        given: dict[str, object] = {
            "unit": "U-1",
            "channels": CHANNELS,
            "rate_hz": 400.0,
            "start_s": 12.5,
            "simulated": True,
        }
        return NewRecording(**{**given, **changes})  # pyright: ignore[reportArgumentType]

    return make


@pytest.fixture
def new_result() -> Callable[..., StoredResult]:
    """A result that passed; anything may be said otherwise."""

    def make(**changes: object) -> StoredResult:
        given: dict[str, object] = {
            "id": new_id(),
            "kind": "procedure",
            "name": "static_run",
            "version": "1",
            "parameters": {"record_s": 60.0},
            "document": {"z": 1.0, "a": [1e-300, 1e300, -0.0, 3]},
            "verdict": Verdict.PASS,
            "recordings": (),
            "calibrations": (),
            "code_version": "abc",
            "simulated": True,
            "created_at": NOW,
            "unit": "U-1",
        }
        return StoredResult(**{**given, **changes})  # pyright: ignore[reportArgumentType]

    return make


@pytest.fixture
def samples() -> Callable[..., RawArray]:
    """Counts with noise and the extremes of 32 bits, shape (n, 6)."""

    def make(count: int, seed: int = 1) -> RawArray:
        rng = np.random.Generator(np.random.PCG64(seed))
        raw = rng.integers(-40, 40, (count, len(CHANNELS)), dtype=np.int32)
        raw[0] = (-(2**31), 2**31 - 1, 0, -1, 1, 66)
        return raw

    return make
