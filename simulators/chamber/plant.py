"""Plant of the chamber: set point generator, controller, heater and cooler, limiter, door; and the heat in the unit.

Goes in whole seconds; knows neither the bench's clock nor the port. The same seed gives the same temperatures in
whatever pieces time passes, and after a resume.
"""

from dataclasses import asdict, dataclass, field
from math import erf, exp, sqrt
from typing import Any

import numpy as np

from simulators.chamber.network import AIR, AMBIENT, HEATER, INPUTS, PLACE, POWER, Step, rates, with_held_air
from simulators.truth import Array, KeyedBlocks
from simulators.truth.thermal import NODES, ChamberTruth, NetworkTruth

STEP_S = 1.0
BLOCK_STEPS = 600
"""Number of steps for which random numbers are drawn at a time."""
SQRT_2 = sqrt(2.0)


@dataclass
class PlantState:
    """State that continues from one second to the next, JSON-ready by `ChamberPlant.checkpoint`."""

    temperatures_c: list[float]
    """Temperatures in the order of `NODES` [°C]."""
    step: int = 0
    target_c: float | None = None
    """Target of the controller [°C]; None: heater and cooler are off."""
    ramp_c_s: float = 0.0
    set_point_c: float = 0.0
    integral_w: float = 0.0
    wander: float = 0.0
    """State of the air's fluctuation, a unit normal number."""
    place_c: float = 0.0
    """Temperature of the air at the unit less that at the controller, at the present moment [°C]."""
    control_reading_c: float = 0.0
    unit_on: bool = False
    door_open: bool = False
    tripped: bool = False
    failed: list[str] = field(default_factory=list[str])
    """"heater_stuck", "heating_lost", "cooling_lost", "control_sensor_stuck"."""


class ChamberPlant:
    """Chamber and unit as a network of thermal capacities."""

    def __init__(self, chamber: ChamberTruth, unit: NetworkTruth, seed: int) -> None:
        """Start with everything at the room's temperature, plant off, unit off."""
        self.truth = chamber
        self.state = PlantState([chamber.ambient_c] * len(NODES), place_c=0.0, control_reading_c=chamber.ambient_c)
        self._steps = {door: Step.of(*rates(chamber, unit, door), STEP_S).matrix for door in (False, True)}
        self._follows = Step.of(*with_held_air(*rates(chamber, unit, False)), STEP_S).matrix
        self._air_c: float | None = None
        self._draws = KeyedBlocks(seed, "chamber")
        self._block, self._normal = -1, np.empty((0, 2))
        self._decay = exp(-STEP_S / chamber.fluctuation_s)
        self._gain = sqrt(1.0 - self._decay**2)
        self._offset, self._band = chamber.place_offset_c, chamber.fluctuation_c

    def run(self, steps: int) -> Array:
        """Advance some seconds; return the node temperatures at the end of each, (steps, 8) [°C]."""
        if self._air_c is not None:
            return self._run_in(self._air_c, steps)
        s = self.state
        nodes, z = len(NODES), np.empty(len(NODES) + len(INPUTS) + 1)
        z[:nodes], z[AMBIENT], z[POWER] = s.temperatures_c, self.truth.ambient_c, float(s.unit_on)
        temperatures, matrix, path = z[:nodes], self._steps[s.door_open], np.empty((steps, nodes))
        control, place, at = self._control, s.place_c, 0
        while at < steps:
            block, first = divmod(s.step + at, BLOCK_STEPS)
            last = min(BLOCK_STEPS, first + steps - at)
            noise = self._draw(block)[first:last]
            for k, (draw, reading_noise) in enumerate(noise.tolist(), start=at):
                s.wander = self._decay * s.wander + self._gain * draw
                # The normal number's own probability, spread over ±1: the air stays within its band for ever.
                after = self._offset + self._band * erf(s.wander / SQRT_2)
                z[HEATER], z[PLACE], z[-1] = control(z.item(AIR), reading_noise), place, after
                np.matmul(matrix, z, path[k])
                temperatures[:] = path[k]
                place = after
            at += last - first
        s.temperatures_c, s.place_c, s.step = temperatures.tolist(), place, s.step + steps
        return path

    def follow(self, air_c: float) -> None:
        """Take the air's temperature from a real chamber's newest reading [°C] from now on, and control nothing.

        A unit that felt nothing yet has the temperature of the first reading throughout.
        """
        if self._air_c is None and self.state.step == 0:
            self.state.temperatures_c = [air_c] * len(NODES)
        self._air_c = air_c

    def _run_in(self, air_c: float, steps: int) -> Array:
        """Advance some seconds in air of a given temperature, which is that at the unit; see `run`."""
        s, nodes = self.state, len(NODES)
        z, path = np.zeros(len(NODES) + len(INPUTS) + 1), np.empty((steps, nodes))
        z[:nodes], z[AMBIENT], z[POWER] = s.temperatures_c, self.truth.ambient_c, float(s.unit_on)
        z[AIR] = air_c
        for k in range(steps):
            path[k] = self._follows @ z
            z[:nodes] = path[k]
        s.temperatures_c, s.step = z[:nodes].tolist(), s.step + steps
        s.control_reading_c = air_c
        return path

    def _draw(self, block: int) -> Array:
        """Standard normal numbers for the wandering air and the control sensor, (BLOCK_STEPS, 2)."""
        if block != self._block:
            self._normal, self._block = self._draws.at(block).standard_normal((BLOCK_STEPS, 2)), block
        return self._normal

    def _control(self, air_c: float, noise: float) -> float:
        """Heat into the air [W] for the second to come."""
        s, t = self.state, self.truth
        if not t.limiter_low_c <= air_c <= t.limiter_high_c:
            s.tripped = True
        if "control_sensor_stuck" not in s.failed:
            s.control_reading_c = air_c + t.control_sensor_noise_c * noise
        if s.tripped:
            return 0.0
        if "heater_stuck" in s.failed:
            return t.heating_w
        if s.target_c is None:
            return 0.0
        most = s.ramp_c_s * STEP_S
        s.set_point_c += min(max(s.target_c - s.set_point_c, -most), most)
        error = s.set_point_c - s.control_reading_c
        asked = t.proportional_w_k * error + s.integral_w
        coldest = 0.0 if "cooling_lost" in s.failed else -t.cooling_w
        given = min(max(asked, coldest), 0.0 if "heating_lost" in s.failed else t.heating_w)
        if given == asked or (asked - given) * error < 0.0:  # saturated, the integral waits
            s.integral_w += t.proportional_w_k * error * STEP_S / t.integral_s
        return given

    def command(self, target_c: float, ramp_c_s: float) -> None:
        """Go to a temperature, the set point moving no faster than the ramp, from where the air is if it was off."""
        s = self.state
        if s.target_c is None:
            s.set_point_c, s.integral_w = s.control_reading_c, 0.0
        s.target_c, s.ramp_c_s = target_c, ramp_c_s

    def switch_off(self) -> None:
        """Switch heating and cooling off; the chamber drifts to the room's temperature."""
        self.state.target_c = None

    def fail(self, what: str) -> None:
        """Apply a fault of the plant for good; a name that the plant does not know changes nothing."""
        if what not in self.state.failed:
            self.state.failed.append(what)

    def checkpoint(self) -> dict[str, Any]:
        """State to resume from, JSON-ready; floats survive JSON to the last bit."""
        return asdict(self.state)

    def resume(self, state: dict[str, Any]) -> None:
        """Go on from a checkpoint of a plant of the same truth and seed."""
        self.state = PlantState(**state)
        self._block = -1
