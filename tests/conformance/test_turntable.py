"""Promises of the turntable's port, for every implementation of it."""

import asyncio
from collections.abc import Sequence
from math import nan
from pathlib import Path
from typing import Any

import pytest

from bench_service.drivers.devices.table_axes import TurnProgress
from bench_service.drivers.protocols.acutrol import Mode
from procedures.bench.errors import BenchError, DeviceBusy, DeviceFault, Disconnected, OutOfRange, Stopped
from procedures.core.table_angles import TableAngles
from procedures.core.turn import Turn
from simulators.served.faults import Fault
from tests.conformance.served import axis, cancelled_at
from tests.conformance.tables import IMPLEMENTATIONS, TableRig, acutrol, table

POINTING_DEG = 6.0 / 3600.0
"""Encoder at rest against the demand: the drivers' tolerance of 0.001 deg, and rounding to 1e-5 deg."""


@pytest.fixture(params=IMPLEMENTATIONS)
def rig(request: pytest.FixtureRequest, tmp_path: Path):
    with table(request.param, tmp_path) as made:
        yield made


def _angles(reading) -> tuple[float, float, float]:
    return reading.angles.outer_deg, reading.angles.middle_deg, reading.angles.inner_deg


@pytest.mark.parametrize("angles", [TableAngles(0, 191, 0), TableAngles(-361, 0, 0), TableAngles(0, 0, nan)])
def test_a_demand_beyond_a_limit_moves_nothing(rig: TableRig, angles: TableAngles) -> None:
    async def scene() -> None:
        with pytest.raises(OutOfRange, match="is outside"):
            await rig.port.move_to(angles)
        reading = await rig.port.read()
        assert not reading.moving
        assert _angles(reading) == pytest.approx((0.0, 0.0, 0.0), abs=POINTING_DEG)
        assert not rig.demands()

    asyncio.run(scene())


def test_demands_are_absolute_and_end_at_rest(rig: TableRig) -> None:
    async def scene() -> None:
        for demand in (TableAngles(10, -20, 30), TableAngles(10, -20, 30), TableAngles(-5, 0, 3)):
            await rig.port.move_to(demand)
            assert max(abs(rate) for rate in rig.rates_deg_s()) < 1e-3
            reading = await rig.port.read()
            assert not reading.moving
            wanted = (demand.outer_deg, demand.middle_deg, demand.inner_deg)
            assert _angles(reading) == pytest.approx(wanted, abs=POINTING_DEG)

    asyncio.run(scene())


def test_whole_turns_end_where_they_began(rig: TableRig) -> None:
    async def scene() -> None:
        await rig.port.move_to(TableAngles(20, 0, 0))
        turn = Turn("outer", -2, 50.0, 1.0)
        begun = rig.clock.now_s()
        await rig.port.command_turn(turn)
        with pytest.raises(DeviceFault, match="the table is moving"):
            await rig.port.move_to(TableAngles())
        await rig.port.settle()
        # From rest to rest the turn lasts turn.duration_s; a table that stopped short would be back sooner.
        assert rig.clock.now_s() - begun > 0.9 * turn.duration_s
        assert _angles(await rig.port.read())[0] == pytest.approx(20.0, abs=POINTING_DEG)
        await rig.port.settle()

    asyncio.run(scene())


def test_a_fault_is_kept_until_a_person_resets_it(rig: TableRig) -> None:
    async def scene() -> None:
        await rig.port.read()
        rig.break_it()
        for _ in range(2):
            with pytest.raises(DeviceFault):
                await rig.port.move_to(TableAngles(5, 0, 0))
        if rig.served is not None:
            asked = rig.served.requests("turntable")
            assert not [r for r in asked if "interlock:" in r], "no driver resets or closes an interlock"
            assert not rig.demands()

    asyncio.run(scene())


