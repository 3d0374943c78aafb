"""Steps in a thermal chamber that several procedures share: profiles, soaks of a converter, cold starts."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.thermal.profile_progress import (
    AIR,
    CASE,
    CHECK_S,
    CONVERTER,
    DISCONNECTED_CODE,
    SENSORS,
    SET_POINT,
    CheckedSamples,
    ProfileProgress,
    SensorWatch,
    Standing,
)
from procedures.bench import Bench
from procedures.bench.chamber import Chamber, ChamberReading
from procedures.bench.errors import DeviceFault, SoakNotReached
from procedures.bench.imu import Stream
from procedures.core.errors import MissingChannel
from procedures.core.recording import Channel, Quantity, Station
from procedures.core.temperature_profile import ProfileLeg, TemperatureProfile
from procedures.steps import Blocks, switch_on, taken

CHAMBER_SCALE_C = 0.001
"""Scale of the channels of the chamber's own readings [°C a count]."""
CHAMBER_CHANNELS = tuple(Channel(name, Quantity.TEMPERATURE, "degC", CHAMBER_SCALE_C) for name in (AIR, SET_POINT))


async def record_profile(bench: Bench, station: Station, request: str) -> Stream:
    """Record one launch in the chamber: off, set by hand by `request`, off for `power_off_s`, on, record the profile.

    While the unit is off the chamber goes to the profile's first temperature. While the stream is read the profile is
    driven: each leg is commanded, and left when the *unit's* temperatures show that it has soaked. The chamber's own
    readings, taken once a block, stand in two more channels, `CHAMBER_CHANNELS`, so that every soak can be judged
    again from the recording. The stream ends with the last soak, at the latest after `record_s`.

    Reading it may raise `SoakNotReached`, `DeviceFault` (chamber tripped or open, a temperature sensor disconnected or
    stuck, the unit too hot or too cold), `OutOfRange`, `Disconnected`. Raises `DeviceFault` where the bench has no
    chamber or no operator, and as the devices do.
    """
    chamber, profile = bench.chamber, station.profile
    if chamber is None or bench.operator is None or station.angles is None or profile is None:
        raise DeviceFault(f"station {station.label!r} needs a thermal chamber, a person, an attitude and a profile")
    await bench.supply.switch_off()
    await bench.operator.set_by_hand(station.angles, request)
    await _command(chamber, profile.legs[0])
    await bench.clock.sleep(station.power_off_s)
    await switch_on(bench, station)
    await bench.clock.sleep(station.settle_s)
    stream = bench.imu.record(station.record_s, station)
    columns = _columns(stream.channels)
    driven = _driven(chamber, profile, stream, columns)
    return replace(stream, channels=(*stream.channels, *CHAMBER_CHANNELS), blocks=driven)


def _columns(channels: Sequence[Channel]) -> list[int]:
    """Columns of the unit's temperature sensors. Raises `MissingChannel`."""
    names = [channel.name for channel in channels]
    for name in SENSORS:
        if name not in names:
            raise MissingChannel(name, names)
    return [names.index(name) for name in SENSORS]


async def _command(chamber: Chamber, leg: ProfileLeg) -> None:
    await chamber.command(leg.target_c, leg.ramp_c_min)


class _SetPoint:
    """Set point that moves along the commanded ramp, for a chamber that reports only the final one."""

    def __init__(self, first: ChamberReading) -> None:
        """Begin at the first reading, where the chamber was commanded to the first leg's temperature already."""
        told = first.set_point_c if first.set_point_c is not None else first.target_c
        self._value_c, self._time_s = first.air_c if told is None else told, first.time_s

    def at(self, reading: ChamberReading, leg: ProfileLeg | None) -> float:
        """The chamber's own moving set point, else the commanded ramp's at this reading [°C]."""
        most = 0.0 if leg is None else leg.ramp_c_min / 60.0 * max(0.0, reading.time_s - self._time_s)
        target = self._value_c if leg is None else leg.target_c
        self._value_c += min(max(target - self._value_c, -most), most)
        self._time_s = reading.time_s
        if reading.set_point_c is not None:
            self._value_c = reading.set_point_c
        return self._value_c


def _beside(block: NDArray[np.int32], air_c: float, set_point_c: float) -> NDArray[np.int32]:
    """The block with the chamber's reading in two more columns, `CHAMBER_CHANNELS`."""
    counts = np.array([round(value / CHAMBER_SCALE_C) for value in (air_c, set_point_c)], dtype=np.int32)
    return np.column_stack([block, np.broadcast_to(counts, (len(block), 2))])


async def _driven(chamber: Chamber, profile: TemperatureProfile, stream: Stream, columns: list[int]) -> Blocks:
    """The stream's blocks with the chamber's readings appended; each leg is commanded when the one before is done."""
    progress, watch = ProfileProgress(profile), SensorWatch(profile)
    sensors = [stream.channels[c] for c in columns]
    checked = CheckedSamples(stream.rate_hz)
    await _command(chamber, profile.legs[0])
    moving = _SetPoint(await chamber.read())
    async with taken(stream.blocks) as blocks:
        async for block in blocks:
            reading = await chamber.read()
            air_c = round(reading.air_c / CHAMBER_SCALE_C) * CHAMBER_SCALE_C  # as whoever judges again will read it
            yield _beside(block, air_c, moving.at(reading, progress.leg))
            _require_working(reading)
            for row, t_s in checked.of_block(len(block)):
                codes = block[row, columns].tolist()
                temperatures = [c.value(code) for c, code in zip(sensors, codes, strict=True)]
                if (wrong := watch.step(codes, temperatures)) is not None:
                    raise DeviceFault(wrong)
                if await _advance(chamber, progress, t_s, temperatures, air_c):
                    return
    raise SoakNotReached("the recording ended before the last leg of its profile: give the legs a greater longest_s")


