"""Chamber device with the unit's heat and thermometers: implements `procedures.bench.chamber.Chamber`.

Knows the bench's clock only as a number of ticks that pass. Temperatures are made once a second; their effect on the
unit's outputs, and the codes of its sensors, hold from the end of that second to the end of the next.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from typing import Any

import numpy as np

from procedures.bench.chamber import ChamberLimits, ChamberReading
from procedures.bench.device import DeviceIdentity
from procedures.bench.errors import DeviceFault, Disconnected, OutOfRange
from simulators.chamber.behaviour import Response, response
from simulators.chamber.plant import STEP_S, ChamberPlant
from simulators.chamber.thermometers import Codes, Thermometers
from simulators.truth import Array
from simulators.truth.thermal import NODES, ChamberFault, ChamberTruth, UnitThermalTruth


@dataclass(frozen=True)
class Warmth:
    """Thermal outcome of some ticks: temperatures and codes of every whole second that ended within them."""

    temperatures_c: Array
    """Node temperatures, (n, 8), in the order of `NODES` [°C]."""
    codes: Codes
    """Sensor codes, (n, 5), in the order of `THERMOMETERS`."""
    end_ticks: tuple[int, ...]
    """Ticks, 1 … ticks, at which each second ended."""
    before_c: Array
    """Node temperatures (8,) at the end of the last second before these ticks: they hold until the first one ends."""
    codes_before: Codes
    """Sensor codes (5,) of that same second."""


class SimChamber:
    """Device of chamber, unit's heat and thermometers. The world's clock calls `advance`."""

    def __init__(
        self,
        chamber: ChamberTruth,
        unit: UnitThermalTruth,
        seed: int,
        rate_hz: float,
        now_s: Callable[[], float],
        faults: tuple[ChamberFault, ...] = (),
        limits: ChamberLimits | None = None,
    ) -> None:
        """Build the chamber device. `rate_hz`: ticks in a second; `now_s`: bench time; `limits`: of
        demands; None: those of the truth."""
        self.truth, self.unit = chamber, unit
        self.plant = ChamberPlant(chamber, unit.network, seed)
        self.thermometers = Thermometers(unit.thermometers, seed, chamber.ambient_c)
        self.faults = faults
        self._rate_hz, self._now_s = rate_hz, now_s
        self._ticks = 0
        able = ChamberLimits(chamber.least_c, chamber.most_c, chamber.ramp_c_min, chamber.ambient_c)
        self._limits = able if limits is None else limits

    @property
    def limits(self) -> ChamberLimits:
        return self._limits

    async def identify(self) -> DeviceIdentity:
        """Identity of the simulated chamber. Raises `Disconnected`."""
        self._need_link()
        return DeviceIdentity("simulated", "thermal chamber")

    async def command(self, temperature_c: float, ramp_c_min: float) -> None:
        """Command an air temperature and a ramp. Raises `OutOfRange`, `DeviceFault`. Implements `Chamber.command`."""
        self._need_link()
        most, s = self._limits, self.plant.state
        if not (isfinite(temperature_c) and most.minimum_c <= temperature_c <= most.maximum_c):
            raise OutOfRange(f"temperature_c = {temperature_c!r} is outside {most.minimum_c:g} … {most.maximum_c:g}")
        if not 0.0 < ramp_c_min <= most.ramp_c_min:
            raise OutOfRange(f"ramp_c_min = {ramp_c_min!r} must be above 0 and at most {most.ramp_c_min:g}")
        if s.tripped:
            raise DeviceFault("the chamber's over-temperature limiter has tripped: a person must reset it")
        if s.door_open:
            raise DeviceFault("the chamber's door is open")
        self.plant.command(temperature_c, ramp_c_min / 60.0)

    async def read(self) -> ChamberReading:
        """Return the chamber's own report of its state. Implements `Chamber.read`."""
        self._need_link()
        s = self.plant.state
        set_point = s.control_reading_c if s.target_c is None else s.set_point_c
        return ChamberReading(self._now_s(), s.control_reading_c, set_point, s.target_c, s.door_open, s.tripped)

    async def make_safe(self) -> None:
        """Lead the chamber to ambient; one that is off, has tripped or stands open stays off."""
        self._need_link()
        s = self.plant.state
        if s.target_c is not None and not (s.tripped or s.door_open):
            self.plant.command(self._limits.ambient_c, self._limits.ramp_c_min / 60.0)

    def follow(self, air_c: float) -> None:
        """Stand the unit in a real chamber's air; see `ChamberPlant.follow`."""
        self.plant.follow(air_c)

    def unit_power(self, on: bool) -> None:
        """Note that the unit's supply was switched: it heats itself, or no longer does, from the next second on."""
        self.plant.state.unit_on = on

    def set_door(self, is_open: bool) -> None:
        """Open or close the door, as a person does to turn the unit over between two runs. Open, the plant stops."""
        self.plant.state.door_open = is_open
        if is_open:
            self.plant.switch_off()

    def reset_limiter(self) -> None:
        """Reset the over-temperature limiter, as a person does by hand: for tests; the service cannot do it."""
        self.plant.state.tripped = False
        self.plant.switch_off()

    def advance(self, ticks: int) -> Warmth:
        """Advance whole ticks; cheap where no second ends within them."""
        per_second = self._rate_hz * STEP_S
        first = int(self._ticks / per_second + 1e-9)
        seconds = int((self._ticks + ticks) / per_second + 1e-9) - first
        before, codes_before = np.array(self.plant.state.temperatures_c), self.thermometers.sent
        path = self.plant.run(seconds) if not self.faults else np.concatenate(self._pieces(first, seconds))
        ends = tuple(round((first + k) * per_second) - self._ticks for k in range(1, seconds + 1))
        self._ticks += ticks
        return Warmth(path, self.thermometers.read(first, path), ends, before, codes_before)

    def _pieces(self, first: int, seconds: int) -> list[Array]:
        """Compute node temperatures of the next seconds, cut where a fault begins."""
        cuts = {min(max(int(f.from_s / STEP_S) - first, 0), seconds) for f in self.faults}
        edges = sorted({0, seconds} | cuts)
        pieces = [np.empty((0, len(NODES)))]
        for begin, end in pairwise(edges):
            self._break((first + begin) * STEP_S)
            pieces.append(self.plant.run(end - begin))
        return pieces

    def _break(self, now_s: float) -> None:
        for fault in self.faults:
            if fault.from_s < now_s + STEP_S:
                self.plant.fail(fault.name)

    def response(self, temperatures_c: Array) -> Response:
        """Compute the response of the unit's outputs to node temperatures (n, 8)."""
        return response(self.unit, temperatures_c)

    @property
    def link_lost(self) -> bool:
        """Return whether the link to the chamber is lost, whatever the chamber does."""
        return any(f.name == "link_lost" and f.from_s <= self._now_s() for f in self.faults)

    def _need_link(self) -> None:
        if self.link_lost:
            raise Disconnected("the chamber does not answer")

    def checkpoint(self) -> dict[str, Any]:
        """State of the device to resume from, JSON-ready."""
        return {
            "ticks": self._ticks,
            "plant": self.plant.checkpoint(),
            "thermometers": self.thermometers.checkpoint(),
        }

    def resume(self, state: dict[str, Any]) -> None:
        """Go on from a checkpoint of a chamber of the same truths, seed and rate."""
        self._ticks = int(state["ticks"])
        self.plant.resume(state["plant"])
        self.thermometers.resume(state["thermometers"])
