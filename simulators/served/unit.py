"""The unit's data link as it is served: a stream of frames while the unit has power, over TCP or UDP."""

import asyncio
import struct
from collections.abc import Callable, Iterable

import numpy as np

from simulators.imu.counter import Counts
from simulators.imu.tape import Tape
from simulators.served.faults import FaultPlan
from simulators.served.unit_frames import CountFrames, IxcomFrames

MOST_WAITING = 1 << 22
"""Bytes that may wait for a listener that does not read; one that falls further behind is cut off."""
COMMAND, RESPONSE, PARAMETER, IMURAW = 0xFD, 0xFE, 0xFF, 0x00
OK, INVALID_LOG, INVALID_RATE, INVALID_COMMAND, INVALID_ID, INVALID_CHANNEL = 0, 3, 4, 6, 7, 8


class Stream(Tape):
    """Tape that turns counts into frames at once and sends them."""

    def __init__(
        self, frames: IxcomFrames | CountFrames, rate_hz: float, since_s: Callable[[], float], valid_after_s: float
    ) -> None:
        """Set up; `since_s`: time since the launch, up to which data are marked as not valid before `valid_after_s`."""
        super().__init__(frames.columns)
        self.frames, self._rate_hz, self._since_s, self._valid_after_s = frames, rate_hz, since_s, valid_after_s
        self.counter = 0
        self.send: Callable[[bytes], None] = lambda _data: None
        self.plan = FaultPlan()

    def put(self, counts: Counts) -> None:
        """Send one frame a sample."""
        since = self._since_s() - len(counts) / self._rate_hz
        data = bytearray()
        for k, row in enumerate(np.asarray(counts)[:, : self.columns].tolist()):
            time_s = since + k / self._rate_hz
            data += self._frame(row, time_s)
        self.send(bytes(data))

    def _frame(self, row: list[int], time_s: float) -> bytes:
        fault = self.plan.next("unit_link")
        kind = "" if fault is None else fault.kind
        frame = self.frames.data(self.counter, row, time_s, time_s >= self._valid_after_s and kind != "invalid")
        self.counter += 1
        if kind == "lost_counter":
            return b""
        if kind == "wrong_crc":
            return frame[:-1] + bytes([frame[-1] ^ 0x01])
        if kind == "half":
            return frame[: len(frame) // 2]
        return frame + frame if kind == "doubled" else frame


class LinePort:
    """TCP port whose lines get the stream; a listener that does not read is cut off."""

    def __init__(self, stream: Stream) -> None:
        self._stream = stream
        self._lines: dict[asyncio.StreamWriter, int] = {}
        """Line -> channel of the protocol, -1 before one is open."""
        self._server: asyncio.Server | None = None

    async def open(self, host: str, port: int) -> int:
        """Open the port; 0: any free one. Returns its number."""
        self._server = await asyncio.start_server(self._serve, host, port)
        self._stream.send = self._send
        return self._server.sockets[0].getsockname()[1]

    async def close(self) -> None:
        """Close the port and its lines."""
        if self._server is not None:
            self._server.close()
        for line in tuple(self._lines):
            line.close()

    def cut(self) -> None:
        """Cut all lines of the unit."""
        for line in tuple(self._lines):
            line.transport.abort()

    def _listeners(self) -> Iterable[asyncio.StreamWriter]:
        """Lines that get the stream."""
        return self._lines

    def _send(self, data: bytes) -> None:
        for line in tuple(self._listeners()):
            if line.transport.get_write_buffer_size() > MOST_WAITING:
                line.transport.abort()
            elif data:
                line.write(data)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        raise NotImplementedError("each protocol reads its own lines")


class FramePort(LinePort):
    """Port that sends the stream to each line that is open; it reads nothing."""

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._lines[writer] = -1
        try:
            while await reader.read(4096):
                continue
        except ConnectionError:
            return
        finally:
            self._lines.pop(writer, None)
            writer.close()


class DatagramPort:
    """Sends each frame as one datagram to an address; a frame that nobody takes is lost, as on any UDP link."""

    def __init__(self, stream: Stream, length: int) -> None:
        self._stream, self._length = stream, length
        self._transport: asyncio.DatagramTransport | None = None

    async def open(self, host: str, port: int) -> int:
        """Begin to send to an address."""
        loop = asyncio.get_running_loop()
        self._transport, _ = await loop.create_datagram_endpoint(asyncio.DatagramProtocol, remote_addr=(host, port))
        self._stream.send = self._send
        return port

    async def close(self) -> None:
        """End sending and close the lines."""
        if self._transport is not None:
            self._transport.close()

    def cut(self) -> None:
        """Cut the line: nothing is sent any more."""
        self._stream.send = lambda _data: None

    def _send(self, data: bytes) -> None:
        if self._transport is not None:
            for at in range(0, len(data), self._length):
                self._transport.sendto(data[at : at + self._length])


class IxcomPort(LinePort):
    """Port of iXCOM: one logical channel, commands and parameters, and IMURAW once it was asked for."""

    TEXTS: tuple[tuple[int, str], ...] = ((0, "BENCH"), (1, "SIM-INAT"), (3, "2026"), (5, "1.0"), (6, "1.0"))

    def __init__(self, stream: Stream, serial: str, rate_hz: float) -> None:
        if not isinstance(stream.frames, IxcomFrames):
            raise TypeError("the stream holds no iXCOM frames")
        super().__init__(stream)
        self._frames, self._serial, self._rate_hz = stream.frames, serial, rate_hz
        self._logging: set[asyncio.StreamWriter] = set()

    def _listeners(self) -> Iterable[asyncio.StreamWriter]:
        return self._logging

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._lines[writer] = -1
        buffer = bytearray()
        try:
            while data := await reader.read(4096):
                buffer += data
                self._take(buffer, writer)
                await writer.drain()
        except ConnectionError:
            return
        finally:
            self._lines.pop(writer, None)
            self._logging.discard(writer)
            writer.close()

    def _take(self, buffer: bytearray, writer: asyncio.StreamWriter) -> None:
        while len(buffer) >= 20:
            length = int.from_bytes(buffer[4:6], "little")
            if buffer[0] != 0x7E or not 20 <= length <= 2048:
                del buffer[0]
                continue
            if len(buffer) < length:
                return
            message, payload = buffer[1], bytes(buffer[16 : length - 4])
            del buffer[:length]
            if message == COMMAND and len(payload) >= 4:
                self._respond(writer, self._command(writer, payload))
            elif message == PARAMETER and len(payload) >= 4:
                self._parameter(writer, payload)

    def _respond(self, writer: asyncio.StreamWriter, code: int) -> None:
        writer.write(self._frames.message(RESPONSE, 0, struct.pack("<HH", code, 0)))

    def _command(self, writer: asyncio.StreamWriter, payload: bytes) -> int:
        command = int.from_bytes(payload[:2], "little")
        if command == 5 and len(payload) >= 8:
            mode, channel = struct.unpack_from("<HH", payload, 4)
            if mode == 1 and channel in self._lines.values():
                return INVALID_CHANNEL
            self._lines[writer] = channel if mode == 1 else -1
            return OK
        if command != 0 or len(payload) < 10:
            return INVALID_COMMAND
        if self._lines[writer] < 0:
            return INVALID_CHANNEL
        message, _, action, divider = struct.unpack_from("<BBHH", payload, 4)
        if action == 0:
            if message != IMURAW:
                return INVALID_LOG
            if divider != 1:
                return INVALID_RATE
            self._logging.add(writer)
        elif action in (3, 4):
            self._logging.discard(writer)
        return OK

    def _parameter(self, writer: asyncio.StreamWriter, payload: bytes) -> None:
        number, action = int.from_bytes(payload[:2], "little"), payload[3]
        known = dict(self.TEXTS) | {2: self._serial}
        if action != 1 or (number not in known and number not in (11, 12)):
            self._respond(writer, INVALID_ID)
            return
        value = known[number].encode("ascii").ljust(32, b"\0") if number in known else b""
        if number in (11, 12):
            value = struct.pack("<HH", round(self._rate_hz) if number == 11 else 1, 0)
        self._respond(writer, OK)
        writer.write(self._frames.message(PARAMETER, 0, payload[:3] + b"\0" + value))
