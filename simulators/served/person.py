"""The person at the served bench: who sets the unit by hand on a request that comes over a line.

One request a line: ``set OUTER MIDDLE INNER`` with table angles in degrees. The answer comes once the work is done, as
``done``, or as ``refused: `` with the reason. A request whose line is closed meanwhile is given up, and the door is
closed.
"""

import asyncio
from math import isfinite

from procedures.bench.errors import BenchError
from procedures.bench.operator import Operator
from procedures.core.table_angles import TableAngles

LONGEST = 256
"""Longest request [bytes]."""
DONE, REFUSED = "done", "refused: "


class PersonPort:
    """Port of the person; one line at a time, a second one is closed at once."""

    def __init__(self, person: Operator) -> None:
        self._person = person
        self._server: asyncio.Server | None = None
        self._line: asyncio.StreamWriter | None = None

    async def open(self, host: str, port: int) -> int:
        """Open the port; 0: any free one. Returns its number."""
        self._server = await asyncio.start_server(self._serve, host, port, limit=LONGEST)
        return self._server.sockets[0].getsockname()[1]

    async def close(self) -> None:
        """Close the port and its line."""
        if self._server is not None:
            self._server.close()
        if self._line is not None:
            self._line.close()

    def cut(self) -> None:
        """Cut the line: the person gives up what was asked."""
        if self._line is not None:
            self._line.transport.abort()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self._line is not None:
            writer.close()
            return
        self._line = writer
        try:
            while request := await reader.readline():
                answer = await self._answer(request, reader)
                if answer is None:
                    return
                writer.write(f"{answer}\r\n".encode())
                await writer.drain()
        except (ConnectionError, ValueError):  # ValueError: a request longer than the limit
            return
        finally:
            self._line = None
            writer.close()

    async def _answer(self, request: bytes, reader: asyncio.StreamReader) -> str | None:
        """Do what is asked; None: the line was closed, or something else came, before it was done."""
        try:
            angles = angles_of(request)
        except ValueError as error:
            return f"{REFUSED}{error}"
        work = asyncio.ensure_future(self._person.set_by_hand(angles, ""))
        gone = asyncio.ensure_future(reader.read(1))
        try:
            await asyncio.wait((work, gone), return_when=asyncio.FIRST_COMPLETED)
            if not work.done():
                return None
            work.result()
        except BenchError as error:
            return f"{REFUSED}{error}"
        finally:
            for task in (work, gone):
                task.cancel()
            await asyncio.wait((work, gone))
        return DONE


def angles_of(request: bytes) -> TableAngles:
    """Table angles of a request. Raises `ValueError` with the form that is expected."""
    form = "give: set OUTER MIDDLE INNER, in degrees"
    words = request.decode("ascii", "replace").split()
    if len(words) != 4 or words[0] != "set":
        raise ValueError(form)
    try:
        outer, middle, inner = (float(word) for word in words[1:])
    except ValueError:
        raise ValueError(form) from None
    if not all(map(isfinite, (outer, middle, inner))):
        raise ValueError(form)
    return TableAngles(outer, middle, inner)
