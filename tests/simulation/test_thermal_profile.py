"""A profile driven on the simulated bench: followed, soaked by the unit's own sensors, and every fault told by name."""

import asyncio
from collections.abc import AsyncGenerator, Callable
from contextlib import aclosing
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from procedures import chamber_steps
from procedures.analysis.thermal.cycle.series import read_cycle
from procedures.analysis.turns.plan import UPRIGHT
from procedures.bench.errors import BenchError, DeviceFault, Disconnected, SoakNotReached
from procedures.bench.imu import Stream
from procedures.core.recording import MemoryRecording, RecordingInfo, Station
from procedures.core.temperature_profile import ProfileLeg, SoakCriterion, TemperatureProfile
from simulators.imu.device import SimImu
from simulators.truth import BenchTruth, default_bench, default_unit
from simulators.truth.thermal import ChamberFault, ThermometerTruth
from simulators.world import SimulatedBench, WorldConfig, build

RATE_HZ = 1.0
OFF_S = 1200.0
CRITERION = SoakCriterion(slope_c_min=0.2, window_s=120.0)
LEGS = (
    ProfileLeg(25.0, 2.0, least_soak_s=60.0, longest_s=7200.0),
    ProfileLeg(35.0, 2.0, least_soak_s=60.0, longest_s=7200.0, least_s=3600.0),
)
MOST_BLOCK_S = 60.0
"""The simulated world hands on its samples in blocks of no more than this."""
SENSORS = ("case", "converter", "gyro_x", "gyro_y", "gyro_z")


@dataclass
class Run:
    """Outcome of one station."""

    bench: SimulatedBench
    stream: Stream
    blocks: list[np.ndarray]
    failure: BenchError | None

    @property
    def raw(self) -> np.ndarray:
        return np.concatenate(self.blocks)

    def channel(self, name: str) -> np.ndarray:
        names = [c.name for c in self.stream.channels]
        channel = self.stream.channels[names.index(name)]
        return channel.scale * self.raw[:, names.index(name)]

    def recording(self) -> MemoryRecording:
        s = self.stream
        info = RecordingInfo(
            "r", "U", s.channels, s.rate_hz, len(self.raw), s.start_s, s.station, "", True, s.launched_s
        )
        return MemoryRecording(info, self.raw)


def station(legs: tuple[ProfileLeg, ...] = LEGS) -> Station:
    profile = TemperatureProfile(legs, CRITERION)
    return Station(
        *(0, "x up", UPRIGHT["x"]),
        record_s=profile.longest_s,
        power_off_s=OFF_S,
        temperatures=True,
        sample_rate_hz=RATE_HZ,
        profile=profile,
    )


def drive(
    legs: tuple[ProfileLeg, ...] = LEGS,
    faults: tuple[ChamberFault, ...] = (),
    thermometers: dict[int, ThermometerTruth] | None = None,
    meddle: Callable[[SimulatedBench], None] | None = None,
    bench: BenchTruth | None = None,
) -> Run:
    """One run; `meddle` is called once, after 1000 s."""
    unit = default_unit()
    sensors = tuple((thermometers or {}).get(i, t) for i, t in enumerate(unit.thermal.thermometers))
    unit = replace(unit, thermal=replace(unit.thermal, thermometers=sensors))
    truth = replace(bench or default_bench(), chamber_faults=faults)

    async def run() -> Run:
        world = build(WorldConfig(unit, truth, seed=7, sample_rate_hz=RATE_HZ, thermal=True))
        stream = await chamber_steps.record_profile(world, station(legs), "x up, please")
        found = Run(world, stream, [], None)
        try:
            async for block in stream.blocks:
                found.blocks.append(block)
                before, now = (sum(len(b) for b in found.blocks[:n]) for n in (-1, None))
                if meddle is not None and before < 1000 * RATE_HZ <= now:
                    meddle(world)
        except BenchError as failure:
            found.failure = failure
        return found

    return asyncio.run(run())


