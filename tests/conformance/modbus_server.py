"""A chamber on Modbus TCP by pymodbus' own server, run as a process: prints its port, serves until killed.

Registers: 0 actual, 2 set point, 4 ramp (32-bit floats); 6 bits: 0 running, 1 door open, 2 alarm.
"""

import asyncio
import socket
import struct
import sys

from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice


def _words(*values: float) -> list[int]:
    words: list[int] = []
    for value in values:
        words += struct.unpack(">HH", struct.pack(">f", value))
    return words


async def main() -> None:
    bits = int(sys.argv[1]) if len(sys.argv) > 1 else 0
    data = SimData(0, values=[*_words(22.0, 22.0, 3.0), bits], datatype=DataType.REGISTERS)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    server = ModbusTcpServer(SimDevice(1, simdata=[data]), address=("127.0.0.1", port))
    task = asyncio.create_task(server.serve_forever())
    while not server.is_active():
        await asyncio.sleep(0.01)
    print(port, flush=True)
    await task


asyncio.run(main())
