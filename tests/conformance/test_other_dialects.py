"""Drivers at an address where something else answers: each is refused in words, and no demand goes out.

Every driver of a device that is asked, at every other served device and at servers that any network has.
"""

import asyncio
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from procedures.bench.errors import BenchError
from procedures.core.table_angles import TableAngles
from simulators.served.bench import ServedBench
from tests.conformance.served import CHAMBER_LIMITS, SUPPLY_LIMITS, axis, opened, served

AXES = {"outer": axis(1, 360.0, continuous=True), "middle": axis(2, 190.0), "inner": axis(3, 400.0)}
DRIVERS: dict[str, tuple[Any, dict[str, Any], Callable[[Any], Any]]] = {
    "acutrol": ("turntable", AXES, lambda d: d.move_to(TableAngles(0.0, 10.0, 0.0))),
    "simserv": ("chamber", {"limits": CHAMBER_LIMITS}, lambda d: d.command(40.0, 2.0)),
    "ascii2": ("chamber", {"limits": CHAMBER_LIMITS}, lambda d: d.command(40.0, 2.0)),
    "scpi": ("supply", {"limits": SUPPLY_LIMITS}, lambda d: d.switch_on()),
}
"""Driver -> kind, section, and the demand that is tried."""
GREETINGS = {
    "ssh": b"SSH-2.0-OpenSSH_9.6\r\n",
    "telnet": b"\xff\xfd\x18\xff\xfd\x20\xff\xfd\x23\xff\xfd\x27",
    "ftp": b"220 ready\r\n",
    "codesys": b"100 OK: CoDeSys\r\n",
}
"""Greetings of servers that speak before they are asked."""
ANSWERS = {"http": b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n", "ideal aerosmith": b"?\r\n>"}
"""Answers of servers to any line."""
DEMANDS = (b":demand:", b":mode:", b"OUTP", b"VOLT ", b"CURR ", b"11001", b"14001", b"$01E")


class _Heard:
    """A server that greets or answers, and keeps what it hears."""

    def __init__(self, greeting: bytes, answer: bytes) -> None:
        self._greeting, self._answer = greeting, answer
        self.heard = b""

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(self._greeting)
        try:
            while data := await reader.read(4096):
                self.heard += data
                writer.write(self._answer)
                await writer.drain()
        except ConnectionError:
            pass
        finally:
            writer.close()


@asynccontextmanager
async def _others() -> AsyncGenerator[dict[str, tuple[int, _Heard]]]:
    texts = {name: (text, b"") for name, text in GREETINGS.items()} | {name: (b"", t) for name, t in ANSWERS.items()}
    found, servers = dict[str, tuple[int, _Heard]](), list[asyncio.Server]()
    for name, (greeting, answer) in texts.items():
        heard = _Heard(greeting, answer)
        servers.append(await asyncio.start_server(heard.serve, "127.0.0.1", 0))
        found[name] = servers[-1].sockets[0].getsockname()[1], heard
    try:
        yield found
    finally:
        for server in servers:
            server.close()


async def _refusal(driver: str, port: int, folder: Path) -> str:
    """Return what the demand ends with. It must end in the words of a bench's error, within its deadline."""
    kind, section, demand = DRIVERS[driver]
    device = opened(kind, driver, port, folder, answer_s=0.3, connect_s=1.0, **section)
    try:
        async with asyncio.timeout(6.0):
            await demand(device)
    except BenchError as error:
        return str(error)
    finally:
        device.close()
    return ""


@pytest.mark.parametrize("driver", DRIVERS)
def test_servers_of_any_network_are_told_and_hear_no_demand(tmp_path: Path, driver: str) -> None:
    async def scene() -> None:
        async with _others() as others:
            refusals = await asyncio.gather(*(_refusal(driver, port, tmp_path) for port, _ in others.values()))
            for (name, (port, heard)), refusal in zip(others.items(), refusals, strict=True):
                assert f"127.0.0.1:{port}" in refusal, f"{name}: {refusal}"
                assert not any(demand in heard.heard for demand in DEMANDS), f"{name} heard {heard.heard!r}"

    asyncio.run(scene())


@pytest.mark.parametrize("driver", DRIVERS)
def test_other_devices_of_the_bench_are_told_and_change_nothing(tmp_path: Path, driver: str) -> None:
    kind = DRIVERS[driver][0]
    languages = {"turntable": "acutrol", "chamber": "simserv", "supply": "scpi", "unit_link": "framed"}
    others = {name: language for name, language in languages.items() if name != kind}

    async def scene(numbers: dict[str, int]) -> list[str]:
        return await asyncio.gather(*(_refusal(driver, numbers[name], tmp_path) for name in others))

    with served(languages, thermal=True) as behind:
        before = behind.do(lambda bench: (bench.table.encoders_deg(), bench.bench.supply.is_on()))
        for name, refusal in zip(others, asyncio.run(scene(behind.numbers)), strict=True):
            assert f"127.0.0.1:{behind.numbers[name]}" in refusal, f"{name}: {refusal}"
        assert behind.do(lambda bench: (bench.table.encoders_deg(), bench.bench.supply.is_on())) == before
        assert behind.do(_target) is None


def _target(bench: ServedBench) -> float | None:
    assert bench.bench.chamber is not None
    return bench.bench.chamber.plant.state.target_c
