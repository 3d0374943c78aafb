"""Sinusoids of a table axis: the path against its closed form, limits, and rest where it began."""

import asyncio

import numpy as np
import pytest

from procedures.bench.errors import DeviceFault, OutOfRange
from procedures.core.sinusoid import PEAK_ACCELERATION, Sinusoid
from procedures.core.table_angles import TableAngles
from simulators.turntable.profile import Sine
from simulators.world import build

SINUSOID = Sinusoid("inner", 2.0, 1.0, 5)


def test_the_profile_is_the_closed_form_and_its_rates_are_its_slope() -> None:
    sine = Sine(np.array([0.1, 0.2, 0.3]), 2, 0.5, 2.0, 6)
    times = np.linspace(0.0, sine.duration_s, 60_001)
    position, rate = sine.at(times)
    steady = (times >= 0.5) & (times <= 2.5)
    expected = 0.3 + 0.5 * np.sin(2.0 * np.pi * 2.0 * times)
    np.testing.assert_allclose(position[steady, 2], expected[steady], atol=1e-12)
    # Central differences of step h have the error h²/6·|third derivative| = (5e-5)²/6·0.5·(4π)³ ≈ 4e-7.
    slope = np.gradient(position[:, 2], times)
    np.testing.assert_allclose(slope[1:-1], rate[1:-1, 2], atol=2e-6)
    assert np.max(np.abs(np.gradient(rate[:, 2], times))) < PEAK_ACCELERATION * 0.5 * (4.0 * np.pi) ** 2
    assert (position[0, 2], position[-1, 2]) == (0.3, pytest.approx(0.3, abs=1e-12))
    assert np.all(position[:, :2] == [0.1, 0.2])


def test_the_table_swings_by_the_amplitude_and_rests_where_it_began(quiet_config) -> None:
    bench = build(quiet_config())

    async def swing() -> list[float]:
        await bench.turntable.move_to(TableAngles(0.0, 0.0, 10.0))
        await bench.turntable.command_sinusoid(SINUSOID)
        seen: list[float] = []
        while bench.clock.now_s() < 60.0 and (await bench.turntable.read()).moving and len(seen) < 500:
            await bench.clock.sleep(0.01)
            seen.append((await bench.turntable.read()).angles.inner_deg)
        await bench.turntable.settle()
        return seen

    seen = asyncio.run(swing())
    # A servo of 20 Hz with rate feedforward follows 1 Hz within some thousandths; 0.01 s steps miss a peak by
    # at most A·(2π·0.005)²/2 = 0.05 %.
    assert max(seen) - 10.0 == pytest.approx(2.0, rel=0.01)
    assert 10.0 - min(seen) == pytest.approx(2.0, rel=0.01)
    assert bench.turntable.read_angles().inner_deg == pytest.approx(10.0, abs=1e-6)
    assert bench.turntable.locked


@pytest.mark.parametrize(
    ("sinusoid", "words"),
    [
        (Sinusoid("inner", 20.0, 1.0, 5), r"rate of 125\.664 deg/s is above"),
        (Sinusoid("inner", 1.0, 5.0, 5), r"acceleration of 1105\.4 deg/s\^2 is above"),
        (Sinusoid("middle", 200.0, 0.01, 5), "leaves -190"),
    ],
)
def test_a_sinusoid_beyond_a_limit_moves_nothing(quiet_config, sinusoid: Sinusoid, words: str) -> None:
    bench = build(quiet_config())
    with pytest.raises(OutOfRange, match=words):
        asyncio.run(bench.turntable.command_sinusoid(sinusoid))
    assert bench.turntable.locked


def test_it_is_one_demand_and_can_be_made_safe(quiet_config) -> None:
    bench = build(quiet_config())
    asyncio.run(bench.turntable.command_sinusoid(SINUSOID))
    with pytest.raises(DeviceFault, match="moving"):
        asyncio.run(bench.turntable.command_sinusoid(SINUSOID))
    asyncio.run(bench.turntable.make_safe())
    assert bench.turntable.locked


@pytest.mark.parametrize(
    ("amplitude", "frequency", "cycles", "words"),
    [(0.0, 1.0, 5, "amplitude_deg"), (1.0, float("nan"), 5, "frequency_hz"), (1.0, 1.0, 2, "at least 3")],
)
def test_a_sinusoid_that_is_none_is_refused(amplitude: float, frequency: float, cycles: int, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Sinusoid("inner", amplitude, frequency, cycles)
