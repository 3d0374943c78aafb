"""A supply on a serial line: there is no connection to give up, so its identity brings the line into step."""

import asyncio
import os
import threading
import time
import tty
from collections.abc import Iterator
from pathlib import Path

import pytest

from procedures.bench.errors import Disconnected
from simulators.served.scpi import ScpiLanguage
from simulators.supply.device import SimSupply
from tests.conformance.served import SUPPLY_LIMITS, opened


class OnSerial:
    """A SCPI supply behind a pseudo-terminal, which answers late where it is asked to."""

    def __init__(self) -> None:
        self._end, self._device = os.openpty()
        tty.setraw(self._device)
        self.path = os.ttyname(self._device)
        self.supply = SimSupply(time.monotonic, 28.0)
        self.late: dict[int, float] = {}
        """Number of a request -> delay of its answer [s]."""
        self.requests: list[bytes] = []
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        language, buffer = ScpiLanguage(self.supply), b""
        while True:
            try:
                buffer += os.read(self._end, 256)
            except OSError:
                return
            while b"\n" in buffer:
                request, buffer = buffer.split(b"\n", 1)
                if request == b"END":
                    return
                self.requests.append(request)
                answer = language.answer(request)
                time.sleep(self.late.pop(len(self.requests), 0.0))
                os.write(self._end, answer)

    def close(self) -> None:
        """End the device's thread, then its ends of the line."""
        os.write(self._device, b"END\n")
        self._thread.join(5.0)
        os.close(self._device)
        os.close(self._end)


@pytest.fixture
def line() -> Iterator[OnSerial]:
    made = OnSerial()
    yield made
    made.close()


def test_a_supply_is_driven_over_a_serial_line(line: OnSerial, tmp_path: Path) -> None:
    async def scene() -> None:
        address = f"serial://{line.path}?baud=19200"
        supply = opened("supply", "scpi", 0, tmp_path, address=address, limits=SUPPLY_LIMITS)
        found = await supply.connect()
        assert found.identity.model == "PSU-1"
        await supply.switch_on()
        assert line.supply.launches == 1
        await supply.make_safe()
        assert not (await supply.read()).on
        supply.close()
        await asyncio.sleep(0.1)

    asyncio.run(scene())


@pytest.mark.parametrize("ahead", [1, 3, 6])
def test_a_late_answer_on_a_serial_line_is_left_out(line: OnSerial, tmp_path: Path, ahead: int) -> None:
    async def scene() -> None:
        address = f"serial://{line.path}?baud=19200"
        supply = opened("supply", "scpi", 0, tmp_path, address=address, limits=SUPPLY_LIMITS, answer_s=0.4)
        await supply.set_output(27.5, 1.5)
        await supply.switch_on()
        line.late[len(line.requests) + ahead] = 0.6
        for _ in range(3):
            found = await asyncio.gather(supply.read(), return_exceptions=True)
            if isinstance(found[0], BaseException):
                assert isinstance(found[0], Disconnected)
                continue
            reading = found[0]
            assert (reading.set_voltage_v, reading.set_current_a) == (27.5, 1.5)
            assert reading.voltage_v == pytest.approx(27.5, abs=0.02)
            assert 0.5 < reading.current_a < 1.4
            assert reading.on
            assert not reading.tripped
        assert (await supply.read()).on
        supply.close()
        await asyncio.sleep(0.1)

    asyncio.run(scene())
