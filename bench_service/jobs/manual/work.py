"""Execution of manual demands on an open bench: the commands of each kind, and the sentence that answers it."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

from bench_service.jobs.manual.demands import angles, constant_rate
from bench_service.jobs.manual.sensors import UnitReadings
from bench_service.model.manual import DemandKind, ManualDemand
from procedures.bench import Bench
from procedures.core.errors import BadParameter

TICK_S = 0.1
"""Time that passes between two looks at a lease or a rate, of bench and real time alike [s]."""


class DemandWork:
    """Carries out demands of manual mode on the devices of an open bench; their order, refusals and end belong to
    `ManualSession`.
    """

    def __init__(self, bench: Bench, sensors: UnitReadings, leave_motion: Callable[[], Awaitable[None]]) -> None:
        """Set up with `leave_motion`, which a halt calls first: it leaves the motion under way, if there is one."""
        self._bench, self._sensors = bench, sensors
        self._leave_motion = leave_motion
        self._order = asyncio.Lock()
        """Held by a demand on chamber or supply: two at once would mix their statements."""

    async def do(self, demand: ManualDemand) -> str:
        """Carry out a demand, wait until the devices have done it, and return the sentence for its answer. Raises
        `BadParameter` and the devices' `BenchError`.
        """
        return await self._KINDS[demand.kind](self, demand.values)

    async def time_passes(self, seconds: float) -> None:
        """Let bench time pass [s]; with a unit that has power, while its samples are read."""
        if not await self._sensors.read(seconds):
            await self._bench.clock.sleep(seconds)

    async def _move(self, values: dict[str, Any]) -> str:
        table = self._bench.turntable
        await table.move_to(angles(values, (await table.read()).angles))
        at = (await table.read()).angles
        shown = (round(angle, 4) + 0.0 for angle in (at.outer_deg, at.middle_deg, at.inner_deg))  # no -0.0000
        return f"at rest at {', '.join(f'{angle:.4f}' for angle in shown)} deg"

    async def _rate(self, values: dict[str, Any]) -> str:
        table, clock = self._bench.turntable, self._bench.clock
        rate = constant_rate(values, (await table.read()).angles, self._bench.description)
        await table.command_rate(rate)
        until_s = clock.now_s() + rate.duration_s
        while (left_s := until_s - clock.now_s()) > 0.0:
            await self.time_passes(min(TICK_S, left_s))
        await table.settle()
        return f"{rate.rate_deg_s:g} deg/s of the {rate.axis} axis is over, the table rests"

    async def _halt(self, values: dict[str, Any]) -> str:
        await self._leave_motion()
        await self._bench.turntable.make_safe()
        return "the table rests"

    async def _chamber(self, values: dict[str, Any]) -> str:
        async with self._order:
            chamber = self._bench.chamber
            if chamber is None:
                raise BadParameter("kind", "chamber", "another demand: the bench was opened without its chamber")
            await chamber.command(values["temperature_c"], values["ramp_c_min"])
            return f"commanded to {values['temperature_c']:g} °C at {values['ramp_c_min']:g} K/min"

    async def _supply_on(self, values: dict[str, Any]) -> str:
        async with self._order:
            supply = self._bench.supply
            if values["voltage_v"] is not None:
                await supply.set_output(values["voltage_v"], values["current_a"])
            await supply.switch_on()
            self._sensors.powered(True)
            reading = await supply.read()
            return f"on: {reading.voltage_v:.3f} V, {reading.current_a:.3f} A"

    async def _supply_off(self, values: dict[str, Any]) -> str:
        async with self._order:
            self._sensors.powered(False)
            await self._bench.supply.switch_off()
            return "off"

    _KINDS: dict[DemandKind, Callable[["DemandWork", dict[str, Any]], Awaitable[str]]] = {  # noqa: RUF012  never changed
        "home": _move,
        "go_to": _move,
        "rate": _rate,
        "halt": _halt,
        "chamber": _chamber,
        "supply_on": _supply_on,
        "supply_off": _supply_off,
    }
