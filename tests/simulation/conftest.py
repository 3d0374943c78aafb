"""Worlds to test in: an ideal table, a unit without noise whose pulses are tiny, and a recorder of stations."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from procedures.core.recording import Station
from simulators.truth import BenchTruth, SiteTruth, TableTruth, TriadTruth, UnitTruth, default_bench
from simulators.world import SimulatedBench, WorldConfig

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
GRAVITY = 9.8
EARTH = 7.292115e-5


@pytest.fixture
def quiet_unit() -> UnitTruth:
    """K is the identity, no bias, no noise, no dither; a gyro pulse is 3.5e-9 rad, an accelerometer's 3.5e-8 m/s."""
    gyro = TriadTruth((0.0, 0.0, 0.0), IDENTITY, quantization=(1e-9, 1e-9, 1e-9), dithered=False)
    accelerometer = TriadTruth((0.0, 0.0, 0.0), IDENTITY, quantization=(1e-8, 1e-8, 1e-8), dithered=False)
    return UnitTruth("QUIET", gyro, accelerometer, 100.0)


@pytest.fixture
def bench_at() -> Callable[..., BenchTruth]:
    """A bench at latitude 30° (cos = 0.8660254, sin = 0.5), g = 9.8, by default ideal and with azimuth 0."""

    def make(azimuth_deg: float = 0.0, **flaws: float) -> BenchTruth:
        shipped = default_bench()
        site = replace(shipped.description.site, latitude_deg=30.0, gravity_m_s2=GRAVITY, azimuth_deg=azimuth_deg)
        description = replace(shipped.description, site=site)
        return BenchTruth(SiteTruth(30.0, GRAVITY, EARTH), TableTruth(**flaws), description)

    return make


@pytest.fixture
def quiet_config(quiet_unit: UnitTruth, bench_at: Callable[..., BenchTruth]) -> Callable[..., WorldConfig]:
    """A world of the quiet unit on a bench with given azimuth and flaws."""

    def make(azimuth_deg: float = 0.0, **flaws: float) -> WorldConfig:
        return WorldConfig(quiet_unit, bench_at(azimuth_deg, **flaws), seed=5)

    return make


async def record_all(bench: SimulatedBench, stations: Sequence[Station]) -> list[np.ndarray]:
    """The raw samples of some stations, as a procedure takes them."""
    out: list[np.ndarray] = []
    await bench.supply.switch_on()
    for station in stations:
        if station.angles is not None:
            await bench.turntable.move_to(station.angles)
        await bench.clock.sleep(station.settle_s)
        stream = bench.imu.record(station.record_s, station)
        out.append(np.concatenate([block async for block in stream.blocks]))
    return out


@pytest.fixture
def record() -> Callable[[SimulatedBench, Sequence[Station]], list[np.ndarray]]:
    return lambda bench, stations: asyncio.run(record_all(bench, stations))


@pytest.fixture
def means() -> Callable[[SimulatedBench, np.ndarray], np.ndarray]:
    """Mean nominal rates of a recording's six channels, (6,)."""

    def of(bench: SimulatedBench, raw: np.ndarray) -> np.ndarray:
        return raw.mean(axis=0) * [c.scale for c in bench.imu.channels] * bench.imu.rate_hz

    return of
