"""Identity and status of a device: the part of the interface that every device has in common."""

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True)
class DeviceIdentity:
    """Identity of a device as it reports it itself; a field that it does not report is empty."""

    maker: str = ""
    model: str = ""
    serial: str = ""
    firmware: str = ""

    def __str__(self) -> str:
        told = " ".join(part for part in (self.maker, self.model) if part) or "a device without a name"
        serial = f", serial {self.serial}" if self.serial else ""
        return told + serial + (f", firmware {self.firmware}" if self.firmware else "")


@dataclass(frozen=True)
class StatusWord:
    """One status word of a device: as it was sent, and the names of its bits that are set."""

    name: str
    """Name of the word in the device's own manual, such as "*STB?" or "interlock 1"."""
    raw: str
    """The word as it was sent: text, or a number in hexadecimal such as "0x0041"."""
    bits: tuple[str, ...] = ()
    """Names of the bits that are set, by the manual; a bit without a name is "bit 6"."""

    def __str__(self) -> str:
        return f"{self.name} = {self.raw}" + (f" ({', '.join(self.bits)})" if self.bits else "")


Status = tuple[StatusWord, ...]
"""All status words of a device at one moment; empty where it has none."""


class Device(Protocol):
    """A device of a bench that can be asked for its identity. Base of the interfaces of table, chamber, supply, unit
    and source.
    """

    async def identify(self) -> DeviceIdentity:
        """Ask the device for its maker, model, serial and firmware, and return them. Raises `Disconnected`."""
        ...
