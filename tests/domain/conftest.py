"""A bench and a unit with the thesis's noise."""

import pytest

from procedures.bench.description import AxisLimits, BenchDescription, TableAccuracy
from procedures.core.recording import Channel
from procedures.core.unit import TriadRecord, Unit
from procedures.procedure import Context
from tests.kit.forward_model import ACCELEROMETER_NOISE, CHANNELS, GYRO_NOISE, SITE


@pytest.fixture
def channels() -> tuple[Channel, ...]:
    return CHANNELS


@pytest.fixture
def unit(channels: tuple[Channel, ...]) -> Unit:
    return Unit("S-1", 400.0, channels, TriadRecord((GYRO_NOISE,) * 3), TriadRecord((ACCELEROMETER_NOISE,) * 3))


@pytest.fixture
def bench() -> BenchDescription:
    axis = AxisLimits(-360.0, 360.0, 60.0, 60.0)
    return BenchDescription("bench-1", SITE, axis, axis, axis, TableAccuracy(3.0, 5.0, 2.0), simulated=True)


@pytest.fixture
def context(unit: Unit, bench: BenchDescription) -> Context:
    return Context(unit, bench)
