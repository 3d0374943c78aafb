"""Transports that carry bytes: TCP, UDP, serial. Blocking, for a thread of their own."""

import select
import socket
from contextlib import suppress
from typing import Any, Protocol, cast

from bench_service.drivers.interface.address import Address

CHUNK = 65536


class LineCut(Exception):
    """Raised where the other end closed the line, or the line broke."""


class Transport(Protocol):
    """An open line of bytes: TCP, UDP or serial. Blocking. Interface."""

    def send(self, data: bytes) -> None:
        """Send all bytes. Raises `LineCut`: some of them may have arrived."""
        ...

    def receive(self, timeout_s: float) -> bytes:
        """Return the bytes that have arrived, waiting at most `timeout_s`; empty: none came. Raises `LineCut`."""
        ...

    def cut(self) -> None:
        """Break the line from another thread, so that a `receive` under way ends."""
        ...

    def close(self) -> None: ...


class SocketTransport:
    """Transport over a connected TCP socket, or over a UDP socket that listens."""

    def __init__(self, line: socket.socket, stream: bool) -> None:
        self._socket, self._stream = line, stream

    def send(self, data: bytes) -> None:
        """Send all bytes over the socket. Raises `LineCut`. Implements `Transport.send`."""
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise LineCut(reason(error)) from error

    def receive(self, timeout_s: float) -> bytes:
        """Return the bytes that have arrived, waiting at most `timeout_s`. Raises `LineCut`. Implements
        `Transport.receive`.
        """
        try:
            ready, _, _ = select.select([self._socket], [], [], max(0.0, timeout_s))
            if not ready:
                return b""
            data = self._socket.recv(CHUNK)
        except OSError as error:
            raise LineCut(reason(error)) from error
        if not data and self._stream:
            raise LineCut("the other end closed the connection")
        return data

    def cut(self) -> None:
        """Shut the socket down from another thread. Implements `Transport.cut`."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        self._socket.close()


class SerialTransport:
    """Transport over a serial port by pyserial, with one master."""

    def __init__(self, port: Any) -> None:
        self._port = port

    def send(self, data: bytes) -> None:
        """Send all bytes over the port. Raises `LineCut`. Implements `Transport.send`."""
        try:
            self._port.write(data)
            self._port.flush()
        except OSError as error:
            raise LineCut(reason(error)) from error

    def receive(self, timeout_s: float) -> bytes:
        """Return the bytes that have arrived, waiting at most `timeout_s`. Raises `LineCut`. Implements
        `Transport.receive`.
        """
        try:
            self._port.timeout = max(0.0, timeout_s)
            first = cast(bytes, self._port.read(1))
            return first + cast(bytes, self._port.read(self._port.in_waiting)) if first else b""
        except OSError as error:
            raise LineCut(reason(error)) from error

    def cut(self) -> None:
        """Cancel a reading under way from another thread. Implements `Transport.cut`."""
        with suppress(OSError):
            self._port.cancel_read()

    def close(self) -> None:
        self._port.close()


def open_transport(address: Address, timeout_s: float) -> Transport:
    """Open the line at an address and return it. Raises `LineCut` with the reason in words."""
    try:
        if address.scheme == "tcp":
            line = socket.create_connection((address.host, address.port), timeout=timeout_s)
            line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            line.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
            return SocketTransport(line, stream=True)
        if address.scheme == "udp":
            return SocketTransport(_listening(address), stream=False)
        return SerialTransport(_serial_port(address, timeout_s))
    except OSError as error:
        raise LineCut(reason(error)) from error


def _listening(address: Address) -> socket.socket:
    family, kind, protocol, _, place = socket.getaddrinfo(address.host, address.port, type=socket.SOCK_DGRAM)[0]
    line = socket.socket(family, kind, protocol)
    try:
        line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        line.bind(place)
    except OSError:
        line.close()
        raise
    return line


def _serial_port(address: Address, timeout_s: float) -> Any:
    import serial  # a bench without serial lines begins without it

    bits, parity, stops = address.format
    return serial.Serial(
        address.path,
        address.baud,
        int(bits),
        parity,
        int(stops),
        timeout=timeout_s,
        write_timeout=timeout_s,
        exclusive=True,
    )


def reason(error: OSError) -> str:
    """Return an error of the operating system in words, without numbers and class names."""
    if isinstance(error, TimeoutError):
        return "no device answers there"
    return (error.strerror or str(error) or type(error).__name__).lower()