def test_make_safe_in_mid_move_ramps_down_and_holds(rig: TableRig) -> None:
    async def scene() -> None:
        move = asyncio.create_task(rig.port.move_to(TableAngles(150, 0, 0)))
        while abs(rig.rates_deg_s()[0]) < 30.0:
            await asyncio.sleep(0)
        await rig.port.make_safe()
        await asyncio.wait([move])
        assert isinstance(move.exception(), Stopped)
        reading = await rig.port.read()
        assert not reading.moving
        assert max(abs(rate) for rate in rig.rates_deg_s()) < 1e-3
        assert 1.0 < _angles(reading)[0] < 149.0
        before = rig.demands()
        await rig.port.make_safe()
        assert rig.demands() == before, "a table at rest gets no command"
        await rig.port.move_to(TableAngles(0, 0, 0))

    asyncio.run(scene())


def test_make_safe_stops_turns_and_their_settle(rig: TableRig) -> None:
    async def scene() -> None:
        await rig.port.command_turn(Turn("inner", 1, 40.0, 1.0))
        settling = asyncio.create_task(rig.port.settle())
        while abs(rig.rates_deg_s()[2]) < 20.0:
            await rig.clock.sleep(0.05)
        await rig.port.make_safe()
        await asyncio.wait([settling])
        assert isinstance(settling.exception(), Stopped)
        assert not (await rig.port.read()).moving

    asyncio.run(scene())


@pytest.mark.parametrize("at", [0, 1, 2, 5, 9, 14, 20, 26, 33])
def test_cancelled_at_an_await_it_can_be_made_safe(rig: TableRig, at: int) -> None:
    async def scene() -> None:
        raised = await cancelled_at(rig.port.move_to(TableAngles(40, 10, 0)), at)
        assert raised is None or isinstance(raised, asyncio.CancelledError)
        await rig.port.make_safe()
        assert not (await rig.port.read()).moving
        await rig.port.move_to(TableAngles(1, 0, 0))
        assert _angles(await rig.port.read())[0] == pytest.approx(1.0, abs=POINTING_DEG)

    asyncio.run(scene())


ANSWERS = [(kind, at) for kind in ("slow", "half", "doubled", "cut", "cut_after", "silent") for at in (9, 16)]
"""Faults at the read-back of a limit and at a demand; `make validate` has every place."""


@pytest.mark.parametrize(("kind", "at"), ANSWERS)
def test_no_demand_goes_out_twice_and_no_answer_is_taken_for_another(tmp_path: Path, kind: str, at: int) -> None:
    async def scene(rig: TableRig) -> None:
        assert rig.served is not None
        await rig.port.read()
        rig.served.plan(Fault("turntable", kind, at=at, seconds=0.7))
        before = len(rig.demands() or [])
        moved = await asyncio.gather(rig.port.move_to(TableAngles(3, 4, 5)), return_exceptions=True)
        if moved == [None]:
            assert _angles(await rig.port.read()) == pytest.approx((3.0, 4.0, 5.0), abs=POINTING_DEG)
        else:
            assert isinstance(moved[0], Disconnected), moved
            assert "the turntable at tcp://127.0.0.1" in str(moved[0])
        sent = (rig.demands() or [])[before:]
        assert len(sent) == len(set(sent)), f"a demand went out twice: {sent}"
        rig.served.plan()
        await rig.port.make_safe()
        await rig.port.move_to(TableAngles(1, 2, 3))
        assert _angles(await rig.port.read()) == pytest.approx((1.0, 2.0, 3.0), abs=POINTING_DEG)

    with table("acutrol", tmp_path, answer_s=0.4) as rig:
        asyncio.run(scene(rig))


def test_a_second_master_is_refused(tmp_path: Path) -> None:
    async def scene(rig: TableRig) -> None:
        await rig.port.read()
        other = acutrol(rig.behind, tmp_path)
        try:
            with pytest.raises(DeviceBusy, match="another master may hold it"):
                await other.read()
        finally:
            other.close()
        await rig.port.read()

    with table("acutrol", tmp_path) as rig:
        asyncio.run(scene(rig))


