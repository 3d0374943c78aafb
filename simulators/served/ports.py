"""TCP ports of served devices: one master each, answers as a fault plan has them."""

import asyncio
from collections.abc import Callable
from typing import Protocol

from simulators.clock import Wait
from simulators.served.faults import Fault, FaultPlan

MOST_WAITING = 8192
"""Longest unfinished request [bytes]; a longer one closes its line."""


class Talker(Protocol):
    """Language of a device."""

    def take(self, buffer: bytearray) -> bytes | None:
        """Take one whole request out of the buffer; None: there is none yet."""
        ...

    def answer(self, request: bytes) -> bytes:
        """Answer to a request; empty: none."""
        ...


class LinePort:
    """Port of a device that answers requests. A second master finds its line closed at once."""

    def __init__(self, device: str, talker: Talker, plan: FaultPlan, wait: Wait, masters: int = 1) -> None:
        """Set up; `wait`: waits real seconds, as a slow device does; `masters`: largest number of open lines."""
        self._wait = wait
        self.device, self._talker, self._plan, self._masters = device, talker, plan, masters
        self._server: asyncio.Server | None = None
        self._lines: set[asyncio.StreamWriter] = set()
        self.requests: list[bytes] = []
        """Requests that have come, the newest thousand; for tests."""

    async def open(self, host: str, port: int) -> int:
        """Open the port; 0: any free one. Returns its number."""
        self._server = await asyncio.start_server(self._serve, host, port)
        return self._server.sockets[0].getsockname()[1]

    async def close(self) -> None:
        """Close the port and its lines."""
        if self._server is not None:
            self._server.close()
        for line in tuple(self._lines):
            line.close()
        self._lines.clear()

    def cut(self) -> None:
        """Cut all lines, as a cable that is pulled out."""
        for line in tuple(self._lines):
            line.transport.abort()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if len(self._lines) >= self._masters:
            writer.close()
            return
        self._lines.add(writer)
        buffer = bytearray()
        try:
            while data := await reader.read(4096):
                buffer += data
                if len(buffer) > MOST_WAITING:
                    return
                while (request := self._talker.take(buffer)) is not None:
                    self.requests = [*self.requests[-999:], request]
                    await self._answer(request, writer)
        except (ConnectionError, asyncio.CancelledError):
            return
        finally:
            self._lines.discard(writer)
            writer.close()

    async def _answer(self, request: bytes, writer: asyncio.StreamWriter) -> None:
        """Answer as the plan has it. A reply leaves in one piece, for there are clients that read but once."""
        fault = self._plan.next(self.device)
        if fault is not None and fault.kind == "cut":
            writer.transport.abort()
            raise ConnectionResetError
        answer = self._talker.answer(request)
        if fault is not None and fault.kind == "cut_after":
            writer.transport.abort()
            raise ConnectionResetError
        if answer:
            await self._send(answer, fault, writer)

    async def _send(self, answer: bytes, fault: Fault | None, writer: asyncio.StreamWriter) -> None:
        if fault is None:
            writer.write(answer)
        elif fault.kind == "slow":
            await self._wait(fault.seconds)
            writer.write(answer)
        elif fault.kind == "half":
            writer.write(answer[: max(1, len(answer) // 2)])
        elif fault.kind == "doubled":
            writer.write(answer + answer)
        await writer.drain()


class Lines:
    """Requests that end with one of some bytes; blank requests are ignored."""

    def __init__(self, endings: bytes, answer: Callable[[bytes], bytes]) -> None:
        self._endings, self._answer = endings, answer

    def take(self, buffer: bytearray) -> bytes | None:
        """Take one whole request out of the buffer; None: there is none yet. See `Talker`."""
        while (at := next((k for k, byte in enumerate(buffer) if byte in self._endings), -1)) >= 0:
            request = bytes(buffer[:at])
            del buffer[: at + 1]
            if request.strip():
                return request
        return None

    def answer(self, request: bytes) -> bytes:
        """Answer a request by the rules of `Talker.answer`."""
        return self._answer(request)
