"""Register map of a Modbus device: which registers hold a value, and how. The frames are pymodbus'."""

import struct
from math import isfinite
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from bench_service.drivers.answers import BadAnswer

Address = Annotated[int, Field(ge=0, le=65535)]
WORDS = {"float32": 2, "int16": 1, "uint16": 1, "int32": 2}


class Register(BaseModel):
    """A value in one or two Modbus registers of 16 bits: address, table, type, orders, scale."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    address: Address
    type: Literal["float32", "int16", "uint16", "int32"] = "float32"
    table: Literal["holding", "input"] = "holding"
    word_order: Literal["big", "little"] = "big"
    """Order of the two registers of a number: "big" has the more significant one first."""
    byte_order: Literal["big", "little"] = "big"
    """Order of the two bytes in a register; "big" is the standard's."""
    scale: float = Field(default=1.0, gt=0.0, lt=1e9)
    """Value of one count of an integer; 1 for floats."""

    @property
    def words(self) -> int:
        """Number of registers that the value takes."""
        return WORDS[self.type]

    def decode(self, registers: list[int]) -> float:
        """Return the value in the registers. Raises `BadAnswer` where their number or a value is
        wrong, or the result is not finite."""
        if len(registers) != self.words or any(not 0 <= word <= 0xFFFF for word in registers):
            raise BadAnswer(f"{registers!r} are not the {self.words} registers at {self.address}")
        words = registers if self.word_order == "big" else registers[::-1]
        data = b"".join(word.to_bytes(2, self.byte_order) for word in words)
        (value,) = struct.unpack(self._form, data)
        if not isfinite(value):
            raise BadAnswer(f"register {self.address} holds no finite number")
        return float(value) * self.scale

    def encode(self, value: float) -> list[int]:
        """Return the registers that hold a value. Raises `ValueError` where they cannot hold it."""
        if not isfinite(value):
            raise ValueError(f"{value!r} is not a number that a register can hold")
        counts: float = value / self.scale
        try:
            data = struct.pack(self._form, counts if self.type == "float32" else round(counts))
        except (struct.error, OverflowError):
            raise ValueError(f"{value!r} does not fit into register {self.address} ({self.type})") from None
        words = [int.from_bytes(data[at : at + 2], self.byte_order) for at in range(0, len(data), 2)]
        return words if self.word_order == "big" else words[::-1]

    @property
    def _form(self) -> str:
        return {"float32": ">f", "int16": ">h", "uint16": ">H", "int32": ">i"}[self.type]


class Bit(BaseModel):
    """One bit of a Modbus register: address, place, table."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    address: Address
    bit: int = Field(ge=0, le=15)
    table: Literal["holding", "input"] = "holding"

    def of(self, word: int) -> bool:
        """Return whether the bit is set in its register's word."""
        return bool(word >> self.bit & 1)

    def changed(self, word: int, on: bool) -> int:
        """Return the register's word with this bit set or cleared, the others as they were."""
        return word | 1 << self.bit if on else word & ~(1 << self.bit)


class ChamberMap(BaseModel):
    """Registers of a chamber: actual temperature, set point, running, and others that it may have."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    unit: int = Field(default=1, ge=0, le=255)
    framing: Literal["tcp", "rtu"] = "tcp"
    """Framing inside TCP: that of Modbus TCP, or that of a serial line."""
    actual: Register
    set_point: Register
    running: Bit
    ramp: Register | None = None
    """Ramp [K/min]; None: the chamber keeps its own, and a slower one is refused."""
    own_ramp_c_min: float = Field(default=5.0, gt=0.0)
    """Ramp that the chamber keeps by itself where there is no register for it."""
    door: Bit | None = None
    alarm: Bit | None = None
