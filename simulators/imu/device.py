"""Data link of the unit on a simulated bench: implements `procedures.bench.imu.Imu`."""

from collections.abc import Callable
from typing import Any

import numpy as np

from procedures.bench.device import DeviceIdentity, Status
from procedures.bench.errors import OutOfRange
from procedures.bench.imu import Stream
from procedures.core.recording import Channel, Station
from simulators.clock import Motion, SimClock
from simulators.imu.climate import Climate
from simulators.imu.sensor import TRIADS, TriadSensor
from simulators.imu.tape import Tape, Tapes
from simulators.truth import UnitTruth, temperature_channels, unit_channels


class SimImu:
    """A unit that counts from power-up to power-down, whether or not a recording runs."""

    def __init__(
        self,
        truth: UnitTruth,
        seed: int,
        clock: SimClock,
        launch: Callable[[], int],
        thermal: bool = False,
        block_s: float | None = None,
    ) -> None:
        """Connect to the clock; `launch` returns the number of the power-up, 0 while the unit is off.

        `thermal`: the unit receives a climate; `block_s`: length of a recording's blocks instead of ten seconds.
        """
        self.truth = truth
        self._thermal = thermal
        self._seed = seed
        self._clock = clock
        self._channels = unit_channels(truth)
        self._temperatures = temperature_channels(truth)
        self._sensors: dict[str, TriadSensor] = {}
        self._ticks = 0
        self._tapes = Tapes(clock, launch, block_s)

    @property
    def channels(self) -> tuple[Channel, ...]:
        return self._channels

    @property
    def rate_hz(self) -> float:
        return self._clock.rate_hz

    async def identify(self) -> DeviceIdentity:
        """Identity of the simulated unit."""
        return DeviceIdentity("simulated", "inertial unit", self.truth.serial)

    def status(self) -> Status:
        """Status words of the newest frame: a simulated unit sends none."""
        return ()

    def power_up(self, launch: int) -> None:
        """Begin a new launch: new run-to-run coefficients, noise from time zero."""
        self._ticks = 0
        self._sensors = {
            name: TriadSensor(self.truth.triad(name), self.rate_hz, (self._seed, launch, name)) for name in TRIADS
        }

    def power_down(self) -> None:
        """End the launch; recordings in progress find the unit gone."""
        self._sensors = {}
        self._tapes.stop()

    def feel(self, motion: Motion, climate: Climate | None = None) -> None:
        """Count what the unit senses during a motion; nothing while it is off. `climate`: the effect of temperature
        meanwhile, None where the world has no chamber.
        """
        if not self._sensors:
            return
        width = max((tape.columns for tape in self._tapes.running), default=len(self._channels))
        counts = np.empty((motion.ticks, width), dtype=np.int32)
        gyro, accelerometer = (None, None) if climate is None else (climate.gyro, climate.accelerometer)
        self._sensors["gyro"].feel(self._ticks, motion.ticks, motion.angle_rad, counts[:, :3].T, gyro)
        self._sensors["accelerometer"].feel(
            self._ticks, motion.ticks, motion.velocity_m_s, counts[:, 3:6].T, accelerometer
        )
        if climate is not None and width > len(self._channels):
            counts[:, len(self._channels) :] = climate.codes_at_ticks()
        self._ticks += motion.ticks
        for tape in self._tapes.running:
            tape.put(counts)

    def record(self, duration_s: float, station: Station | None = None) -> Stream:
        """Begin a recording now; time passes while its blocks are read. Implements `Imu.record`.

        A station that wants temperatures gets their channels after the six, in whole seconds, held at the sample rate.
        Raises `OutOfRange` for a negative duration, and for temperatures in a world without a chamber.
        """
        self._tapes.need_power()
        if not 0.0 <= duration_s < float("inf"):
            raise OutOfRange(f"duration_s = {duration_s!r} must be finite and not negative")
        warm = station is not None and station.temperatures
        if warm and not self._thermal:
            raise OutOfRange(
                "station.temperatures = True: this bench was opened without its chamber; "
                "only a job whose stations read temperatures opens it (needs.temperatures)"
            )
        channels = (*self._channels, *self._temperatures) if warm else self._channels
        samples = round(duration_s * self.rate_hz)
        start = self._clock.ticks
        launched_s = (start - self._ticks) / self.rate_hz
        blocks = self._tapes.blocks(samples, start, len(channels))
        return Stream(channels, self.rate_hz, start / self.rate_hz, blocks, station, launched_s)

    @property
    def since_launch_s(self) -> float:
        """Time since the unit was switched on; it stands still while it is off [s]."""
        return self._ticks / self.rate_hz

    def listen(self, tape: Tape) -> None:
        """Send all counts to a tape from now on, in every launch; one of over six channels gets temperatures too."""
        self._tapes.running.append(tape)

    def sensor(self, triad: str) -> TriadSensor:
        """Return a triad of the present launch. Raises `NotPowered`."""
        self._tapes.need_power()
        return self._sensors[triad]

    def checkpoint(self) -> dict[str, Any]:
        """State to resume from: time since power-up, counters, slow noise; empty while off."""
        return {"ticks": self._ticks, "triads": {name: sensor.checkpoint() for name, sensor in self._sensors.items()}}

    def resume(self, launch: int, state: dict[str, Any]) -> None:
        """Go on with a launch from a checkpoint; `launch` 0 is an unpowered unit."""
        if launch == 0:
            return
        self.power_up(launch)
        self._ticks = int(state["ticks"])
        for name, sensor in self._sensors.items():
            sensor.resume(state["triads"][name])
