"""Promises of the chamber's port, for every implementation of it."""

import asyncio
from pathlib import Path

import pytest

from procedures.bench.errors import DeviceBusy, DeviceFault, Disconnected, OutOfRange
from simulators.served.faults import Fault
from tests.conformance.chambers import ALARM, DOOR, IMPLEMENTATIONS, RUNNING, ChamberRig, chamber
from tests.conformance.served import CHAMBER_LIMITS, cancelled_at, opened

WIRES = ("simserv", "ascii2")
RESOLUTION_C = 0.051
"""Half a step of ASCII-2, whose fields have one decimal."""


@pytest.fixture(params=IMPLEMENTATIONS)
def rig(request: pytest.FixtureRequest, tmp_path: Path):
    with chamber(request.param, tmp_path) as made:
        yield made


@pytest.mark.parametrize(("temperature", "ramp"), [(-61, 1), (101, 1), (float("nan"), 1), (20, 0), (20, 5.1)])
def test_a_demand_beyond_a_limit_changes_nothing(rig: ChamberRig, temperature: float, ramp: float) -> None:
    async def scene() -> None:
        with pytest.raises(OutOfRange):
            await rig.port.command(temperature, ramp)
        assert (await rig.port.read()).target_c is None
        assert not rig.sets()

    asyncio.run(scene())


def test_it_goes_where_it_is_asked_and_made_safe_goes_to_ambient(rig: ChamberRig) -> None:
    async def scene() -> None:
        await rig.port.command(40.3, 2.0)
        await rig.port.command(40.3, 2.0)
        reading = await rig.port.read()
        assert reading.target_c == pytest.approx(40.3, abs=RESOLUTION_C)
        assert not reading.door_open
        assert not reading.tripped
        await rig.port.make_safe()
        await rig.port.make_safe()
        assert (await rig.port.read()).target_c == pytest.approx(22.0, abs=RESOLUTION_C)

    asyncio.run(scene())


def test_a_ramp_is_kept(tmp_path: Path) -> None:
    async def scene(rig: ChamberRig) -> None:
        first = (await rig.port.read()).air_c
        await rig.port.command(40.0, 1.0)
        begun = rig.clock.now_s()
        await rig.clock.sleep(300.0)
        passed = rig.clock.now_s() - begun
        air = (await rig.port.read()).air_c
        # At 1 K/min the set point moves by passed/60; the air follows it to within a degree, and never leads by more.
        assert first + 1.0 < air < first + passed / 60.0 + 1.0

    for name in ("simulated", "simserv"):
        with chamber(name, tmp_path, factor=400.0) as rig:
            asyncio.run(scene(rig))


def test_one_that_stands_still_is_not_started_by_make_safe(rig: ChamberRig) -> None:
    async def scene() -> None:
        await rig.port.make_safe()
        assert (await rig.port.read()).target_c is None
        assert not rig.sets()

    asyncio.run(scene())


@pytest.mark.parametrize("name", ["simulated", *WIRES])
def test_a_trip_is_kept_and_an_open_door_refuses(tmp_path: Path, name: str) -> None:
    async def scene(rig: ChamberRig) -> None:
        rig.do(lambda c: c.set_door(True))
        with pytest.raises(DeviceFault, match="door is open"):
            await rig.port.command(40.0, 2.0)
        rig.do(lambda c: c.set_door(False))
        rig.do(lambda c: setattr(c.plant.state, "tripped", True))
        for _ in range(2):
            with pytest.raises(DeviceFault, match="a person must reset it"):
                await rig.port.command(40.0, 2.0)
        reading = await rig.port.read()
        assert reading.tripped
        assert reading.target_c is None
        await rig.port.make_safe()
        assert not rig.sets()

    with chamber(name, tmp_path) as rig:
        asyncio.run(scene(rig))


@pytest.mark.parametrize(("bits", "words"), [(DOOR, "door is open"), (RUNNING | ALARM, "a person must reset it")])
def test_the_bits_of_a_map_are_heeded(tmp_path: Path, bits: int, words: str) -> None:
    async def scene(rig: ChamberRig) -> None:
        with pytest.raises(DeviceFault, match=words):
            await rig.port.command(40.0, 2.0)

    with chamber("modbus", tmp_path, bits) as rig:
        asyncio.run(scene(rig))


