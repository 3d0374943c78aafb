"""Promises of the supply's port, for every implementation of it."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from procedures.bench import Supply
from procedures.bench.errors import DeviceBusy, DeviceFault, Disconnected, OutOfRange
from simulators.served.faults import Fault
from simulators.world import WorldConfig, build
from tests.conformance.served import SUPPLY_LIMITS, Served, cancelled_at, opened, served

READBACK_V = 0.021


@dataclass
class SupplyRig:
    """A supply and the simulated one behind it."""

    port: Supply
    behind: Any

    @property
    def served(self) -> Served | None:
        """The served bench; None in process."""
        return self.behind if isinstance(self.behind, Served) else None

    def do(self, call: Any) -> Any:
        """Call with the simulated supply."""
        return call(self.behind) if self.served is None else self.served.do(lambda bench: call(bench.bench.supply))

    def sets(self) -> list[str]:
        """Statements over the wire that change something."""
        return [] if self.served is None else [r for r in self.served.requests("supply") if "?" not in r]


@contextmanager
def supply(name: str, folder: Path, **section: Any) -> Iterator[SupplyRig]:
    """Open one implementation."""
    if name == "simulated":
        bench = build(WorldConfig())
        yield SupplyRig(bench.supply, bench.supply)
        return
    with served({"supply": "scpi"}) as behind:
        given = {"limits": SUPPLY_LIMITS, **section}
        device = opened("supply", "scpi", behind.numbers["supply"], folder, **given)
        try:
            yield SupplyRig(device, behind)
        finally:
            device.close()


@pytest.fixture(params=["simulated", "scpi"])
def rig(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[SupplyRig]:
    with supply(request.param, tmp_path) as made:
        yield made


@pytest.mark.parametrize(("voltage", "current"), [(36.1, 1.0), (-1.0, 1.0), (28.0, 5.1), (28.0, 0.0)])
def test_a_demand_beyond_a_limit_changes_nothing(rig: SupplyRig, voltage: float, current: float) -> None:
    async def scene() -> None:
        before = await rig.port.read()
        with pytest.raises(OutOfRange):
            await rig.port.set_output(voltage, current)
        after = await rig.port.read()
        assert (after.set_voltage_v, after.set_current_a) == (before.set_voltage_v, before.set_current_a)
        assert not rig.sets()

    asyncio.run(scene())


def test_switching_on_what_is_on_is_no_new_launch(rig: SupplyRig) -> None:
    async def scene() -> None:
        await rig.port.set_output(27.0, 2.0)
        await rig.port.switch_on()
        await rig.port.switch_on()
        assert rig.do(lambda s: s.launches) == 1
        reading = await rig.port.read()
        assert reading.on
        assert reading.voltage_v == pytest.approx(27.0, abs=READBACK_V)
        assert 0.0 < reading.current_a < 2.0
        assert (reading.set_voltage_v, reading.set_current_a) == pytest.approx((27.0, 2.0))
        await rig.port.make_safe()
        await rig.port.make_safe()
        assert not (await rig.port.read()).on
        await rig.port.switch_on()
        again = await rig.port.read()
        nominal = (rig.port.limits.nominal_v, rig.port.limits.nominal_a)
        assert (again.set_voltage_v, again.set_current_a) == pytest.approx(nominal), (
            "the 27 V were a job's that is over"
        )

    asyncio.run(scene())


def test_a_limit_of_the_current_is_seen(rig: SupplyRig) -> None:
    async def scene() -> None:
        await rig.port.set_output(28.0, 0.2)
        await rig.port.switch_on()
        reading = await rig.port.read()
        assert reading.limiting
        assert reading.current_a == pytest.approx(0.2, abs=0.01)
        assert reading.voltage_v < 20.0

    asyncio.run(scene())


def test_a_trip_is_kept_until_a_person_resets_it(rig: SupplyRig) -> None:
    async def scene() -> None:
        await rig.port.switch_on()
        rig.do(lambda s: s.trip())
        sets = rig.sets()
        for _ in range(2):
            with pytest.raises(DeviceFault, match="a person must reset it"):
                await rig.port.switch_on()
        reading = await rig.port.read()
        assert reading.tripped
        assert not reading.on
        assert rig.sets() == sets
        await rig.port.make_safe()

    asyncio.run(scene())


@pytest.mark.parametrize("at", [0, 1, 3, 5, 7, 9])
def test_cancelled_at_an_await_it_can_be_made_safe(rig: SupplyRig, at: int) -> None:
    async def scene() -> None:
        raised = await cancelled_at(rig.port.switch_on(), at)
        assert raised is None or isinstance(raised, asyncio.CancelledError)
        await rig.port.make_safe()
        assert not (await rig.port.read()).on
        await rig.port.switch_on()
        assert (await rig.port.read()).on

    asyncio.run(scene())


def test_every_set_is_followed_by_its_error(tmp_path: Path) -> None:
    with supply("scpi", tmp_path) as rig:
        asyncio.run(rig.port.switch_on())
        assert rig.served is not None
        asked = rig.served.requests("supply")
        places = [k for k, request in enumerate(asked) if "?" not in request]
        assert [asked[k].split()[0] for k in places] == ["CURR", "VOLT", "OUTP"]
        assert all(asked[k + 1] == "SYST:ERR?" for k in places)


def test_a_device_with_narrower_limits_refuses_in_its_own_words(tmp_path: Path) -> None:
    async def scene(rig: SupplyRig) -> None:
        with pytest.raises(DeviceFault, match=r"refuses a voltage of 50 V: Data out of range \(error -222\)"):
            await rig.port.set_output(50.0, 1.0)

    wide = {**SUPPLY_LIMITS, "maximum_v": 60.0}
    with supply("scpi", tmp_path, limits=wide) as rig:
        asyncio.run(scene(rig))


ANSWERS = [(kind, at) for kind in ("slow", "half", "doubled", "cut", "cut_after", "silent") for at in (2, 5)]


@pytest.mark.parametrize(("kind", "at"), ANSWERS)
def test_no_set_goes_out_twice(tmp_path: Path, kind: str, at: int) -> None:
    async def scene(rig: SupplyRig) -> None:
        await rig.port.read()
        assert rig.served is not None
        rig.served.plan(Fault("supply", kind, at=at, seconds=0.7))
        found = await asyncio.gather(rig.port.switch_on(), return_exceptions=True)
        assert found == [None] or isinstance(found[0], Disconnected), found
        sets = rig.sets()
        assert len(sets) == len(set(sets)), f"a set went out twice: {sets}"
        rig.served.plan()
        if found == [None]:
            assert (await rig.port.read()).on
        await rig.port.make_safe()
        assert not (await rig.port.read()).on
        assert rig.do(lambda s: s.launches) <= 1

    with supply("scpi", tmp_path, answer_s=0.4) as rig:
        asyncio.run(scene(rig))


def test_one_that_takes_the_line_and_is_silent_is_busy(tmp_path: Path) -> None:
    async def scene() -> None:
        async def silent(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            while await reader.read(64):
                continue
            writer.close()

        server = await asyncio.start_server(silent, "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        device = opened("supply", "scpi", port, tmp_path, limits=SUPPLY_LIMITS, answer_s=0.2)
        with pytest.raises(DeviceBusy, match="another master may hold it"):
            await device.read()
        device.close()
        server.close()
        await asyncio.sleep(0.1)

    asyncio.run(scene())