@pytest.mark.parametrize("prefix", [0, 4])
def test_a_wrong_length_of_the_prefix_is_named(tmp_path: Path, prefix: int) -> None:
    async def scene(rig: TableRig) -> None:
        with pytest.raises(BenchError, match=r"reply_prefix_bytes|speaks another dialect"):
            await rig.port.move_to(TableAngles(1, 0, 0))
        assert not rig.demands()

    with table("acutrol", tmp_path, reply_prefix_bytes=prefix) as rig:
        asyncio.run(scene(rig))


def test_the_narrower_limit_holds_and_is_found_at_the_device(tmp_path: Path) -> None:
    async def scene(rig: TableRig) -> None:
        found = await rig.port.connect()  # type: ignore[attr-defined]
        assert {bound.field: bound.value for bound in found.limits}["middle.maximum_deg"] == 190.0
        with pytest.raises(OutOfRange, match="190"):
            await rig.port.move_to(TableAngles(0, 200, 0))
        assert not rig.demands()

    wide = {"number": 2, "minimum_deg": -300.0, "maximum_deg": 300.0, "rate_deg_s": 90.0, "acceleration_deg_s2": 90.0}
    with table("acutrol", tmp_path, middle=wide) as rig:
        asyncio.run(scene(rig))


@pytest.mark.parametrize("pause_s", [0.01, 2.9, 7.3, 31.0])
def test_turns_are_counted_over_pauses_of_their_readings(pause_s: float) -> None:
    """A rate of 50 deg/s read seldom, by a clock that is 1 % wrong: 31 s are 4.3 turns, and 15 deg of error."""
    progress, now = TurnProgress(170.0, -50.0, 100.0), 0.0
    for _ in range(5):
        now += pause_s
        encoder = (170.0 - 50.0 * now + 180.0) % 360.0 - 180.0
        assert progress.read(encoder, 100.0 + 1.01 * now) == pytest.approx(-50.0 * now, abs=1e-9)


def test_an_encoder_of_one_turn_is_counted_where_there_are_no_slip_rings(tmp_path: Path) -> None:
    """The inner axis goes to 320 deg and back: its count is kept, and no step is longer than 120 deg."""

    async def scene(rig: TableRig) -> None:
        await rig.port.move_to(TableAngles(0, 0, 320))
        assert _angles(await rig.port.read())[2] == pytest.approx(320.0, abs=POINTING_DEG)
        demanded = [float(r.split(",")[1]) for r in rig.demands() or [] if r.startswith(":demand:position 3")]
        assert demanded == pytest.approx([106.66667, 213.33333 - 360.0, 320.0 - 360.0], abs=1e-4)

    with table("acutrol", tmp_path, encoder="single_turn") as rig:
        assert rig.served is not None
        rig.served.do(_read_within_one_turn)
        asyncio.run(scene(rig))


def _read_within_one_turn(bench) -> None:
    """Have the served inner axis read, and be asked, within half a turn: the nearest turn is meant."""
    table, load = bench.table, bench.table.load
    read = table.true_encoders_deg

    def within() -> list[float]:
        return [a - 360.0 * round(a / 360.0) for a in read()]

    def nearest(kind: str, axis: int, value: float) -> None:
        here = read()[axis]
        load(kind, axis, value + 360.0 * round((here - value) / 360.0) if kind == "position" else value)
        if kind == "position":
            table.axes[axis].position_deg = value

    table.encoders_deg, table.load = within, nearest


def test_made_safe_with_the_servo_off_where_the_section_says_so(tmp_path: Path) -> None:
    async def scene(rig: TableRig) -> None:
        assert rig.served is not None
        move = asyncio.create_task(rig.port.move_to(TableAngles(100, 0, 0)))
        while abs(rig.rates_deg_s()[0]) < 30.0:
            await asyncio.sleep(0)
        await rig.port.make_safe()
        await asyncio.wait([move])
        assert rig.served.do(lambda bench: [axis.mode for axis in bench.table.axes]) == ["off", "off", "off"]
        assert not (await rig.port.read()).moving
        await rig.port.move_to(TableAngles(0, 0, 0))

    with table("acutrol", tmp_path, on_safe="off") as rig:
        asyncio.run(scene(rig))


