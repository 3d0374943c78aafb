"""The person of a served bench, asked over a line: implements `procedures.bench.operator.Operator`.

No real person listens on a port. `bench simulate` has one, who sets the simulated unit by hand, so that procedures
which need that run over wires as they do in process.
"""

import asyncio

from bench_service.drivers.interface.address import Address
from procedures.bench.errors import DeviceFault, Disconnected
from procedures.core.table_angles import TableAngles

CONNECT_S = 3.0
"""Time within which the line must be made [s]."""
DONE, REFUSED = "done", "refused: "


class ServedPerson:
    """Person behind a TCP port. Each request has a line of its own, and takes the time that it takes."""

    def __init__(self, address: Address) -> None:
        self._address = address

    async def set_by_hand(self, angles: TableAngles, request: str) -> None:
        """Have the served person set the unit, and wait until that is confirmed. Raises `Disconnected`, `DeviceFault`
        with the person's reason.
        """
        try:
            async with asyncio.timeout(CONNECT_S):
                reader, writer = await asyncio.open_connection(self._address.host, self._address.port)
        except (OSError, TimeoutError) as error:
            raise Disconnected(f"the served person at {self._address} is not reached: {error or 'no answer'}") from None
        try:
            writer.write(f"set {angles.outer_deg!r} {angles.middle_deg!r} {angles.inner_deg!r}\r\n".encode())
            await writer.drain()
            answer = (await reader.readline()).decode("utf-8", "replace").strip()
        except (OSError, ValueError) as error:
            raise Disconnected(f"the line to the served person at {self._address} is cut: {error}") from None
        finally:
            writer.close()
        if answer.startswith(REFUSED):
            raise DeviceFault(f"the served person refuses: {answer.removeprefix(REFUSED)}")
        if answer != DONE:
            raise Disconnected(f"the served person at {self._address} closed the line before the unit was set")
