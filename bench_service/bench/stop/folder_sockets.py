"""Unix datagram sockets in a folder: they carry short messages within one host, and need no free byte."""

import os
import socket
from contextlib import suppress
from pathlib import Path

LONGEST = 100
"""A longer path goes over the folder's descriptor: a socket's address holds 108 bytes, on some systems 104."""


def bound(folder: Path, name: str) -> socket.socket:
    """Return the receiving end of a datagram socket under a name in a folder, for this user alone; one that a dead
    process left is replaced. Raises `OSError`.
    """
    made = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
    try:
        with SocketAddress(folder, name) as address:
            Path(address).unlink(missing_ok=True)
            made.bind(address)
            os.chmod(address, 0o600)
    except OSError:
        made.close()
        raise
    made.setblocking(False)
    return made


def send(folder: Path, name: str, body: bytes) -> bool:
    """Send a message to the socket of that name without waiting; return True where a process receives it. Raises
    nothing.
    """
    with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as sender:
        sender.setblocking(False)
        with SocketAddress(folder, name) as address:
            sender.sendto(body, address)
            return True
    return False


class SocketAddress:
    """A socket's path, over the folder's descriptor where it is longer than a socket's address may be (108 bytes)."""

    def __init__(self, folder: Path, name: str) -> None:
        self._plain = str(folder / name)
        self._folder, self._name = folder, name
        self._descriptor: int | None = None

    def __enter__(self) -> str:
        if len(os.fsencode(self._plain)) < LONGEST or not Path("/proc/self/fd").exists():
            return self._plain
        self._descriptor = os.open(self._folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        return f"/proc/self/fd/{self._descriptor}/{self._name}"

    def __exit__(self, *_: object) -> None:
        if self._descriptor is not None:
            os.close(self._descriptor)
