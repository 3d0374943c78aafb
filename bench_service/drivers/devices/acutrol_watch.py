"""Watching of an ACUTROL table by its encoders: states, rest, and one demand at a time, of which a newer one supersedes
an older.
"""

import asyncio
import logging
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager

from bench_service.drivers.devices.acutrol_link import AcutrolLink, AcutrolSection
from bench_service.drivers.devices.table_axes import AXES, TurnCount, declared, wrapped
from bench_service.drivers.interface.driver import DriverContext, narrowed
from bench_service.drivers.protocols.acutrol import AxisState
from procedures.bench.description import AxisLimits
from procedures.bench.errors import DeviceFault, Disconnected, NotSettled, OutOfRange, Stopped

POLL_S = 0.05
"""Time between two readings of a moving table [s]."""
TURNED_DEG = 1.0
"""Distance from a whole turn within which a reading shows that the controller counts turns [deg]."""
AT_REST = 3
"""Number of readings in a row that make rest."""
STATUS_EVERY = 20
"""Number of readings of a motion after which the interlocks are read again."""
STOPPED = "the table was stopped by another demand"

log = logging.getLogger(__name__)


class WatchedTable:
    """ACUTROL table whose state is what its encoders say; has no verb of `Turntable` yet, base of `SwingingTable`."""

    def __init__(self, section: AcutrolSection, context: DriverContext) -> None:
        self._section, self._clock = section, context.clock
        self._bench_id, self._note = context.bench_id, context.note
        self._link = AcutrolLink(section, context.note)
        self._counts = [
            TurnCount(section.encoder == "single_turn" and not getattr(section, name).continuous) for name in AXES
        ]
        self._demand = 0
        self._busy = False
        self._turning: asyncio.Task[None] | None = None
        self._can_brake = False
        """True while the limits of rate mode, by which the table is braked, are the declared ones."""

    def _axes(self) -> tuple[AxisLimits, AxisLimits, AxisLimits]:
        description = declared(narrowed(self._section, self._link.own))
        return description.outer, description.middle, description.inner

    def _under_way(self) -> bool:
        return self._busy or (self._turning is not None and not self._turning.done())

    def _begin(self) -> int:
        """Begin a demand. Raises `DeviceFault` while another is under way."""
        if self._under_way():
            raise DeviceFault("the table is moving: wait for the end of its motion")
        self._busy, self._turning = True, None
        self._demand += 1
        return self._demand

    def _require_current(self, demand: int) -> None:
        """Check before each statement that no later demand took over. Raises `Stopped`."""
        if demand != self._demand:
            raise Stopped(STOPPED)

    def _end(self, demand: int) -> None:
        if demand == self._demand:
            self._busy = False

    def _require_allowed(self, violations: tuple[str, ...]) -> None:
        if violations:
            raise OutOfRange("; ".join(violations))

    async def _require_ready(self) -> tuple[AxisState, ...]:
        """Read interlocks and states. Raises `DeviceFault` where an interlock is not closed or an axis moves."""
        await self._link.require_closed()
        states = await self._states()
        for name, state in zip(AXES, states, strict=True):
            if abs(state.rate_deg_s) > self._section.rest_rate_deg_s:
                raise DeviceFault(f"the table is moving: its {name} axis turns at {state.rate_deg_s:g} deg/s")
        return states

    async def _states(self) -> tuple[AxisState, ...]:
        """States of the axes with unwrapped positions."""
        states = await self._link.states()
        return tuple(
            AxisState(count.read(state.position_deg), state.rate_deg_s)
            for count, state in zip(self._counts, states, strict=True)
        )

    async def _wait_for_rest(self, end: list[float] | None, longest_s: float, demand: int) -> None:
        """Wait for readings in a row at rest, and at the end where one is given. Raises `NotSettled`, `DeviceFault`."""
        deadline = self._clock.now_s() + longest_s + self._section.settle_s
        resting = readings = 0
        while resting < AT_REST:
            await self._clock.sleep(POLL_S)
            self._require_current(demand)
            states, late = await self._states(), self._clock.now_s() > deadline
            resting = resting + 1 if self._at_rest(states, end) else 0
            readings += 1
            if late and resting == 0:
                await self._link.require_closed()
                away = "" if end is None else f", {self._away(states, end):g} deg from its demand"
                raise NotSettled(
                    f"the table did not come to rest within {self._section.settle_s:g} s of its move{away}"
                )
            if readings % STATUS_EVERY == 0:
                await self._link.require_closed()

    def _at_rest(self, states: tuple[AxisState, ...], end: list[float] | None) -> bool:
        still = all(abs(state.rate_deg_s) <= self._section.rest_rate_deg_s for state in states)
        return still and (end is None or self._away(states, end) <= self._section.tolerance_deg)

    def _away(self, states: tuple[AxisState, ...], end: list[float]) -> float:
        """Largest distance of an axis from its end; one with slip rings may read a turn more or less [deg]."""
        return max(
            abs(wrapped(state.position_deg - angle) if axis.continuous else state.position_deg - angle)
            for state, angle, axis in zip(states, end, self._axes(), strict=True)
        )

    async def _rests(self) -> bool:
        """True if some readings in a row show rest; false at the first that does not."""
        for _ in range(AT_REST):
            if not self._at_rest(await self._states(), None):
                return False
            await self._clock.sleep(POLL_S)
        return True

    async def _prepare_brake(self, demand: int) -> None:
        """Set the limits of rate mode before a motion, so that a stop needs two statements an axis."""
        if self._can_brake:
            return
        for index, axis in enumerate(self._axes()):
            self._require_current(demand)
            await self._link.limit("rate", index, axis.rate_deg_s, axis.acceleration_deg_s2)
        self._can_brake = True

    async def _stop_at_rate(self, index: int) -> None:
        """Take the rate away from an axis: two statements."""
        await self._link.demand("rate", index, 0.0)
        await self._link.mode("rate", [index])

    @asynccontextmanager
    async def _followed(self, index: int, demand: int) -> AsyncGenerator[None]:
        """Brake the axis where the block that follows its motion fails or is cancelled; end its demand in any case."""
        try:
            yield
        except BaseException as failure:
            await self._stop_unfollowed(index, demand, failure)
            raise
        finally:
            self._end(demand)

    async def _stop_unfollowed(self, index: int, demand: int, failure: BaseException) -> None:
        """Brake an axis that is not followed any more, unless another demand took over, which stops it by itself.

        Raises `Disconnected` or `DeviceFault` naming both failures where the axis cannot be braked either. After a
        cancel that is logged and written to the journal: whoever cancelled makes the table safe.
        """
        if demand != self._demand:
            return
        try:
            await asyncio.shield(self._stop_at_rate(index))
        except Exception as error:
            text = f"the {AXES[index]} axis could not be stopped: {error}"
            log.error("the turntable of bench %s: %s", self._bench_id, text)
            self._note("turntable.not_stopped", {"axis": AXES[index], "error": str(error)})
            if isinstance(failure, Exception) and not isinstance(failure, Stopped):
                kind = Disconnected if isinstance(error, Disconnected) else DeviceFault
                raise kind(f"{failure}; {text}") from error

    async def _lead(self, index: int, here_deg: float, ends: list[float], longest_s: float, demand: int) -> None:
        """Lead an axis, which reads `here_deg`, to its end, and wait until all axes rest at theirs."""
        axis = self._axes()[index]
        self._require_current(demand)
        await self._link.limit("position", index, axis.rate_deg_s, axis.acceleration_deg_s2)
        await self._link.demand("position", index, self._demanded(index, ends[index], here_deg))
        await self._link.mode("position", [index])
        await self._wait_for_rest(ends, longest_s, demand)

    def _demanded(self, index: int, angle_deg: float, here_deg: float) -> float:
        """Angle as the controller takes it, for an axis that reads `here_deg`: of one turn where its encoder is so.

        A controller that reads more than a turn counts turns, whatever is declared: the angle within one turn would
        make it turn all of them back.
        """
        within_one = self._counts[index].counts or getattr(self._section, AXES[index]).continuous
        counts_turns = not self._counts[index].counts and abs(here_deg) > 360.0 - TURNED_DEG
        return wrapped(angle_deg) if within_one and not counts_turns else angle_deg
