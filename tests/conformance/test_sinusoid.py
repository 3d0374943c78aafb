"""Sinusoids of the turntable's port, for every implementation of it: course by the trace, refusals, mid-swing."""

import asyncio
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from procedures.bench.errors import DeviceFault, Disconnected, OutOfRange, Stopped
from procedures.core.constant_rate import ConstantRate
from procedures.core.sinusoid import Sinusoid
from procedures.core.table_angles import TableAngles
from tests.conformance.tables import IMPLEMENTATIONS, TableRig, acutrol, table

SWING = Sinusoid("outer", 2.0, 0.5, 6)


@pytest.fixture(params=IMPLEMENTATIONS)
def rig(request: pytest.FixtureRequest, tmp_path: Path):
    with table(request.param, tmp_path, **({} if request.param == "simulated" else {"sinusoidal": True})) as made:
        yield made


def test_the_trace_is_the_sinusoid_and_the_table_rests_where_it_began(rig: TableRig) -> None:
    async def scene() -> None:
        await rig.port.move_to(TableAngles(20, 0, 0))
        assert len(rig.port.trace().time_s) == 0
        await rig.port.command_sinusoid(SWING)
        with pytest.raises(DeviceFault, match="the table is moving"):
            await rig.port.move_to(TableAngles())
        await rig.clock.sleep(SWING.lead_s)
        rig.port.trace()
        await rig.clock.sleep(4.0)
        trace = rig.port.trace()
        omega = 2.0 * np.pi * SWING.frequency_hz
        design = np.stack(
            [np.cos(omega * trace.time_s), np.sin(omega * trace.time_s), np.ones_like(trace.time_s)], axis=1
        )
        found, *_ = np.linalg.lstsq(design, trace.angles_deg[:, 0], rcond=None)
        # A servo of 20 Hz follows 0.5 Hz within some 1e-4. Over the wire, at a time factor of 20, a reading lies within
        # some hundredths of a second of its time, and a crowded machine makes the served world late by as much.
        most = 2e-3 if rig.served is None else 0.3
        assert np.hypot(found[0], found[1]) == pytest.approx(2.0, abs=most)
        assert found[2] == pytest.approx(20.0, abs=most)
        assert np.median(np.abs(trace.angles_deg[:, 0] - design @ found)) < most
        await rig.port.settle()
        reading = await rig.port.read()
        assert not reading.moving
        assert reading.angles.outer_deg == pytest.approx(20.0, abs=2e-3)

    asyncio.run(scene())


@pytest.mark.parametrize(
    ("sinusoid", "words"),
    [
        (Sinusoid("outer", 20.0, 1.0, 5), "rate of .* is above"),
        (Sinusoid("outer", 1.0, 5.0, 5), "acceleration of .* is above"),
        (Sinusoid("middle", 195.0, 0.01, 5), "leaves -190"),
    ],
)
def test_a_sinusoid_beyond_a_limit_moves_nothing(rig: TableRig, sinusoid: Sinusoid, words: str) -> None:
    async def scene() -> None:
        with pytest.raises(OutOfRange, match=words):
            await rig.port.command_sinusoid(sinusoid)
        assert not (await rig.port.read()).moving
        assert not rig.demands()

    asyncio.run(scene())


def test_made_safe_in_mid_swing_it_rests_and_moves_again(rig: TableRig) -> None:
    async def scene() -> None:
        await rig.port.command_sinusoid(SWING)
        settling = asyncio.create_task(rig.port.settle())
        while abs(rig.rates_deg_s()[0]) < 3.0:
            await rig.clock.sleep(0.02)
        await rig.port.make_safe()
        await asyncio.wait([settling])
        assert isinstance(settling.exception(), Stopped)
        assert not (await rig.port.read()).moving
        assert max(abs(rate) for rate in rig.rates_deg_s()) < 1e-3
        await rig.port.move_to(TableAngles(1, 0, 0))

    asyncio.run(scene())


