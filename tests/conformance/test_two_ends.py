"""Several devices of one world over their wires: heat, motion and power act together, and a hung one holds none up."""

import asyncio
import time
from pathlib import Path

import numpy as np
import pytest

from procedures.bench.errors import BenchError
from procedures.core.table_angles import TableAngles
from simulators.served.faults import Fault
from tests.conformance.served import CHAMBER_LIMITS, SUPPLY_LIMITS, opened, served
from tests.conformance.tables import acutrol

LANGUAGES = {"turntable": "acutrol", "chamber": "simserv", "supply": "scpi", "unit_link": "ixcom"}
TURNED = TableAngles(0.0, 0.0, 180.0)
"""The inner axis turned by half a turn: the unit's y axis points down."""


def test_one_world_stands_behind_all_ports(tmp_path: Path) -> None:
    async def scene(bench) -> None:
        numbers = bench.numbers
        supply = opened("supply", "scpi", numbers["supply"], tmp_path, limits=SUPPLY_LIMITS)
        link = opened("unit_link", "ixcom", numbers["unit_link"], tmp_path, answer_s=2.0)
        table = acutrol(bench, tmp_path)
        await supply.switch_on()
        await link.clock.sleep(2.0)
        means = []
        for angles in (TableAngles(), TURNED):
            await table.move_to(angles)
            blocks = [block async for block in link.record(5.0).blocks]
            means.append(np.concatenate(blocks).mean(axis=0)[4] * link.channels[4].scale * link.rate_hz)
        bias, matrix = bench.do(lambda b: b.bench.true_calibration()["accelerometer"])
        # y up, then down: b + K_yy·g and b − K_yy·g; cross terms and noise are far below 0.05 m/s².
        assert means[0] == pytest.approx(bias[1] + matrix[1][1] * 9.8106, abs=0.05)
        assert means[1] == pytest.approx(bias[1] - matrix[1][1] * 9.8106, abs=0.05)
        for device in (supply, link, table):
            device.close()

    with served({name: LANGUAGES[name] for name in ("turntable", "supply", "unit_link")}, valid_after_s=0.5) as bench:
        asyncio.run(scene(bench))


def test_a_hung_device_holds_up_no_other_one(tmp_path: Path) -> None:
    """The chamber is silent: table in mid-move and supply are made safe meanwhile, and long before its deadline."""

    async def scene(bench) -> None:
        numbers = bench.numbers
        supply = opened("supply", "scpi", numbers["supply"], tmp_path, limits=SUPPLY_LIMITS)
        given = {"limits": CHAMBER_LIMITS, "after_set_s": 0.0, "answer_s": 1.5}
        chamber = opened("chamber", "simserv", numbers["chamber"], tmp_path, **given)
        table = acutrol(bench, tmp_path)
        await supply.switch_on()
        await chamber.command(40.0, 3.0)
        move = asyncio.create_task(table.move_to(TableAngles(150.0, 0.0, 0.0)))
        while abs((await table.read()).angles.outer_deg) < 5.0:
            await asyncio.sleep(0.01)
        bench.plan(Fault("chamber", "silent", every=1))
        begun = time.monotonic()
        hung = asyncio.create_task(chamber.make_safe())
        await asyncio.gather(table.make_safe(), supply.make_safe())
        # Braking from 60 deg/s takes 0.6 s of the bench, 0.03 s at this factor; the chamber is given up after 6 s.
        assert time.monotonic() - begun < 5.0
        assert not hung.done()
        assert not (await supply.read()).on
        assert not (await table.read()).moving
        await asyncio.wait([move])
        (failure,) = await asyncio.gather(hung, return_exceptions=True)
        assert isinstance(failure, BenchError)
        assert "the chamber at tcp://127.0.0.1" in str(failure)
        bench.plan()
        await chamber.make_safe()
        assert (await chamber.read()).target_c == 22.0
        for device in (supply, chamber, table):
            device.close()

    wanted = {name: LANGUAGES[name] for name in ("turntable", "chamber", "supply")}
    with served(wanted, thermal=True) as bench:
        asyncio.run(scene(bench))
