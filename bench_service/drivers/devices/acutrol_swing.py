"""Sinusoids of an ACUTROL table by its synthesizer, watched and traced by the encoders.

Not confirmed on a device. That `:demand:oscillator` swings about the loaded position, and that the synthesizer goes on
until the mode changes, is assumed: an axis that leaves its amplitude, or does not reach half of it, is a `DeviceFault`.
"""

import asyncio

import numpy as np

from bench_service.drivers.devices.acutrol_link import AcutrolSection
from bench_service.drivers.devices.acutrol_watch import AT_REST, POLL_S, WatchedTable
from bench_service.drivers.devices.table_axes import AXES, angles_of, declared
from bench_service.drivers.interface.driver import DriverContext, narrowed
from bench_service.drivers.protocols.acutrol import AxisState
from procedures.bench.errors import DeviceFault
from procedures.bench.turntable import NO_TRACE, EncoderTrace, appended
from procedures.core.sinusoid import Sinusoid

TRACE_S = 0.005
"""Pause between two readings of an axis that swings [s, bench time]."""
STATUS_EVERY = 200
"""Number of readings after which the interlocks are read again."""
BEYOND, LEAST = 1.3, 0.5
"""Shares of the amplitude beyond which an axis does not do what was demanded, and below which it does not swing."""
TURNING = 5.0
"""Rates of rest that an axis must gain within the readings that make rest, so that no turning point looks like it."""

BACK_S = 1.0
"""Planned time of the way back to where a sinusoid began [s]."""


class SwingingTable(WatchedTable):
    """ACUTROL table whose sinusoids are begun in the synthesizer's mode and ended by braking in rate mode."""

    def __init__(self, section: AcutrolSection, context: DriverContext) -> None:
        super().__init__(section, context)
        self._traced = NO_TRACE

    def trace(self) -> EncoderTrace:
        """Return the encoder readings of the sinusoid since the last call; waits on no line. Each is timed by the
        middle of its request. Implements `Turntable.trace`.
        """
        taken, self._traced = self._traced, NO_TRACE
        return taken

    async def command_sinusoid(self, sinusoid: Sinusoid) -> None:
        """Begin a sinusoid of one axis and return; it is watched, traced and ended from here on. Implements
        `Turntable.command_sinusoid`.
        """
        index, demand = AXES.index(sinusoid.axis), self._begin()
        try:
            states = await self._require_ready()
            start = [state.position_deg for state in states]
            bench = declared(narrowed(self._section, self._link.own))
            self._require_allowed(bench.sinusoid_violations(angles_of(start), sinusoid) + self._too_slow(sinusoid))
            await self._prepare_brake(demand)
            axis = self._axes()[index]
            await self._link.limit("synthesis", index, axis.rate_deg_s, axis.acceleration_deg_s2)
            self._require_current(demand)
            await self._link.demand("position", index, self._demanded(index, start[index], start[index]))
            self._require_current(demand)
            await self._link.oscillator(index, sinusoid.amplitude_deg, sinusoid.frequency_hz)
            self._require_current(demand)
            begun_s = self._clock.now_s()
            await self._link.mode("synthesis", [index])
        except BaseException:
            self._end(demand)
            raise
        self._traced = NO_TRACE
        self._turning = asyncio.create_task(self._swing(sinusoid, index, start, demand, begun_s))

    def _too_slow(self, sinusoid: Sinusoid) -> tuple[str, ...]:
        least = TURNING * self._section.rest_rate_deg_s / (AT_REST * POLL_S)
        if sinusoid.acceleration_deg_s2 >= least:
            return ()
        return (
            f"{sinusoid.axis} acceleration of {sinusoid.acceleration_deg_s2:.3g} deg/s^2 is below {least:.3g}: the "
            "turning points of so slow a sinusoid look like rest",
        )

    async def _swing(self, sinusoid: Sinusoid, index: int, start: list[float], demand: int, begun_s: float) -> None:
        """Trace an axis until its cycles are over, then brake it and lead it back to its start."""
        async with self._followed(index, demand):
            largest = readings = 0.0
            while self._clock.now_s() < begun_s + sinusoid.duration_s:
                self._require_current(demand)
                state = await self._reading(index)
                largest = max(largest, self._require_within(sinusoid, abs(state.position_deg - start[index])))
                readings += 1
                if readings % STATUS_EVERY == 0:
                    await self._link.require_closed()
                await self._clock.sleep(TRACE_S)
            self._require_current(demand)
            await self._stop_at_rate(index)
            await self._wait_for_rest(None, sinusoid.rate_deg_s / self._axes()[index].acceleration_deg_s2, demand)
            await self._lead(index, start[index], start, BACK_S, demand)
            if largest < LEAST * sinusoid.amplitude_deg:
                wanted = f"{sinusoid.amplitude_deg:g} deg"
                raise DeviceFault(f"the {sinusoid.axis} axis swung by {largest:.4g} deg where {wanted} were demanded")

    async def _reading(self, index: int) -> AxisState:
        """Read the axes, and keep the reading with the interval of its request."""
        asked_s = self._clock.now_s()
        states = await self._states()
        heard_s = self._clock.now_s()
        angles = np.array([[state.position_deg for state in states]])
        fresh = EncoderTrace(np.array([0.5 * (asked_s + heard_s)]), angles, np.array([0.5 * (heard_s - asked_s)]))
        self._traced = appended(self._traced, fresh)
        return states[index]

    def _require_within(self, sinusoid: Sinusoid, distance_deg: float) -> float:
        """Distance of the axis from its start. Raises `DeviceFault` where it is well beyond the amplitude."""
        if distance_deg > BEYOND * sinusoid.amplitude_deg + self._section.tolerance_deg:
            raise DeviceFault(
                f"the {sinusoid.axis} axis is {distance_deg:.4g} deg from where its sinusoid of "
                f"{sinusoid.amplitude_deg:g} deg began: the controller does not swing as this driver takes it to"
            )
        return distance_deg