def test_an_interlock_that_opens_between_the_axes_of_a_move_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The controller refuses the mode of the next axis in its own words; which interlock it was is read then."""
    with table("acutrol", tmp_path) as rig:
        port: Any = rig.port
        served, link = rig.served, port._link
        assert served is not None
        mode = link.mode

        async def after_the_demands(wanted: Mode, indices: Sequence[int] = (0, 1, 2)) -> None:
            if wanted == "position":
                served.do(lambda bench: bench.table.open_interlock(2))
            await mode(wanted, indices)

        monkeypatch.setattr(link, "mode", after_the_demands)
        with pytest.raises(DeviceFault, match="interlock 3 of the turntable is open: find out why"):
            asyncio.run(rig.port.move_to(TableAngles(0, 0, 300)))


def test_an_interlock_that_opens_during_a_move_ends_it(tmp_path: Path) -> None:
    async def scene(rig: TableRig) -> None:
        assert rig.served is not None
        move = asyncio.create_task(rig.port.move_to(TableAngles(0, 0, 300)))
        while abs(rig.rates_deg_s()[2]) < 30.0:
            await asyncio.sleep(0)
        rig.served.do(lambda bench: bench.table.open_interlock(2))
        with pytest.raises(DeviceFault, match="interlock 3 of the turntable is open: find out why"):
            await move
        await rig.port.make_safe()
        words = {word.name: word.raw for word in (await rig.port.read()).status}
        assert words["interlock 3"] == "open"

    with table("acutrol", tmp_path) as rig:
        asyncio.run(scene(rig))


def test_made_safe_while_an_open_interlock_brakes_it(tmp_path: Path) -> None:
    async def scene(rig: TableRig) -> None:
        assert rig.served is not None
        await rig.port.command_turn(Turn("outer", 2, 50.0, 1.0))
        while abs(rig.rates_deg_s()[0]) < 40.0:
            await asyncio.sleep(0)
        rig.served.do(lambda bench: bench.table.open_interlock(0))
        await rig.port.make_safe()
        assert not (await rig.port.read()).moving
        assert max(abs(rate) for rate in rig.rates_deg_s()) < 1e-3

    with table("acutrol", tmp_path) as rig:
        asyncio.run(scene(rig))


@pytest.mark.parametrize("after_s", [0.0, 0.002, 0.005, 0.01, 0.02, 0.04])
def test_a_demand_that_is_still_being_given_does_not_outlive_make_safe(rig: TableRig, after_s: float) -> None:
    async def scene() -> None:
        await rig.port.read()
        move = asyncio.create_task(rig.port.move_to(TableAngles(40, 30, 20)))
        await asyncio.sleep(after_s)
        await rig.port.make_safe()
        await asyncio.wait([move])
        before = _angles(await rig.port.read())
        await rig.clock.sleep(2.0)
        reading = await rig.port.read()
        assert not reading.moving
        assert _angles(reading) == pytest.approx(before, abs=POINTING_DEG)

    asyncio.run(scene())


def test_turns_are_not_turned_back_where_the_controller_counts_them(tmp_path: Path) -> None:
    """An axis that is declared with slip rings, and has none at its controller: its angle goes on to 360°."""

    async def scene(rig: TableRig) -> None:
        await rig.port.command_turn(Turn("outer", 1, 50.0, 1.0))
        await rig.port.settle()
        assert rig.served is not None
        encoders = rig.served.do(lambda bench: bench.table.true_encoders_deg())
        assert encoders[2] == pytest.approx(360.0, abs=POINTING_DEG)

    swapped = {"outer": axis(3, 400.0, continuous=True), "middle": axis(2, 190.0), "inner": axis(1, 360.0)}
    with table("acutrol", tmp_path, **swapped) as rig:
        asyncio.run(scene(rig))
