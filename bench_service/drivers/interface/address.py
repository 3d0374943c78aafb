"""Address of a device on a wire: TCP, UDP or a serial line, as written in a bench file."""

import re
from dataclasses import dataclass
from typing import Annotated, Any, Literal
from urllib.parse import parse_qsl, urlsplit

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

FORM = "tcp://host:port, udp://host:port or serial:///dev/name?baud=9600&format=8N1"
SERIAL_FORMAT = re.compile(r"^[5-8][NEO][12]$")


@dataclass(frozen=True)
class Address:
    """Address of one device's line, in its parts: scheme, host and port, or path and baud rate."""

    scheme: Literal["tcp", "udp", "serial"]
    host: str = ""
    port: int = 0
    path: str = ""
    """Path of a serial line's device file."""
    baud: int = 9600
    format: str = "8N1"
    """Data bits, parity and stop bits of a serial line."""

    @classmethod
    def parse(cls, text: str) -> "Address":
        """Parse ``tcp://10.1.0.11:9878``, ``udp://0.0.0.0:7000`` or ``serial:///dev/ttyS0?baud=9600``.

        Raises `ValueError` with the form that is expected.
        """
        parts = urlsplit(text)
        if parts.scheme in ("tcp", "udp"):
            return cls._on_network(text, parts.scheme)
        if parts.scheme != "serial" or parts.netloc or not parts.path.startswith("/"):
            raise ValueError(f"{text!r} is not an address: give {FORM}")
        given = dict(parse_qsl(parts.query, strict_parsing=True)) if parts.query else {}
        if unknown := sorted(set(given) - {"baud", "format"}):
            raise ValueError(f"{text!r}: a serial line has no {unknown[0]!r}: give {FORM}")
        baud, form = given.get("baud", "9600"), given.get("format", "8N1")
        if not (baud.isascii() and baud.isdigit() and 50 <= int(baud) <= 12_000_000):
            raise ValueError(f"{text!r}: baud = {baud!r} must be a whole number from 50 to 12000000")
        if not SERIAL_FORMAT.match(form):
            raise ValueError(f"{text!r}: format = {form!r} must be such as 8N1")
        return cls("serial", path=parts.path, baud=int(baud), format=form)

    @classmethod
    def _on_network(cls, text: str, scheme: Literal["tcp", "udp"]) -> "Address":
        parts = urlsplit(text)
        try:
            port = parts.port
        except ValueError:
            port = None
        bare = parts.path in ("", "/") and not parts.query and parts.username is None
        if not parts.hostname or not port or not bare:
            raise ValueError(f"{text!r} is not an address: give {FORM}, the port from 1 to 65535")
        return cls(scheme, parts.hostname, port)

    def __str__(self) -> str:
        if self.scheme == "serial":
            return f"serial://{self.path}?baud={self.baud}&format={self.format}"
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}"


class _AsText:
    """Lets pydantic read an `Address` from its text."""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_after_validator_function(Address.parse, core_schema.str_schema())


AddressText = Annotated[Address, _AsText]
"""Field of a section that is written as text."""