@pytest.fixture(scope="module")
def sound() -> Run:
    return drive()


def test_the_profile_is_followed_and_ends_the_recording_early(sound: Run):
    assert sound.failure is None
    assert len(sound.raw) < sum(leg.longest_s for leg in LEGS)
    air, set_point = sound.channel("chamber_air"), sound.channel("chamber_set_point")
    assert np.abs(air[:600] - 25.0).max() < 1.5  # it waited there while the unit was off
    assert set_point[-1] == pytest.approx(35.0, abs=1e-3)
    told = np.flatnonzero(np.diff(set_point)) + 1  # once a block
    assert np.all(np.diff(set_point[told]) / np.diff(told) * 60.0 * RATE_HZ <= 2.0 + 0.01)  # a ramp of 2 °C/min
    assert np.abs(air[-300:] - 35.0).max() < 1.5


def test_each_soak_can_be_shown_from_the_recording_alone(sound: Run):
    """Slopes by a straight line of this test's own through the last readings of each leg."""
    series = read_cycle(sound.recording(), 0)
    assert [leg.target_c for leg in series.legs] == [25.0, 35.0]
    assert series.legs[0].ended_s == series.legs[1].began_s
    assert 0.0 <= len(sound.raw) - series.legs[1].ended_s < MOST_BLOCK_S
    assert series.legs[1].ended_s - series.legs[1].began_s >= 3600.0
    for leg in series.legs:
        at = np.arange(leg.ended_s - 120.0, leg.ended_s + 1.0, 10.0).astype(int) - 1
        for name, said in (("case", leg.case_slope_c_min), ("converter", leg.converter_slope_c_min)):
            slope = np.polyfit(at / 60.0, sound.channel(f"temperature_{name}")[at], 1)[0]
            assert slope == pytest.approx(said, abs=1e-9)
            assert abs(slope) <= CRITERION.slope_c_min
        assert leg.soaked_s is not None
        assert leg.ended_s - leg.soaked_s >= 60.0


def test_the_unit_was_off_long_enough_and_made_safe_the_bench_is_cold_and_off(sound: Run):
    assert sound.stream.launched_s is not None
    assert sound.stream.launched_s >= OFF_S

    async def leave() -> float:
        await sound.bench.make_safe()
        assert not sound.bench.supply.is_on()
        assert sound.bench.chamber is not None
        await sound.bench.clock.sleep(4 * 3600.0)
        return (await sound.bench.chamber.read()).air_c

    limits = sound.bench.description.chamber
    assert limits is not None
    assert asyncio.run(leave()) == pytest.approx(limits.ambient_c, abs=1.0)


def failed(run: Run, kind: type[BenchError], *said: str) -> None:
    assert type(run.failure) is kind, run.failure
    for words in said:
        assert words in str(run.failure)
    assert run.blocks, "what was recorded before the fault is kept"


@pytest.mark.parametrize("sensor", [0, 3])
def test_a_sensor_that_is_disconnected_ends_the_run_at_once(sensor: int):
    moment = OFF_S + 1000.0
    truth = replace(default_unit().thermal.thermometers[sensor], disconnected_from_s=moment)
    run = drive(thermometers={sensor: truth})
    failed(run, DeviceFault, f"temperature_{SENSORS[sensor]} is disconnected", "-32768")
    assert len(run.raw) / RATE_HZ + run.stream.start_s - moment <= 2.0 * MOST_BLOCK_S


def test_a_sensor_that_is_stuck_is_found_on_the_next_ramp():
    truth = replace(default_unit().thermal.thermometers[1], stuck_from_s=OFF_S + 900.0)
    run = drive(thermometers={1: truth})
    failed(run, DeviceFault, "temperature_converter is stuck at", "its code has not changed")


def test_a_chamber_that_never_reaches_its_target_ends_in_soak_not_reached():
    warm = (LEGS[0], replace(LEGS[1], target_c=60.0, least_s=0.0, longest_s=5400.0))
    run = drive(warm, faults=(ChamberFault("heating_lost", OFF_S + 600.0),))
    failed(run, SoakNotReached, "leg 2 of 2, 60 °C", "has never come within 1.5 °C")


