"""Line to a Modbus device: pymodbus' client in one thread, with the rules of every other line."""

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Literal, TypeVar, cast

from bench_service.drivers.answers import BadAnswer
from bench_service.drivers.interface.address import Address
from bench_service.drivers.protocols.modbus_map import Bit, Register
from procedures.bench.errors import DeviceFault, Disconnected

T = TypeVar("T")


class ModbusLine:
    """Line to a Modbus device, in one thread: reads may be asked twice, over a new connection; a write is never sent
    twice.

    After a lost answer the connection is given up, for the frames of a serial line do not say which request they
    answer.
    """

    def __init__(
        self,
        device: str,
        address: Address,
        unit: int,
        framing: Literal["tcp", "rtu"],
        connect_s: float,
        answer_s: float,
    ) -> None:
        self._named = f"the {device} at {address}"
        self._address, self._unit, self._framing = address, unit, framing
        self._connect_s, self._answer_s = connect_s, answer_s
        self._client: Any = None
        self._closed = False
        self._thread = ThreadPoolExecutor(1, f"line {self._named}")

    async def read(self, register: Register) -> float:
        """Read the registers of one value and return it. Raises `Disconnected`, `DeviceFault` where the device
        refuses.
        """
        return register.decode(await self._words(register.table, register.address, register.words))

    async def read_bit(self, bit: Bit) -> bool:
        """Read one bit of a register and return True where it is set; raises as `read` does."""
        return bit.of((await self._words(bit.table, bit.address, 1))[0])

    async def write(self, register: Register, value: float) -> None:
        """Write one value into its registers, once. Raises `Disconnected`, `DeviceFault`."""
        await self._write(register.address, register.encode(value), f"{value:g} into register {register.address}")

    async def write_bit(self, bit: Bit, on: bool) -> None:
        """Read the bit's register, change this bit alone, write it. Raises as `write` does."""
        word = (await self._words(bit.table, bit.address, 1))[0]
        await self._write(bit.address, [bit.changed(word, on)], f"bit {bit.bit} of register {bit.address}")

    def close(self) -> None:
        """Drop the connection without waiting."""
        self._closed = True
        self._thread.submit(self._drop)
        self._thread.shutdown(wait=False)

    async def _words(self, table: str, address: int, count: int) -> list[int]:
        def ask() -> list[int]:
            try:
                return self._read_once(table, address, count)
            except _Lost:
                return self._read_once(table, address, count)

        return await self._in_thread(ask, f"register {address}")

    async def _write(self, address: int, words: list[int], name: str) -> None:
        def ask() -> None:
            answer = self._asked(lambda client: client.write_registers(address, words, device_id=self._unit))
            self._checked(answer, name)

        await self._in_thread(ask, name, "; whether it was carried out is not known, and it is not sent again")

    async def _in_thread(self, work: Callable[[], T], name: str, more: str = "") -> T:
        def guarded() -> T:
            try:
                return work()
            except _Lost as lost:
                raise Disconnected(f"{self._named}: no answer to {name}: {lost}{more}") from None
            except BadAnswer as bad:
                self._drop()
                raise Disconnected(f"{self._named}: the answer to {name} cannot be understood: {bad}{more}") from None

        if self._closed:
            raise Disconnected(f"the line of {self._named} was closed by the service")
        return await asyncio.wrap_future(self._thread.submit(guarded))

    def _read_once(self, table: str, address: int, count: int) -> list[int]:
        def ask(client: Any) -> Any:
            read = client.read_holding_registers if table == "holding" else client.read_input_registers
            return read(address, count=count, device_id=self._unit)

        answer = self._checked(self._asked(ask), f"register {address}")
        words = cast("list[int]", answer.registers)
        if len(words) != count:
            raise BadAnswer(f"{len(words)} registers came where {count} were requested")
        return words

    def _asked(self, ask: Callable[[Any], Any]) -> Any:
        from pymodbus.exceptions import ModbusException

        try:
            return ask(self._connected())
        except (ModbusException, OSError) as lost:
            self._drop()
            raise _Lost(str(lost)) from None

    def _checked(self, answer: Any, name: str) -> Any:
        """Raises `DeviceFault` for an exception response, with its code."""
        if answer is None or answer.isError():
            code = getattr(answer, "exception_code", None)
            if code is None:
                self._drop()
                raise _Lost(str(answer))
            raise DeviceFault(f"{self._named} refuses {name}: Modbus exception {code}")
        return answer

    def _connected(self) -> Any:
        if self._client is None:
            self._client = self._made()
            if not self._client.connect():
                self._drop()
                raise Disconnected(f"{self._named} cannot be reached")
        return self._client

    def _made(self) -> Any:
        from pymodbus import FramerType
        from pymodbus.client import ModbusSerialClient, ModbusTcpClient

        if self._address.scheme == "serial":
            bits, parity, stops = self._address.format
            return ModbusSerialClient(
                self._address.path,
                baudrate=self._address.baud,
                bytesize=int(bits),
                parity=parity,
                stopbits=int(stops),
                timeout=self._answer_s,
                retries=0,
            )
        framer = FramerType.SOCKET if self._framing == "tcp" else FramerType.RTU
        return ModbusTcpClient(
            self._address.host, port=self._address.port, framer=framer, timeout=self._answer_s, retries=0
        )

    def _drop(self) -> None:
        if self._client is not None:
            self._client.close()
        self._client = None


class _Lost(Exception):
    """Raised where no answer came."""
