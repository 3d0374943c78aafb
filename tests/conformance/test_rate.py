"""Promises of a constant rate, for every implementation of the turntable's port."""

import asyncio
from pathlib import Path

import pytest

from procedures.bench.errors import DeviceFault, OutOfRange, Stopped
from procedures.core.constant_rate import ConstantRate
from procedures.core.table_angles import TableAngles
from tests.conformance.tables import IMPLEMENTATIONS, TableRig, table


@pytest.fixture(params=IMPLEMENTATIONS)
def rig(request: pytest.FixtureRequest, tmp_path: Path):
    with table(request.param, tmp_path) as made:
        yield made


def _middle(reading) -> float:
    return reading.angles.middle_deg


@pytest.mark.parametrize("duration_s", [float("inf"), 1.9])
def test_a_rate_is_a_finite_motion_of_two_ramps_at_least(duration_s: float) -> None:
    with pytest.raises(ValueError, match="at least two ramps"):
        ConstantRate("outer", 5.0, duration_s, 1.0)


@pytest.mark.parametrize("rate_deg_s", [20.0, -20.0])
def test_a_rate_covers_rate_times_duration_less_a_ramp(rig: TableRig, rate_deg_s: float) -> None:
    async def scene() -> None:
        await rig.port.command_rate(ConstantRate("middle", rate_deg_s, 6.0, 1.0))
        with pytest.raises(DeviceFault, match="the table is moving"):
            await rig.port.command_rate(ConstantRate("inner", 5.0, 6.0, 1.0))
        await rig.clock.sleep(3.0)
        reading = await rig.port.read()
        assert reading.moving
        assert reading.rates_deg_s is not None
        assert reading.rates_deg_s[1] == pytest.approx(rate_deg_s, rel=0.01)
        await rig.port.settle()
        reading = await rig.port.read()
        assert not reading.moving
        covered = _middle(reading) / rate_deg_s
        if rig.served is None:  # it follows the profile to the arc second
            assert covered == pytest.approx(5.0, abs=1e-4)
        else:  # braked as its answers come: on a crowded machine late, by up to a fifth of a second of real time here
            assert 4.5 < covered < 9.0
        assert max(abs(rate) for rate in rig.rates_deg_s()) < 1e-3
        await rig.port.move_to(TableAngles())

    asyncio.run(scene())


@pytest.mark.parametrize(
    ("rate", "words"),
    [
        (ConstantRate("middle", 20.0, 12.0, 1.0), "no slip rings"),
        (ConstantRate("outer", 1000.0, 12.0, 5.0), "is above"),
        (ConstantRate("outer", 50.0, 12.0, 0.01), "ramps of"),
    ],
)
def test_a_rate_beyond_a_limit_moves_nothing(rig: TableRig, rate: ConstantRate, words: str) -> None:
    async def scene() -> None:
        with pytest.raises(OutOfRange, match=words):
            await rig.port.command_rate(rate)
        assert not (await rig.port.read()).moving
        assert not rig.demands()

    asyncio.run(scene())


def test_make_safe_ends_a_rate_and_its_settle(rig: TableRig) -> None:
    async def scene() -> None:
        await rig.port.command_rate(ConstantRate("outer", 30.0, 60.0, 1.0))
        settling = asyncio.create_task(rig.port.settle())
        while abs(rig.rates_deg_s()[0]) < 25.0:
            await asyncio.sleep(0)
        await rig.port.make_safe()
        await asyncio.wait([settling])
        assert isinstance(settling.exception(), Stopped)
        assert max(abs(rate) for rate in rig.rates_deg_s()) < 1e-3
        await rig.port.move_to(TableAngles())

    asyncio.run(scene())
