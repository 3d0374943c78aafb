"""An axis of an ACUTROL table that is not followed any more, and refuses the statements that stop it."""

import asyncio
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from bench_service.drivers.devices.acutrol_turntable import DRIVER
from bench_service.drivers.interface.driver import DriverContext
from bench_service.drivers.wall_bench_clock import WallBenchClock
from procedures.bench.errors import BenchError, DeviceFault, Disconnected, Stopped
from procedures.core.constant_rate import ConstantRate
from tests.conformance.served import axis

RATE = ConstantRate("outer", 5.0, 100.0, 1.0)


class Table:
    """The driver, with a line on which every request raises what the test says; nothing is connected."""

    def __init__(self, folder: Path, reading: BaseException, stopping: BaseException) -> None:
        self.notes: list[tuple[str, dict[str, Any]]] = []
        axes = {"outer": axis(1, 360.0, continuous=True), "middle": axis(2, 190.0), "inner": axis(3, 400.0)}
        section = DRIVER.section.model_validate({"driver": "acutrol", "address": "tcp://127.0.0.1:9", **axes})
        context = DriverContext("wire", WallBenchClock(), folder, note=self._note)
        self.driver: Any = DRIVER.open(section, context)
        link = self.driver._link
        link.states, link.demand = self._raising(reading), self._raising(stopping)

    def _note(self, event: str, more: Mapping[str, Any]) -> None:
        self.notes.append((event, dict(more)))

    @staticmethod
    def _raising(error: BaseException) -> Any:
        async def raising(*_: Any) -> None:
            raise error

        return raising

    def followed(self) -> BaseException:
        """The failure with which following a rate ends."""
        with pytest.raises(BaseException) as found:  # noqa: PT011  whatever it is, a cancel too
            asyncio.run(self.driver._follow_rate(RATE, 0, [0.0, 0.0, 0.0], 0))
        return found.value


@pytest.mark.parametrize("stopping", [Disconnected("the line is gone"), DeviceFault("it refuses")])
def test_an_axis_that_could_not_be_stopped_is_in_the_failure_the_log_and_the_journal(
    tmp_path: Path, stopping: BenchError, caplog: pytest.LogCaptureFixture
) -> None:
    table = Table(tmp_path, DeviceFault("an interlock is open"), stopping)
    failure = table.followed()
    assert type(failure) is type(stopping)
    assert str(failure) == f"an interlock is open; the outer axis could not be stopped: {stopping}"
    assert table.notes == [("turntable.not_stopped", {"axis": "outer", "error": str(stopping)})]
    assert f"bench wire: the outer axis could not be stopped: {stopping}" in caplog.text


@pytest.mark.parametrize("first", [Stopped("another demand"), asyncio.CancelledError()])
def test_what_took_over_stays_the_reason(
    tmp_path: Path, first: BaseException, caplog: pytest.LogCaptureFixture
) -> None:
    table = Table(tmp_path, first, Disconnected("the line is gone"))
    assert type(table.followed()) is type(first)
    assert [event for event, _ in table.notes] == ["turntable.not_stopped"]
    assert [record.levelno for record in caplog.records] == [logging.ERROR]
