"""Readings of table, supply, room and status words over a recording, kept as means and spreads.

They are taken now and then while its blocks come.

The encoders are compared with what was commanded at each reading.
"""

from collections.abc import Sequence
from dataclasses import asdict
from math import inf, sqrt
from typing import Any

from bench_service.bench.pace import PaceLog
from procedures.analysis.measured_stations import angle_difference_deg
from procedures.bench import Bench, BenchDescription
from procedures.bench.description import TableAccuracy
from procedures.bench.device import Status
from procedures.bench.errors import DeviceFault
from procedures.bench.supply import SupplyReading
from procedures.bench.turntable import TableReading
from procedures.core.measured import Measured, MeasuredAngles, MeasuredEnvironment, MeasuredSupply
from procedures.core.recording import Station
from procedures.core.table_angles import TableAngles

LEAST_S = 1.0
"""Shortest interval between two readings [s, bench time]."""
AXES = ("outer", "middle", "inner")
ROOM = ("temperature_c", "humidity_percent", "pressure_hpa")
LEAST_TOLERANCE_DEG = 0.01
"""Smallest tolerance that any table gets [deg]."""
SIGMAS = 10.0
"""Number of standard uncertainties of a commanded angle beyond which an encoder disagrees with the demand: by chance
no table does so, and a wrong axis, a lost turn or a table that was turned by hand all do.
"""
STATUS_WORDS = 50
"""Largest number of different status words that are kept of one recording."""


class _Moments:
    """Running mean and standard deviation of several numbers (Welford's recurrence)."""

    def __init__(self, size: int) -> None:
        self.count = 0
        self.mean = [0.0] * size
        self._squares = [0.0] * size

    def add(self, values: Sequence[float]) -> None:
        self.count += 1
        for k, value in enumerate(values):
            step = value - self.mean[k]
            self.mean[k] += step / self.count
            self._squares[k] += step * (value - self.mean[k])

    @property
    def spread(self) -> list[float]:
        return [sqrt(s / (self.count - 1)) if self.count > 1 else 0.0 for s in self._squares]


class DeviceLog:
    """Readings of table, supply, room and status words during one recording, kept as means and spreads.

    Refuses an axis that is not where it was commanded.
    """

    def __init__(self, bench: Bench, station: Station, start_s: float) -> None:
        """Set up; `start_s`: bench time of the recording's beginning [s].

        Angles are read of a table that stands still and carries the unit: not where a hand sets it.
        """
        moved = station.turn is not None or station.sinusoid is not None
        alone = not moved and station.profile is None and station.current_ma is None
        self._commanded = station.angles if alone else None
        self._bench = bench
        self._read_s = -inf
        self._angles = _Moments(len(AXES))
        self._power = _Moments(2)
        self._limiting = False
        self._room = {name: _Moments(1) for name in ROOM}
        self._status: dict[str, None] = {}
        wired = any(device.name == "unit_link" and device.address for device in bench.description.devices)
        self._pace = PaceLog(start_s) if wired else None

    def block(self, samples_s: float) -> None:
        """A block of the unit has come; `samples_s`: time of all samples so far [s]."""
        if self._pace is not None:
            self._pace.block(self._bench.clock.now_s(), samples_s)

    async def look(self) -> None:
        """Read the devices if the last reading is old enough.

        Raises `DeviceFault` where an axis is not where it was commanded, and as the devices' `read` does.
        """
        now_s = self._bench.clock.now_s()
        if now_s - self._read_s < LEAST_S:
            return
        self._read_s = now_s
        if self._commanded is not None:
            self._table(self._commanded, await self._bench.turntable.read())
        self._supply(await self._bench.supply.read())
        if self._bench.environment is not None:
            room = await self._bench.environment.read()
            for name, moments in self._room.items():
                if (value := getattr(room, name)) is not None:
                    moments.add((value,))
        self._note(self._bench.imu.status())

    def measured(self) -> Measured:
        """Return means and spreads of the readings so far: encoders, supply, room and status words; None for each
        device of which no reading was taken.
        """
        angles = supply = None
        if self._angles.count:
            mean, spread = TableAngles(*self._angles.mean), TableAngles(*self._angles.spread)
            angles = MeasuredAngles(mean, spread, self._angles.count)
        if self._power.count:
            voltage, current = self._power.mean
            supply = MeasuredSupply(voltage, current, self._power.spread[1], self._limiting, self._power.count)
        means = {name: m.mean[0] for name, m in self._room.items() if m.count}
        room = MeasuredEnvironment(**means) if means else None
        pace = None if self._pace is None else self._pace.measured()
        return Measured(angles, supply, room, tuple(self._status), pace)

    def _table(self, commanded: TableAngles, reading: TableReading) -> None:
        require_agreement(commanded, reading, self._bench.description.accuracy)
        self._angles.add([getattr(reading.angles, f"{axis}_deg") for axis in AXES])
        self._note(reading.status)

    def _supply(self, reading: SupplyReading) -> None:
        self._power.add((reading.voltage_v, reading.current_a))
        self._limiting |= reading.limiting
        self._note(reading.status)

    def _note(self, status: Status) -> None:
        for word in map(str, status):
            if len(self._status) < STATUS_WORDS:
                self._status[word] = None


def made_by(description: BenchDescription) -> dict[str, Any]:
    """Return the origin of a recording and of each device by its name, as the JSON that is stored with the recording;
    empty where all devices are simulated.
    """
    if not description.devices:
        return {}
    return {
        "origin": description.origin,
        "devices": {
            device.name: {name: value for name, value in asdict(device).items() if name != "name"}
            for device in description.devices
        },
    }


def tolerance_deg(accuracy: TableAccuracy) -> float:
    """Largest allowed |encoder - demand| of any axis [deg]: the greater of 0.01 deg and ten pointing uncertainties."""
    return max(LEAST_TOLERANCE_DEG, SIGMAS * accuracy.pointing_sd_arcsec / 3600.0)


def require_agreement(commanded: TableAngles, reading: TableReading, accuracy: TableAccuracy) -> None:
    """Check that encoders show what was commanded, whole turns apart. Raises `DeviceFault` naming the axis."""
    most = tolerance_deg(accuracy)
    for axis in AXES:
        demand, shown = getattr(commanded, f"{axis}_deg"), getattr(reading.angles, f"{axis}_deg")
        if not abs(angle_difference_deg(shown, demand)) <= most:
            raise DeviceFault(
                f"the {axis} encoder shows {shown:.4f} deg where {demand:g} was commanded, more than the {most:g} deg "
                "that the table's accuracy allows: find out why before anything else moves"
            )