@pytest.mark.parametrize(("policy", "target"), [("ambient", 22.0), ("hold", 40.0), ("off", None)])
@pytest.mark.parametrize("name", ["simserv", "ascii2", "modbus"])
def test_made_safe_as_the_section_says(tmp_path: Path, name: str, policy: str, target: float | None) -> None:
    async def scene(rig: ChamberRig) -> None:
        await rig.port.command(40.0, 2.0)
        await rig.port.make_safe()
        found = (await rig.port.read()).target_c
        assert found == (None if target is None else pytest.approx(target, abs=RESOLUTION_C))

    with chamber(name, tmp_path, on_safe=policy) as rig:
        asyncio.run(scene(rig))


@pytest.mark.parametrize("at", [0, 2, 5, 8, 12])
def test_cancelled_at_an_await_it_can_be_made_safe(rig: ChamberRig, at: int) -> None:
    async def scene() -> None:
        raised = await cancelled_at(rig.port.command(40.0, 2.0), at)
        assert raised is None or isinstance(raised, asyncio.CancelledError)
        await rig.port.make_safe()
        target = (await rig.port.read()).target_c
        assert target is None or target == pytest.approx(22.0, abs=RESOLUTION_C)

    asyncio.run(scene())


ANSWERS = [(kind, at) for kind in ("slow", "half", "doubled", "cut", "cut_after", "silent") for at in (4, 6)]


@pytest.mark.parametrize(("kind", "at"), ANSWERS)
@pytest.mark.parametrize("name", WIRES)
def test_no_set_goes_out_twice_and_no_answer_is_taken_for_another(
    tmp_path: Path, name: str, kind: str, at: int
) -> None:
    async def scene(rig: ChamberRig) -> None:
        await rig.port.read()
        rig.behind.plan(Fault("chamber", kind, at=at, seconds=0.7))
        found = await asyncio.gather(rig.port.command(40.0, 2.0), return_exceptions=True)
        assert found == [None] or isinstance(found[0], Disconnected), found
        sets = rig.sets()
        assert len(sets) == len(set(sets)), f"a set went out twice: {sets}"
        rig.behind.plan()
        reading = await rig.port.read()
        if found == [None]:
            assert reading.target_c == pytest.approx(40.0, abs=RESOLUTION_C)
        assert reading.air_c == pytest.approx(22.0, abs=1.5)
        await rig.port.make_safe()

    with chamber(name, tmp_path, answer_s=0.4) as rig:
        asyncio.run(scene(rig))


def test_an_answer_that_is_late_is_never_taken_for_the_next_question(tmp_path: Path) -> None:
    """Every seventh answer comes late by more than the time-out: no reading holds another request's number."""

    async def scene(rig: ChamberRig) -> None:
        await rig.port.command(60.0, 3.0)
        rig.behind.plan(Fault("chamber", "slow", every=7, seconds=0.7))
        for _ in range(4):
            found = await asyncio.gather(rig.port.read(), return_exceptions=True)
            if isinstance(found[0], BaseException):
                assert isinstance(found[0], Disconnected | DeviceBusy)
            else:
                assert found[0].target_c == 60.0
                assert found[0].air_c < 50.0

    with chamber("simserv", tmp_path, answer_s=0.4) as rig:
        asyncio.run(scene(rig))


def test_the_banner_of_another_port_is_named(tmp_path: Path) -> None:
    async def scene() -> None:
        async def banner(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            await reader.read(64)
            writer.write(b"100 OK: CoDeSys\r\n")
            await writer.drain()
            writer.close()

        server = await asyncio.start_server(banner, "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        device = opened("chamber", "simserv", port, tmp_path, limits=CHAMBER_LIMITS)
        with pytest.raises(DeviceBusy, match="the banner of another port"):
            await device.read()
        device.close()
        server.close()

    asyncio.run(scene())