SLOW = Sinusoid("outer", 2.5, 0.02, 3)
"""Its rate is below that of rest for about two seconds after its begin."""
CREEP = ConstantRate("outer", 0.02, 400.0, 100.0)
"""Its rate is below that of rest for about five seconds after its begin."""


@pytest.mark.parametrize("verb", ["sinusoid", "rate"])
def test_made_safe_while_it_hardly_moves_yet_it_stays_where_it_is(rig: TableRig, verb: str) -> None:
    """Ten seconds after its begin the sinusoid would be 0.14 deg away, the rate 0.01 deg."""

    async def scene() -> None:
        await (rig.port.command_sinusoid(SLOW) if verb == "sinusoid" else rig.port.command_rate(CREEP))
        await rig.port.make_safe()
        before = (await rig.port.read()).angles.outer_deg
        await rig.clock.sleep(10.0)
        assert (await rig.port.read()).angles.outer_deg == pytest.approx(before, abs=2e-3)
        assert max(abs(rate) for rate in rig.rates_deg_s()) < 1e-4
        if rig.served is not None:
            assert rig.served.do(lambda bench: [axis.mode for axis in bench.table.axes]) == ["position"] * 3
        await rig.port.move_to(TableAngles(1, 0, 0))

    asyncio.run(scene())


@pytest.mark.parametrize("after_s", [0.0, 0.005, 0.01, 0.015, 0.02, 0.03])
def test_a_sinusoid_that_is_still_being_demanded_does_not_outlive_make_safe(tmp_path: Path, after_s: float) -> None:
    async def scene(rig: TableRig) -> None:
        await rig.port.read()
        begun = asyncio.create_task(rig.port.command_sinusoid(SWING))
        await asyncio.sleep(after_s)
        await rig.port.make_safe()
        await asyncio.wait([begun])
        await rig.clock.sleep(2.0)
        assert max(abs(rate) for rate in rig.rates_deg_s()) < 1e-3
        await rig.port.move_to(TableAngles(1, 0, 0))

    with table("acutrol", tmp_path, sinusoidal=True) as rig:
        asyncio.run(scene(rig))


@pytest.mark.parametrize("verb", ["sinusoid", "rate"])
def test_an_axis_that_can_be_neither_followed_nor_braked_is_noted(
    tmp_path: Path, verb: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    notes: list[tuple[str, Any]] = []

    async def lost(*_: Any) -> Any:
        raise Disconnected("the line is cut")

    async def scene(rig: TableRig) -> None:
        device: Any = rig.port
        monkeypatch.setattr(device, "_note", lambda event, more: notes.append((event, more)))
        await (device.command_sinusoid(SWING) if verb == "sinusoid" else device.command_rate(CREEP))
        for name in ("states", "demand"):
            monkeypatch.setattr(device._link, name, lost)
        with pytest.raises(Disconnected, match="the line is cut"):
            await device.settle()
        assert notes == [("turntable.not_stopped", {"axis": "outer", "error": "the line is cut"})]

    with table("acutrol", tmp_path, sinusoidal=True) as rig:
        asyncio.run(scene(rig))


def test_another_process_stops_an_axis_that_stands_still_where_it_turns(tmp_path: Path) -> None:
    """A supervisor's driver knows nothing of the sinusoid: the axis' mode tells it."""

    async def scene(rig: TableRig, other: Any) -> None:
        await rig.port.command_sinusoid(SWING)
        assert rig.served is not None
        await rig.clock.sleep(4.0)
        while abs(rig.rates_deg_s()[0]) > 0.3:
            await rig.clock.sleep(0.001)
        rig.port.close()
        await asyncio.gather(rig.port.settle(), return_exceptions=True)
        await other.make_safe()
        assert max(abs(rate) for rate in rig.rates_deg_s()) < 1e-3
        modes = rig.served.do(lambda bench: [axis.mode for axis in bench.table.axes])
        assert modes == ["position"] * 3

    with table("acutrol", tmp_path, sinusoidal=True) as rig:
        assert rig.served is not None
        other = acutrol(rig.served, tmp_path, sinusoidal=True)
        try:
            asyncio.run(scene(rig, other))
        finally:
            other.close()
