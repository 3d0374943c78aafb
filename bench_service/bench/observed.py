"""A bench that reports each verb's begin and end to an observer: the devices' register, or the watchdog.

The bench's caller notices nothing. This module knows no device.
"""

from collections.abc import AsyncGenerator, AsyncIterator, Generator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from bench_service.bench.together import make_safe_together
from procedures.bench import SAFE_ORDER, Bench, Chamber, Environment, Imu, Operator, Supply, Turntable
from procedures.bench.chamber import ChamberLimits, ChamberReading
from procedures.bench.current_source import CurrentSource, CurrentSourceLimits, CurrentSourceReading
from procedures.bench.device import DeviceIdentity, Status
from procedures.bench.environment import EnvironmentReading
from procedures.bench.imu import Stream
from procedures.bench.supply import SupplyLimits, SupplyReading
from procedures.bench.turntable import TableReading
from procedures.core.constant_rate import ConstantRate
from procedures.core.recording import Channel, Station
from procedures.core.sinusoid import Sinusoid
from procedures.core.table_angles import TableAngles
from procedures.core.turn import Turn


class Observer(Protocol):
    """Receives the begin and end of every verb of a device, as "device.verb". Interface: device register, watchdog."""

    def begin(self, verb: str, arguments: Mapping[str, Any]) -> None:
        """Note a verb, before the device is asked; where this raises, the verb ends with that failure instead."""
        ...

    def end(self, verb: str, failure: BaseException | None) -> None:
        """Note the end of a verb, after the device answered; `failure`: its error, None where it succeeded."""
        ...

    def asked(self, device: str) -> None:
        """Note that the next block of a recording is wanted."""
        ...

    def heard(self, device: str) -> None:
        """Note that the wanted block has come, or the recording has ended."""
        ...


class _Seen:
    def __init__(self, observer: Observer) -> None:
        self._observer = observer

    @contextmanager
    def _seen(self, verb: str, **arguments: Any) -> Generator[None]:
        try:
            self._observer.begin(verb, arguments)
            yield
        except BaseException as failure:
            self._observer.end(verb, failure)
            raise
        self._observer.end(verb, None)


class ObservedTurntable(_Seen):
    """A `Turntable` that reports its verbs to an observer."""

    def __init__(self, table: Turntable, observer: Observer) -> None:
        super().__init__(observer)
        self._table, self.trace = table, table.trace  # it takes what was read: no verb to observe

    async def move_to(self, angles: TableAngles) -> None:
        with self._seen("turntable.move_to", angles_deg=[angles.outer_deg, angles.middle_deg, angles.inner_deg]):
            await self._table.move_to(angles)

    async def identify(self) -> DeviceIdentity:
        with self._seen("turntable.identify"):
            return await self._table.identify()

    async def command_turn(self, turn: Turn) -> None:
        with self._seen("turntable.command_turn", axis=turn.axis, turns=turn.turns, rate_deg_s=turn.rate_deg_s):
            await self._table.command_turn(turn)

    async def settle(self) -> None:
        with self._seen("turntable.settle"):
            await self._table.settle()

    async def command_rate(self, rate: ConstantRate) -> None:
        with self._seen("turntable.command_rate", **vars(rate)):
            await self._table.command_rate(rate)

    async def command_sinusoid(self, sinusoid: Sinusoid) -> None:
        with self._seen("turntable.command_sinusoid", **vars(sinusoid)):
            await self._table.command_sinusoid(sinusoid)

    async def read(self) -> TableReading:
        with self._seen("turntable.read"):
            return await self._table.read()

    async def make_safe(self) -> None:
        with self._seen("turntable.make_safe"):
            await self._table.make_safe()


class ObservedSupply(_Seen):
    """A `Supply` that reports its verbs to an observer."""

    def __init__(self, supply: Supply, observer: Observer) -> None:
        super().__init__(observer)
        self._supply = supply

    @property
    def limits(self) -> SupplyLimits:
        return self._supply.limits

    async def identify(self) -> DeviceIdentity:
        with self._seen("supply.identify"):
            return await self._supply.identify()

    async def set_output(self, voltage_v: float, current_a: float) -> None:
        with self._seen("supply.set_output", voltage_v=voltage_v, current_a=current_a):
            await self._supply.set_output(voltage_v, current_a)

    async def switch_on(self) -> None:
        with self._seen("supply.switch_on"):
            await self._supply.switch_on()

    async def switch_off(self) -> None:
        with self._seen("supply.switch_off"):
            await self._supply.switch_off()

    async def read(self) -> SupplyReading:
        with self._seen("supply.read"):
            return await self._supply.read()

    async def make_safe(self) -> None:
        with self._seen("supply.make_safe"):
            await self._supply.make_safe()


