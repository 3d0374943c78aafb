"""The unit in its chamber: outputs and temperature codes against the true nodes, power, faults, and made safe."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from bench_service.drivers.simulated import SimulatedDriver
from procedures.bench import BenchNeeds
from procedures.bench.errors import DeviceFault, Disconnected, OutOfRange
from procedures.core.recording import Quantity, Station
from procedures.core.table_angles import TableAngles
from procedures.core.units import DEG_PER_HOUR, EARTH_RATE
from simulators.chamber.behaviour import response
from simulators.chamber.thermometers import DISCONNECTED_CODE
from simulators.truth import BenchTruth, UnitTruth, default_bench, default_unit
from simulators.truth.thermal import (
    ChamberFault,
    ChamberTruth,
    GyroThermalTruth,
    NetworkTruth,
    ThermometerTruth,
    UnitThermalTruth,
)
from simulators.world import SimulatedBench, WorldConfig, build

RATE = 100.0
CONFIG = WorldConfig(seed=9, sample_rate_hz=RATE, thermal=True)
WARM = Station(0, "warm", None, temperatures=True)
AWAY = ChamberTruth(ambient_c=35.0)
"""A room in which every node is 15 °C from the reference at the beginning."""


async def read_out(bench: SimulatedBench, seconds: float, station: Station | None = WARM) -> np.ndarray:
    return np.concatenate([block async for block in bench.imu.record(seconds, station).blocks])


def nodes_watched(bench: SimulatedBench) -> list[np.ndarray]:
    """Node temperatures of every second from now on, as the chamber makes them, by listening at its plant."""
    seen: list[np.ndarray] = [np.array(bench.chamber.plant.state.temperatures_c)[None]]
    run = bench.chamber.plant.run

    def listening(steps: int) -> np.ndarray:
        seen.append(run(steps))
        return seen[-1]

    bench.chamber.plant.run = listening
    return seen


@pytest.fixture
def quiet_warm(quiet_unit: UnitTruth, bench_at: Callable[..., BenchTruth]) -> WorldConfig:
    """The unit without noise and with a bias, on an ideal table at 100 Hz, in a warm room."""
    unit = replace(quiet_unit, accelerometer=replace(quiet_unit.accelerometer, bias=(0.1, 0.2, 0.3)))
    bench = bench_at()
    return WorldConfig(unit, replace(bench, chamber=AWAY), seed=5, thermal=True)


def test_outputs_second_by_second_are_the_response_to_the_true_nodes(quiet_warm: WorldConfig) -> None:
    bench = build(quiet_warm)

    async def ramp() -> tuple[np.ndarray, list[np.ndarray]]:
        await bench.supply.switch_on()
        seen = nodes_watched(bench)
        await bench.chamber.command(-20.0, 5.0)
        return await read_out(bench, 1200.0), seen

    raw, seen = asyncio.run(ramp())
    nodes = np.concatenate(seen)
    assert nodes[-1, 0] < nodes[0, 0] - 40.0
    # y is up: f = (0, g, 0). Nodes of the end of a second hold through the next one.
    felt = response(UnitThermalTruth(), nodes[:-1])
    expected = felt.accelerometer_output(np.array([0.1, 0.2, 0.3]), np.array([0.0, 9.8, 0.0]))
    scale = np.array([c.scale for c in bench.imu.channels])
    angle, velocity = np.split((raw[:, :6] * scale).reshape(1200, 100, 6).sum(axis=1), 2, axis=1)
    # A sum over a second is true to a pulse at either end: 3.5e-8 m/s, against some 1e-4 m/s² a °C.
    np.testing.assert_allclose(velocity, expected, rtol=0, atol=7.1e-8)
    # Latitude 30°, x to the north, y up: Ω·(cos L, sin L, 0); nothing of temperature is in a healthy gyro.
    earth = EARTH_RATE * np.array([0.8660254037844386, 0.5, 0.0])
    np.testing.assert_allclose(angle, np.tile(earth, (1200, 1)), rtol=0, atol=7.1e-9)


def test_a_moving_unit_feels_its_temperature_too(quiet_warm: WorldConfig) -> None:
    warm, cold = build(quiet_warm), build(replace(quiet_warm, thermal=False))

    async def move(bench: SimulatedBench) -> np.ndarray:
        await bench.supply.switch_on()
        stream = bench.imu.record(20.0)
        turning = asyncio.create_task(bench.turntable.move_to(TableAngles(0, 90, 45)))
        raw = np.concatenate([b async for b in stream.blocks])
        await turning
        return raw[:, 3:] * [c.scale for c in bench.imu.channels[3:]] * RATE

    seen = nodes_watched(warm)
    hot, plain = asyncio.run(move(warm)), asyncio.run(move(cold))
    bias = np.array([0.1, 0.2, 0.3])
    felt = response(UnitThermalTruth(), np.concatenate(seen)[:20])
    found = hot.reshape(20, 100, 3).mean(axis=1)
    # The response is linear in f within a second, so it acts on the second's mean.
    through = plain.reshape(20, 100, 3).mean(axis=1) - bias
    assert np.ptp(plain[:, 0]) > 9.79
    np.testing.assert_allclose(found, felt.accelerometer_output(bias, through), rtol=0, atol=1.5e-7)


def test_noise_passes_the_converter_as_the_signal_does() -> None:
    fade = replace(UnitThermalTruth().converter[0], scale_drift=(-0.02, 0.0), zero_drift=(0.0, 0.0))
    unit = default_unit()
    noisy = replace(unit.accelerometer, random_walk=(1e-3,) * 3, quantization=(1e-9,) * 3)
    thermal = replace(UnitThermalTruth(), converter=(fade, fade, fade))
    config = replace(CONFIG, unit=replace(unit, accelerometer=noisy, thermal=thermal))
    config = replace(config, bench=replace(default_bench(), chamber=AWAY))

    async def spread(bench: SimulatedBench) -> np.ndarray:
        await bench.supply.switch_on()
        raw = await read_out(bench, 10.0, None)
        return np.diff(raw[:, 3:].astype(float), axis=0).std(axis=0)

    cold = asyncio.run(spread(build(replace(config, thermal=False))))
    warm = asyncio.run(spread(build(config)))
    # The same draws: 15 °C at −2 % a °C leave 0.7 of them; the ten seconds' own warming is some 0.01 of that.
    np.testing.assert_allclose(warm / cold, 0.7, rtol=0.01)


def test_temperature_channels_are_the_nodes_through_lag_offset_and_step() -> None:
    exact = ThermometerTruth(offset_c=0.25, lag_s=30.0, noise_c=0.0, step_c=1e-4)
    config = replace(
        CONFIG, unit=replace(default_unit(), thermal=replace(UnitThermalTruth(), thermometers=(exact,) * 5))
    )
    bench = build(config)

    async def ramp() -> tuple[np.ndarray, list[np.ndarray], Sequence[object]]:
        await bench.supply.switch_on()
        seen = nodes_watched(bench)
        await bench.chamber.command(60.0, 5.0)
        stream = bench.imu.record(600.0, WARM)
        return np.concatenate([b async for b in stream.blocks]), seen, stream.channels

    raw, seen, channels = asyncio.run(ramp())
    names = ["case", "converter", "gyro_x", "gyro_y", "gyro_z"]
    assert [c.name for c in channels[6:]] == [f"temperature_{n}" for n in names]
    assert all((c.quantity, c.unit, c.scale) == (Quantity.TEMPERATURE, "degC", 1e-4) for c in channels[6:])
    assert channels[:6] == bench.imu.channels
    codes = raw[:, 6:].reshape(600, 100, 5)
    assert np.all(codes == codes[:, :1])
    nodes = np.concatenate(seen)[:-1, [2, 3, 5, 6, 7]]
    # y' = (T − y)/30 s by small steps of another scheme: 1000 explicit ones a second, T a straight line within it.
    fine = np.array([np.interp(np.arange(599_000) * 1e-3, np.arange(600.0), node) for node in nodes.T])
    lagged, state = [nodes[0]], nodes[0].copy()
    for k in range(599):
        inputs = fine[:, k * 1000 : (k + 1) * 1000]
        weights = (1e-3 / 30.0) * (1.0 - 1e-3 / 30.0) ** np.arange(999, -1, -1)
        state = state * (1.0 - 1e-3 / 30.0) ** 1000 + inputs @ weights
        lagged.append(state)
    np.testing.assert_allclose(codes[:, 0] * 1e-4, np.array(lagged) + 0.25, rtol=0, atol=2e-4)


def test_power_heats_the_unit_and_off_it_cools() -> None:
    still = replace(default_bench(), chamber=ChamberTruth(fluctuation_c=0.0, place_offset_c=0.0))
    light = replace(UnitThermalTruth(), network=NetworkTruth(gyro_j_k=150.0, accelerometer_block_j_k=80.0))
    unit = replace(default_unit(), thermal=light)
    bench = build(replace(CONFIG, unit=unit, bench=still, sample_rate_hz=1.0))

    async def on_and_off() -> list[np.ndarray]:
        found = []
        await bench.chamber.command(22.0, 5.0)
        for verb in (bench.supply.switch_on, bench.supply.switch_off):
            await verb()
            await bench.clock.sleep(5400.0)
            found.append(np.array(bench.chamber.plant.state.temperatures_c))
        return found

    warm, cool = asyncio.run(on_and_off())
    # 12 + 1 + 1.5 + 3·4 W go through 8 W/K to air at 22 °C, 4 W of a gyro through 1.2 W/K to the case. Time constants
    # are at most 5.7 kJ/K over 8 W/K and what the parts lag, below 900 s: of 7 K 0.02 are left, and 0.01 °C of noise.
    assert warm[2] == pytest.approx(22.0 + 26.5 / 8.0, abs=0.02)
    np.testing.assert_allclose(warm[5:], 22.0 + 26.5 / 8.0 + 4.0 / 1.2, atol=0.02)
    np.testing.assert_allclose(cool[2:], 22.0, atol=0.02)


def test_a_healthy_gyro_counts_the_same_in_heat_and_a_failing_one_its_residue() -> None:
    residue = 0.05 * DEG_PER_HOUR
    failing = replace(UnitThermalTruth(), gyro=GyroThermalTruth((residue, -residue, 0.0)))
    warm_room = replace(default_bench(), chamber=AWAY)

    async def counts(config: WorldConfig) -> np.ndarray:
        bench = build(config)
        await bench.supply.switch_on()
        return await read_out(bench, 600.0, None)

    healthy = replace(CONFIG, bench=warm_room)
    plain, hot, broken = (
        asyncio.run(counts(c))
        for c in (
            replace(healthy, thermal=False),
            healthy,
            replace(healthy, unit=replace(default_unit(), thermal=failing)),
        )
    )
    assert np.array_equal(plain[:, :3], hot[:, :3])
    assert not np.array_equal(plain[:, 3:], hot[:, 3:])
    pulse = np.array(default_unit().gyro.pulse)
    drift = (broken[:, :3].sum(axis=0) - plain[:, :3].sum(axis=0)) * pulse
    # 15 °C and the ten minutes' self-heating, some 1.6 K, at 0.05 deg/h a °C over 600 s; a pulse at either end.
    assert drift[2] == 0.0
    assert drift[0] == pytest.approx(residue * 16.0 * 600.0, rel=0.1, abs=2 * pulse[0])
    assert drift[1] == pytest.approx(-residue * 16.0 * 600.0, rel=0.1, abs=2 * pulse[1])


def test_a_world_without_temperatures_has_no_chamber_and_refuses_them() -> None:
    bench = build(replace(CONFIG, thermal=False))
    assert bench.chamber is None
    asyncio.run(bench.supply.switch_on())
    with pytest.raises(OutOfRange, match=r"station.temperatures = True: .* without its chamber"):
        bench.imu.record(1.0, WARM)
    assert len(bench.imu.record(1.0, Station(0, "plain")).channels) == 6


def test_a_bench_that_declares_no_chamber_cannot_be_opened_with_one() -> None:
    shipped = default_bench()
    bare = replace(shipped, description=replace(shipped.description, chamber=None))
    with pytest.raises(DeviceFault, match="bench 'sim' has no thermal chamber"):
        build(replace(CONFIG, bench=bare))


def test_needs_open_the_chamber_and_set_the_rate() -> None:
    driver = SimulatedDriver("second")
    assert driver.description.id == "second"
    assert driver.description.chamber is not None
    bench = driver.open("RANDOM-7", 3, None, BenchNeeds(100.0, temperatures=True))
    assert bench.imu.rate_hz == 100.0
    assert bench.chamber is not None
    assert bench.chamber.limits == driver.description.chamber
    assert driver.open("SIM-0001", 3, None, BenchNeeds()).chamber is None


def test_faults_of_chamber_and_thermometers_reach_the_recording() -> None:
    first, second, *others = UnitThermalTruth().thermometers
    thermometers = (replace(first, stuck_from_s=50.0), replace(second, disconnected_from_s=80.5), *others)
    unit = replace(default_unit(), thermal=replace(UnitThermalTruth(), thermometers=thermometers))
    faulty = replace(default_bench(), chamber_faults=(ChamberFault("link_lost", 90.0),))
    bench = build(replace(CONFIG, unit=unit, bench=faulty))

    async def ramp() -> np.ndarray:
        await bench.supply.switch_on()
        await bench.chamber.command(60.0, 5.0)
        raw = await read_out(bench, 200.0)
        with pytest.raises(Disconnected):
            await bench.chamber.read()
        with pytest.raises(ExceptionGroup):
            await bench.make_safe()
        assert not bench.supply.is_on()
        return raw[:, 6:]

    codes = asyncio.run(ramp())
    assert np.all(codes[5000:, 0] == codes[4999, 0])
    assert len(np.unique(codes[8100:, 1])) == 1
    assert codes[8100, 1] == DISCONNECTED_CODE
    assert codes[8099, 1] != DISCONNECTED_CODE


def test_made_safe_the_chamber_goes_to_ambient_and_the_unit_is_off() -> None:
    bench = build(CONFIG)

    async def stop() -> float:
        await bench.supply.switch_on()
        await bench.chamber.command(-40.0, 5.0)
        await bench.clock.sleep(3600.0)
        await bench.make_safe()
        assert not bench.supply.is_on()
        assert (await bench.chamber.read()).target_c == 22.0
        assert bench.clock.now_s() == 3600.0
        await bench.clock.sleep(3600.0)
        return (await bench.chamber.read()).air_c

    assert asyncio.run(stop()) == pytest.approx(22.0, abs=0.5)