async def _advance(
    chamber: Chamber, progress: ProfileProgress, t_s: float, temperatures: list[float], air_c: float
) -> bool:
    """Judge one reading, command the next leg where one is done; True at the profile's end."""
    case, converter = temperatures[SENSORS.index(CASE)], temperatures[SENSORS.index(CONVERTER)]
    standing = progress.step(t_s, case, converter, air_c)
    if standing is Standing.LATE:
        raise SoakNotReached(progress.why_late(air_c))
    if standing is Standing.DONE:
        if progress.leg is None:
            return True
        await _command(chamber, progress.leg)
    return False


def _require_working(reading: ChamberReading) -> None:
    if reading.tripped:
        raise DeviceFault(
            f"the chamber's over-temperature limiter has tripped, the air was at {reading.air_c:.1f} °C: "
            "a person must find out why and reset it"
        )
    if reading.door_open:
        raise DeviceFault("the chamber's door was opened during the run")


async def record_current(bench: Bench, station: Station) -> Stream:
    """Record a converter alone: on, the station's current on its inputs, soak at its temperature, settle, record.

    The soak is over by the converter's *own* sensor and the criterion of the station's profile, whose last
    leg is the temperature. The current flows meanwhile, so that what it heats is steady too. Raises `SoakNotReached`,
    `DeviceFault` (no such devices, chamber tripped or open, sensor disconnected), and as the devices do.
    """
    chamber, source, profile = bench.chamber, bench.current_source, station.profile
    if chamber is None or source is None or profile is None or station.current_ma is None:
        raise DeviceFault(f"station {station.label!r} needs a thermal chamber, a current source, and a soak")
    await switch_on(bench, station)
    await source.set_current(station.current_ma)
    await _soaked(bench, chamber, profile, station)
    await bench.clock.sleep(station.settle_s)
    return bench.imu.record(station.record_s, station)


async def _soaked(bench: Bench, chamber: Chamber, profile: TemperatureProfile, station: Station) -> None:
    """Drive a profile until the converter's own sensor has soaked; nothing of it is kept."""
    progress = ProfileProgress(profile)
    stream = bench.imu.record(profile.longest_s + CHECK_S, station)
    names = [channel.name for channel in stream.channels]
    if CONVERTER not in names:
        raise MissingChannel(CONVERTER, names)
    column, checked = names.index(CONVERTER), CheckedSamples(stream.rate_hz)
    sensor = stream.channels[column]
    await _command(chamber, profile.legs[0])
    async with taken(stream.blocks) as blocks:
        async for block in blocks:
            reading = await chamber.read()
            _require_working(reading)
            for row, t_s in checked.of_block(len(block)):
                code = int(block[row, column])
                if code == DISCONNECTED_CODE:
                    raise DeviceFault(f"{CONVERTER} is disconnected: it sends code {DISCONNECTED_CODE}")
                readings = [sensor.value(code)] * len(SENSORS)
                if await _advance(chamber, progress, t_s, readings, reading.air_c):
                    return
    raise SoakNotReached("the converter has not soaked in the time that the profile allows")


WATCH_S = 60.0
"""The chamber is looked at so often while the unit soaks switched off [s]."""


async def record_cold_start(bench: Bench, station: Station) -> Stream:
    """Record the first moments of a unit that has soaked at the station's temperature, switched off.

    Off, chamber to the temperature of the station's profile, off for `power_off_s`, on, record; the chamber's readings
    stand in two more channels as those of `record_profile`. Raises `SoakNotReached` where the chamber's air is not at
    its target by then, `DeviceFault` (no chamber, tripped, door open), and as the devices do.
    """
    chamber, profile = bench.chamber, station.profile
    if chamber is None or profile is None:
        raise DeviceFault(f"station {station.label!r} needs a thermal chamber and a temperature")
    await bench.supply.switch_off()
    leg = profile.legs[-1]
    await _command(chamber, leg)
    left_s = station.power_off_s
    while left_s > 0.0:
        await bench.clock.sleep(min(WATCH_S, left_s))
        left_s -= WATCH_S
        _require_working(await chamber.read())
    reading = await chamber.read()
    if abs(reading.air_c - leg.target_c) > profile.criterion.air_within_c:
        raise SoakNotReached(
            f"after {station.power_off_s:g} s the chamber's air was at {reading.air_c:.1f} °C, and {leg.target_c:g} °C "
            "was the target: give it more time (soak_s), or find out why"
        )
    await switch_on(bench, station)
    stream = bench.imu.record(station.record_s, station)
    _columns(stream.channels)
    said = _with_chamber(chamber, stream)
    return replace(stream, channels=(*stream.channels, *CHAMBER_CHANNELS), blocks=said)


async def _with_chamber(chamber: Chamber, stream: Stream) -> Blocks:
    """The stream's blocks with the chamber's readings appended."""
    async with taken(stream.blocks) as blocks:
        async for block in blocks:
            reading = await chamber.read()
            yield _beside(block, reading.air_c, reading.air_c if reading.set_point_c is None else reading.set_point_c)
            _require_working(reading)