class ObservedChamber(_Seen):
    """A `Chamber` that reports its verbs to an observer."""

    def __init__(self, chamber: Chamber, observer: Observer) -> None:
        super().__init__(observer)
        self._chamber = chamber

    @property
    def limits(self) -> ChamberLimits:
        return self._chamber.limits

    async def identify(self) -> DeviceIdentity:
        with self._seen("chamber.identify"):
            return await self._chamber.identify()

    async def command(self, temperature_c: float, ramp_c_min: float) -> None:
        with self._seen("chamber.command", temperature_c=temperature_c, ramp_c_min=ramp_c_min):
            await self._chamber.command(temperature_c, ramp_c_min)

    async def read(self) -> ChamberReading:
        with self._seen("chamber.read"):
            return await self._chamber.read()

    async def make_safe(self) -> None:
        with self._seen("chamber.make_safe"):
            await self._chamber.make_safe()


class ObservedCurrentSource(_Seen):
    """A `CurrentSource` that reports its verbs to an observer."""

    def __init__(self, source: CurrentSource, observer: Observer) -> None:
        super().__init__(observer)
        self._source = source

    @property
    def limits(self) -> CurrentSourceLimits:
        return self._source.limits

    async def identify(self) -> DeviceIdentity:
        with self._seen("current_source.identify"):
            return await self._source.identify()

    async def read(self) -> CurrentSourceReading:
        with self._seen("current_source.read"):
            return await self._source.read()

    async def set_current(self, current_ma: float) -> None:
        with self._seen("current_source.set_current", current_ma=current_ma):
            await self._source.set_current(current_ma)

    async def make_safe(self) -> None:
        with self._seen("current_source.make_safe"):
            await self._source.make_safe()


class ObservedEnvironment(_Seen):
    """An `Environment` that reports its verbs to an observer."""

    def __init__(self, environment: Environment, observer: Observer) -> None:
        super().__init__(observer)
        self._environment = environment

    async def identify(self) -> DeviceIdentity:
        with self._seen("environment.identify"):
            return await self._environment.identify()

    async def read(self) -> EnvironmentReading:
        with self._seen("environment.read"):
            return await self._environment.read()


class ObservedOperator(_Seen):
    """An `Operator` that reports its requests to an observer."""

    def __init__(self, operator: Operator, observer: Observer) -> None:
        super().__init__(observer)
        self._operator = operator

    async def set_by_hand(self, angles: TableAngles, request: str) -> None:
        with self._seen("operator.set_by_hand", request=request):
            await self._operator.set_by_hand(angles, request)


class ObservedImu(_Seen):
    """An `Imu` that reports its verbs and blocks to an observer."""

    def __init__(self, imu: Imu, observer: Observer) -> None:
        super().__init__(observer)
        self._imu = imu

    @property
    def channels(self) -> tuple[Channel, ...]:
        return self._imu.channels

    @property
    def rate_hz(self) -> float:
        return self._imu.rate_hz

    async def identify(self) -> DeviceIdentity:
        with self._seen("imu.identify"):
            return await self._imu.identify()

    def status(self) -> Status:
        return self._imu.status()

    def record(self, duration_s: float, station: Station | None = None) -> Stream:
        with self._seen("imu.record", duration_s=duration_s, station=None if station is None else station.index):
            stream = self._imu.record(duration_s, station)
        return replace(stream, blocks=self._blocks(stream.blocks))

    async def _blocks(self, blocks: AsyncIterator[NDArray[np.int32]]) -> AsyncIterator[NDArray[np.int32]]:
        with self._seen("imu.stream"):
            try:
                while True:
                    self._observer.asked("imu")
                    try:
                        block = await anext(blocks)
                    except StopAsyncIteration:
                        return
                    finally:
                        self._observer.heard("imu")
                    yield block
            finally:
                if isinstance(blocks, AsyncGenerator):
                    await blocks.aclose()


class ObservedBench(Bench):
    """A bench whose devices report each verb to an observer; everything else is the wrapped bench's own."""

    def __init__(self, bench: Bench, observer: Observer) -> None:
        super().__init__(
            bench.description,
            bench.clock,
            ObservedTurntable(bench.turntable, observer),
            ObservedImu(bench.imu, observer),
            ObservedSupply(bench.supply, observer),
            None if bench.chamber is None else ObservedChamber(bench.chamber, observer),
            None if bench.operator is None else ObservedOperator(bench.operator, observer),
            None if bench.current_source is None else ObservedCurrentSource(bench.current_source, observer),
            None if bench.environment is None else ObservedEnvironment(bench.environment, observer),
            bench.safe_s,
        )
        self.inner = bench

    async def make_safe(self) -> None:
        """Make the devices safe as `Bench.make_safe` does: at the same time where they have deadlines of their own."""
        if self.safe_s:
            await make_safe_together({d: t for d in SAFE_ORDER if (t := getattr(self, d)) is not None}, self.safe_s)
        else:
            await super().make_safe()

    def checkpoint(self) -> dict[str, Any] | None:
        return self.inner.checkpoint()

    def close(self) -> None:
        self.inner.close()
