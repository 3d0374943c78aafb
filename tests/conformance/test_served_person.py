"""The person of a served bench: the unit is set by hand over a line, and what goes wrong is answered in words."""

import asyncio
import contextlib
from pathlib import Path

import numpy as np
import pytest

from bench_service.drivers.interface.address import Address
from bench_service.drivers.wired.served_person import ServedPerson
from procedures.bench import BenchNeeds
from procedures.bench.errors import DeviceFault, Disconnected
from procedures.core.table_angles import TableAngles
from simulators.served.person import angles_of
from tests.conformance.served import Served, served
from tests.kit.wired_bench import PERSON, THERMAL_LANGUAGES, wired_driver

FACTOR = 200.0
"""The person takes some minutes of bench time."""
X_UP = TableAngles(0.0, 0.0, 0.0)


def _person(behind: Served) -> ServedPerson:
    return ServedPerson(Address("tcp", "127.0.0.1", behind.numbers["operator"]))


def test_the_unit_is_set_and_the_table_shows_what_it_showed(tmp_path: Path) -> None:
    with served({**THERMAL_LANGUAGES, **PERSON}, thermal=True, factor=FACTOR) as behind:
        before = behind.do(lambda bench: bench.table.encoders_deg())
        attitude = behind.do(lambda bench: bench.table.read_angles())
        asyncio.run(_person(behind).set_by_hand(TableAngles(0.0, 90.0, 45.0), "z up"))
        after = behind.do(lambda bench: bench.table.read_angles())
        assert (after.middle_deg, after.inner_deg) == pytest.approx((90.0, 45.0))
        assert behind.do(lambda bench: bench.table.encoders_deg()) == before
        assert behind.do(lambda bench: bench.bench.operator.settings) == 1
        behind.do(lambda bench: bench.table.set_mode(1, "position"))  # a demand: the table has the unit again
        back = behind.do(lambda bench: bench.table.read_angles())
        assert (back.outer_deg, back.middle_deg, back.inner_deg) == pytest.approx(
            (attitude.outer_deg, attitude.middle_deg, attitude.inner_deg), abs=0.01
        )


def test_a_unit_that_is_on_is_not_set_and_the_reason_comes_over_the_line(tmp_path: Path) -> None:
    with served({**THERMAL_LANGUAGES, **PERSON}, thermal=True, factor=FACTOR) as behind:
        bench = _bench(behind, tmp_path)
        try:
            assert bench.operator is not None
            asyncio.run(bench.supply.switch_on())
            with pytest.raises(DeviceFault, match="the served person refuses: the unit is on"):
                asyncio.run(bench.operator.set_by_hand(X_UP, "x up"))
        finally:
            asyncio.run(bench.make_safe())
            bench.close()
    with pytest.raises(Disconnected, match=r"served person at tcp://127.0.0.1:\d+ is not reached"):
        asyncio.run(_person(behind).set_by_hand(X_UP, "x up"))


def test_a_request_that_is_given_up_leaves_the_door_closed(tmp_path: Path) -> None:
    async def scene(behind: Served) -> None:
        asked = asyncio.create_task(_person(behind).set_by_hand(X_UP, "x up"))
        while not await asyncio.to_thread(behind.do, _door):
            await asyncio.sleep(0.01)
        asked.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await asked
        while await asyncio.to_thread(behind.do, _door):
            await asyncio.sleep(0.01)

    with served({**THERMAL_LANGUAGES, **PERSON}, thermal=True, factor=10.0) as behind:
        asyncio.run(asyncio.wait_for(scene(behind), 10.0))
        assert behind.do(lambda bench: bench.bench.operator.settings) == 0


@pytest.mark.parametrize("request_", [b"set 1 2", b"set a b c", b"set 1 2 nan", b"home 1 2 3", b"\xff\xfe"])
def test_a_request_of_another_form_is_refused(request_: bytes) -> None:
    with pytest.raises(ValueError, match="give: set OUTER MIDDLE INNER"):
        angles_of(request_)


def test_a_recording_may_begin_with_the_launch_for_the_unit_is_waited_for(tmp_path: Path) -> None:
    """Data that are not valid yet are refused; who switches on waits for the first valid frame."""
    with served({**THERMAL_LANGUAGES, **PERSON}, thermal=True, factor=2.0) as behind:
        bench = _bench(behind, tmp_path)

        async def scene() -> np.ndarray:
            await bench.supply.switch_on()
            return np.concatenate([block async for block in bench.imu.record(0.5).blocks])

        try:
            assert len(asyncio.run(scene())) == 200
        finally:
            asyncio.run(bench.make_safe())
            bench.close()


def _door(bench: object) -> bool:
    return bool(bench.bench.chamber.plant.state.door_open)  # type: ignore[attr-defined]


def _bench(behind: Served, folder: Path):
    driver = wired_driver(folder, behind, behind.config.factor, after_demand_s=0.02)
    return driver.open("GL017", None, None, BenchNeeds(temperatures=True))
