"""Addresses of devices as a bench file writes them: TCP, UDP and serial."""

from dataclasses import dataclass
from typing import Literal
from urllib.parse import parse_qs, urlsplit

from bench_service.model.errors import Misconfigured

FORMS = "tcp://host:port, udp://host:port (the address to listen at) or serial:///dev/ttyS0?baud=9600"
BAUD = 9600
LONGEST = 512
"""Longest address that is read."""


@dataclass(frozen=True)
class Address:
    """Address of a device's line; `text` is what the bench file has and what messages name."""

    kind: Literal["tcp", "udp", "serial"]
    text: str
    host: str = ""
    port: int = 0
    path: str = ""
    baud: int = BAUD

    @property
    def droppable(self) -> bool:
        """True if a new connection leaves late answers behind; a serial line has none to drop."""
        return self.kind == "tcp"


def parse_address(text: str) -> Address:
    """Parse an address. Raises `Misconfigured` with the address and the forms that are allowed."""
    try:
        return _parsed(text)
    except ValueError as error:
        shown = text if len(text) <= 80 else f"{text[:80]}…"
        raise Misconfigured(f"address {shown!r}: {error}; an address is {FORMS}") from None


def _parsed(text: str) -> Address:
    if len(text) > LONGEST:
        raise ValueError(f"longer than {LONGEST} characters")
    parts = urlsplit(text)
    if parts.scheme in ("tcp", "udp"):
        if not parts.hostname or parts.port is None:
            raise ValueError("host or port is missing")
        if parts.path not in ("", "/") or parts.query or parts.username:
            raise ValueError("nothing may follow the port")
        if parts.port == 0:
            raise ValueError("port 0 is no port of a device")
        return Address("tcp" if parts.scheme == "tcp" else "udp", text, parts.hostname, parts.port)
    if parts.scheme == "serial":
        return _serial(text, parts.path, parse_qs(parts.query, strict_parsing=True) if parts.query else {})
    raise ValueError(f"kind {parts.scheme!r} is unknown" if parts.scheme else "its kind is missing")


def _serial(text: str, path: str, options: dict[str, list[str]]) -> Address:
    unknown = sorted(set(options) - {"baud"})
    if unknown:
        raise ValueError(f"option {unknown[0]!r} is unknown, there is only baud")
    if not path.startswith("/") or path == "/":
        raise ValueError("the device file is missing")
    given = options.get("baud", [str(BAUD)])[0]
    if not given.isdecimal() or not 50 <= int(given) <= 4_000_000:
        raise ValueError(f"baud = {given!r} is outside 50 … 4000000")
    return Address("serial", text, path=path, baud=int(given))