def test_a_unit_that_drifts_for_too_long_is_told_apart_from_a_chamber_that_does():
    hasty = (LEGS[0], replace(LEGS[1], least_s=0.0, longest_s=1000.0))
    failed(drive(hasty), SoakNotReached, "the unit still drifts by", "at its converter")


def test_a_runaway_heater_is_stopped_before_the_unit_is_cooked():
    run = drive(faults=(ChamberFault("heater_stuck", OFF_S + 1000.0),))
    assert type(run.failure) is DeviceFault
    assert "limiter has tripped" in str(run.failure) or "outside" in str(run.failure)
    assert max(run.channel(f"temperature_{name}").max() for name in SENSORS) < 35.0 + 30.0 + 5.0


def test_a_door_that_is_opened_ends_the_run():
    def open_door(bench: SimulatedBench) -> None:
        assert bench.chamber is not None
        bench.chamber.set_door(True)

    failed(drive(meddle=open_door), DeviceFault, "door")


def test_a_lost_link_is_passed_on_and_the_unit_is_switched_off_all_the_same():
    run = drive(faults=(ChamberFault("link_lost", OFF_S + 2000.0),))
    failed(run, Disconnected, "does not answer")
    with pytest.raises(ExceptionGroup):
        asyncio.run(run.bench.make_safe())
    assert not run.bench.supply.is_on()


def test_a_bench_without_a_chamber_is_refused_before_anything_moves():
    async def run() -> None:
        bench = build(WorldConfig(seed=7, sample_rate_hz=RATE_HZ))
        await chamber_steps.record_profile(bench, station(), "x up, please")

    with pytest.raises(DeviceFault, match="needs a thermal chamber"):
        asyncio.run(run())


@pytest.mark.parametrize("record", [chamber_steps.record_profile, chamber_steps.record_cold_start])
def test_whoever_stops_reading_early_closes_the_units_stream(
    record: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
):
    """Without it the unit would go on recording until the collector finds the stream."""
    closed: list[bool] = []
    begun = SimImu.record

    async def noting(blocks: AsyncGenerator[np.ndarray]) -> AsyncGenerator[np.ndarray]:
        async with aclosing(blocks):
            try:
                async for block in blocks:
                    yield block
            finally:
                closed.append(True)

    def noted(imu: SimImu, *asked: Any) -> Stream:
        stream = begun(imu, *asked)
        return replace(stream, blocks=noting(stream.blocks))  # pyright: ignore[reportArgumentType]

    async def run() -> int:
        world = build(WorldConfig(default_unit(), default_bench(), seed=7, sample_rate_hz=RATE_HZ, thermal=True))
        more = ("x up, please",) if record is chamber_steps.record_profile else ()
        stream = await record(world, station(LEGS[:1]), *more)
        first = await anext(stream.blocks)
        await stream.blocks.aclose()
        assert closed == [True]
        return first.shape[1] - len(stream.channels)

    monkeypatch.setattr(SimImu, "record", noted)
    assert asyncio.run(run()) == 0, "the chamber's readings stand beside"


def test_limits_of_the_chamber_are_violations_of_the_plan():
    bench = default_bench().description
    beyond = (replace(LEGS[0], target_c=-90.0), replace(LEGS[1], ramp_c_min=50.0))
    found = bench.violations(UPRIGHT["x"], None, TemperatureProfile(beyond))
    assert len(found) == 2
    assert "leg 1: -90 °C is outside" in found[0]
    assert "leg 2: a ramp of 50 °C/min is above" in found[1]
    assert bench.violations(UPRIGHT["x"], None, TemperatureProfile(LEGS)) == ()
    none = replace(bench, chamber=None)
    assert none.violations(UPRIGHT["x"], None, TemperatureProfile(LEGS)) == (
        f"bench {bench.id} has no thermal chamber",
    )
