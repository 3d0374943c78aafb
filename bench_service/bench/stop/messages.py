"""Messages of a stop on the wire, between an API and the supervisor of a bench on another host.

Lines of JSON over TCP. The supervisor begins with a number that it never uses again; the API's stop and the
supervisor's answer each carry an HMAC-SHA-256, under a secret that both have, over that number, one of the API's own,
and the text. So an intercepted stop cannot be replayed, an answer cannot be forged, and neither side
needs a correct clock. The text itself is no secret, and is not hidden.
"""

import hashlib
import hmac
import json
import os
import secrets
import socket
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench_service.wall_clock import monotonic_s

LINE_BYTES = 16_384
SECRET_BYTES = 16
"""A secret of the deployment has at least this length."""


class BadMessage(Exception):
    """Raised for a line that is not a valid message, comes too late, or whose proof does not hold."""


@dataclass(frozen=True)
class Listening:
    """The address of a supervisor's listener, and the name of its host for people."""

    address: str
    """The address as `host:port`."""
    host: str


def read_secret(file: Path) -> bytes | None:
    """Return the shared secret in a file; None where the file has no usable one. Raises nothing."""
    try:
        found = file.read_bytes().strip()
    except OSError:
        return None
    return found if len(found) >= SECRET_BYTES else None


def made_secret(file: Path) -> bytes | None:
    """Return the shared secret in a file; an absent file is written with a new secret. None where it cannot be
    written.
    """
    try:
        made = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    except OSError:  # it exists already, or the disk is full
        return read_secret(file)
    try:
        os.write(made, secrets.token_hex(32).encode() + b"\n")
    except OSError:  # no room: an empty file is no secret
        file.unlink(missing_ok=True)
    finally:
        os.close(made)
    return read_secret(file)


def new_number() -> str:
    """Return a random number in hexadecimal, to be used once in one exchange."""
    return secrets.token_hex(16)


def proof(secret: bytes, what: str, numbers: tuple[str, str], text: str) -> str:
    """Return the HMAC-SHA-256 over the kind of message, both numbers and the text, in hexadecimal."""
    return hmac.new(secret, "\n".join((what, *numbers, text)).encode(), hashlib.sha256).hexdigest()


def check(secret: bytes, what: str, numbers: tuple[str, str], message: dict[str, Any]) -> str:
    """Return the text of a message whose proof holds. Raises `BadMessage` for a wrong or missing proof."""
    text, given = message.get("text"), message.get("proof")
    if not isinstance(text, str) or not isinstance(given, str):
        raise BadMessage("a message needs the fields text and proof")
    if not hmac.compare_digest(given.encode(), proof(secret, what, numbers, text).encode()):
        raise BadMessage("the proof does not match: the sender has another secret")
    return text


def send_line(connection: socket.socket, message: dict[str, Any]) -> None:
    """Send a message as one line of JSON over a connection. Raises `OSError`."""
    connection.sendall(json.dumps(message).encode() + b"\n")


def receive_line(connection: socket.socket, by_s: float) -> dict[str, Any]:
    """Wait for one message and return it, complete by a deadline of the monotonic clock. Raises `BadMessage`,
    `OSError`.
    """
    found = b""
    while not found.endswith(b"\n"):
        left_s = by_s - monotonic_s()
        if left_s <= 0.0:
            raise BadMessage("no complete message came in time")
        connection.settimeout(left_s)
        piece = connection.recv(4096)
        found += piece
        if not piece or len(found) > LINE_BYTES:
            raise BadMessage("the connection was closed before the end of the line, or the line is too long")
    try:
        message = json.loads(found)
    except ValueError as error:
        raise BadMessage("the message is not JSON") from error
    if not isinstance(message, dict):
        raise BadMessage("the message is not a JSON object")
    return message


def split_address(address: str) -> tuple[str, int]:
    """Return host and port of the text `host:port`. Raises `ValueError` for any other text."""
    host, separator, port = address.rpartition(":")
    if not separator or not host or not port.isdecimal() or int(port) > 65_535:
        raise ValueError(f"{address!r} is not of the form host:port")
    return host.strip("[]"), int(port)
