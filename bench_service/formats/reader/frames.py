"""Frames on the socket between the service and the reading process: kind, length, and as many bytes."""

import json
import socket
import struct
from collections.abc import Callable
from typing import Any

HEAD = struct.Struct("!cI")
LARGEST = 64 * 1024 * 1024
"""Largest payload of a frame [bytes]; the child is not trusted."""

CHILD, FOUND, SAMPLES, END, REFUSED, PROPOSED = b"P", b"H", b"B", b"E", b"X", b"D"
"""Kinds of frames: the child's process id, the findings, samples row by row, their end, the refusal, or a proposal."""


class Broken(Exception):
    """Raised where the other side is gone, or sent no valid frame."""


def send(line: socket.socket, kind: bytes, payload: bytes | memoryview) -> None:
    """Send a frame of a kind over the line. Raises `OSError`."""
    line.sendall(HEAD.pack(kind, len(payload)))
    line.sendall(payload)


def send_json(line: socket.socket, kind: bytes, document: Any) -> None:
    """Send a document as a frame. Raises `OSError`."""
    send(line, kind, json.dumps(document).encode())


def receive(line: socket.socket, before: Callable[[], None] = lambda: None) -> tuple[bytes, bytes]:
    """Wait for the next frame and return its kind and content; `before` is called ahead of each wait. Raises `Broken`,
    `TimeoutError`.
    """
    kind, length = HEAD.unpack(_exactly(line, HEAD.size, before))
    if length > LARGEST:
        raise Broken(f"a frame of {length} bytes")
    return kind, _exactly(line, length, before)


def _exactly(line: socket.socket, size: int, before: Callable[[], None]) -> bytes:
    data = bytearray(size)
    view, have = memoryview(data), 0
    while have < size:
        before()
        got = line.recv_into(view[have:])
        if not got:
            raise Broken("the other side is gone")
        have += got
    return bytes(data)
