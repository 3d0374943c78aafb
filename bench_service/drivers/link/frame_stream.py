"""The stream of a unit's frames: one thread that listens, decodes and checks, and recordings that read from it.

What is lost is never filled in: a recording over a gap, a spoiled frame, invalid data or a cut line ends with the
counter of the frame.
"""

import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench_service import wall_clock
from bench_service.drivers.answers import BadAnswer, Refusal
from bench_service.drivers.interface.address import Address
from bench_service.drivers.link.transport import LineCut, Transport, open_transport
from bench_service.drivers.protocols.stream import Continuity, Decoded, StreamDecoder
from procedures.bench.errors import BenchError, DeviceFault, Disconnected

AGAIN_S = 0.5
"""Time between two tries to open a line [s]."""
LISTEN_S = 0.01
"""Pause in which frames gather, so that they are decoded many at a time [s]."""
MOST_AT_ONCE = 1 << 18
"""Number of gathered bytes from which they are decoded without waiting for more."""
Opening = Callable[[Transport], StreamDecoder]
"""Opens the conversation on a new line and returns a decoder. Raises `LineCut`, `BadAnswer`, `Refusal`."""


@dataclass
class Tape:
    """Frames that one recording has not read yet, at most `most` of them, and the failure that ended it."""

    most: int
    """Largest number of frames that may wait."""
    begin_s: float = 0.0
    """Moment at which the recording begins, on the monotonic clock [s]: frames of samples before it are left out."""
    interval_s: float = 0.0
    """Real time from one frame to the next [s]; 0: not known, and no frame is left out."""
    blocks: deque[NDArray[np.int32]] = field(default_factory=deque[NDArray[np.int32]])
    held: int = 0
    failure: BenchError | None = None
    begun: bool = False
    """True once the recording has got a frame: frames lost before that do not count as lost."""

    def before(self, frames: int, now_s: float) -> int:
        """Return how many of the frames that were decoded just now were sampled before the recording's beginning; the
        oldest are.

        Frames gather for `LISTEN_S` before they are decoded, so the first ones may be as much older. The sample of the
        k-th last of them began ``k·interval_s`` ago, but for the line's own delay and for half an interval.
        """
        if self.begun or self.interval_s == 0.0:
            return 0
        return frames - min(frames, max(0, round((now_s - self.begin_s) / self.interval_s)))

    def take(self, count: int) -> NDArray[np.int32]:
        """Remove the oldest frames, at most `count`, and return their counts, (n, channels)."""
        parts: list[NDArray[np.int32]] = []
        while self.blocks and count > 0:
            block = self.blocks.popleft()
            if len(block) > count:
                self.blocks.appendleft(block[count:])
                block = block[:count]
            parts.append(block)
            count -= len(block)
            self.held -= len(block)
        return np.concatenate(parts)


class FrameStream:
    """Listens to a unit in a thread from the first use on, and opens its line again where it is lost between two
    recordings.
    """

    def __init__(
        self,
        address: Address,
        opening: Opening,
        connect_s: float,
        note: Callable[[str, Mapping[str, Any]], None],
    ) -> None:
        self._address, self._opening, self._connect_s, self._note = address, opening, connect_s, note
        self._lock = threading.Lock()
        self._tapes: list[Tape] = []
        self._thread: threading.Thread | None = None
        self._closing = threading.Event()
        self._decoder: StreamDecoder | None = None
        self._line: Transport | None = None
        self._problem = "no frame has come yet"
        self._spoiled = 0
        self.frames = 0
        """Number of frames that have come over all lines."""
        self.last_frame_s = 0.0
        """Moment of the newest frame on the monotonic clock [s]; 0 before the first one."""
        self.last_valid_s = 0.0
        """Moment of the newest frames of which the last one is valid [s]; 0 before the first ones."""
        self._gathered_s = 0.0
        """Moment at which the newest bytes had come [s]."""
        self._newest: tuple[tuple[str, str, tuple[str, ...]], ...] = ()

    @property
    def named(self) -> str:
        """The link in messages."""
        return f"the unit link at {self._address}"

    @property
    def problem(self) -> str:
        """Reason for which no frames come, as a sentence; empty while the line is open."""
        return self._problem

    def begin(self) -> None:
        """Start the thread that listens; idempotent. Raises `Disconnected` after `close`."""
        if self._closing.is_set():
            raise Disconnected(f"{self.named} was closed by the service")
        with self._lock:
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name=self.named, daemon=True)
                self._thread.start()

    def words(self) -> tuple[tuple[str, str, tuple[str, ...]], ...]:
        """Return the status words of the newest frame: name, text, names of the bits that are set."""
        return self._newest

    def record(self, tape: Tape) -> None:
        """Append the frames that come from now on to a recording's tape."""
        with self._lock:
            self._tapes.append(tape)

    def end(self, tape: Tape) -> None:
        """Append no more frames to a recording's tape; idempotent."""
        with self._lock:
            if tape in self._tapes:
                self._tapes.remove(tape)

    def close(self) -> None:
        """Stop listening without waiting; recordings under way raise `Disconnected`."""
        self._closing.set()
        line = self._line
        if line is not None:
            line.cut()
        self._fail(Disconnected(f"{self.named} was closed by the service"))

    def ended(self, within_s: float) -> bool:
        """Wait for the thread after `close`, at most `within_s`; return True if it has ended."""
        if self._thread is not None:
            self._thread.join(within_s)
        return self._thread is None or not self._thread.is_alive()

    def _run(self) -> None:
        while not self._closing.is_set():
            try:
                self._line = open_transport(self._address, self._connect_s)
                self._listen(self._line)
            except (LineCut, BadAnswer, Refusal) as lost:
                self._problem = str(lost)
                self._note("imu.line_lost", {"why": str(lost)})
                self._fail(Disconnected(f"{self.named} is cut: {lost}"))
            finally:
                if self._line is not None:
                    self._line.close()
                    self._line = None
            self._closing.wait(AGAIN_S)

    def _listen(self, line: Transport) -> None:
        decoder = self._opening(line)
        continuity = Continuity(decoder.modulus, decoder.step)
        self._decoder, self._problem = decoder, ""
        self._gathered_s = wall_clock.monotonic_s()
        self._note("imu.linked", {})
        waiting = decoder.feed(b"")
        while not self._closing.is_set():
            self._put(waiting, decoder, continuity)
            data = _gathered(line)
            self._gathered_s = wall_clock.monotonic_s()  # before they are decoded: the newest frame came just now
            waiting = decoder.feed(data)

    def _put(self, decoded: Decoded, decoder: StreamDecoder, continuity: Continuity) -> None:
        """Give frames to the recordings. One before which something is missing ends them."""
        self._spoiled += decoded.spoiled
        if len(decoded.counters) == 0:
            return
        gap = continuity.check(decoded.counters)
        self.frames += len(decoded.counters)
        self.last_frame_s = wall_clock.monotonic_s()
        self._newest = decoder.words(decoded.status[-1])
        if gap is not None:
            why = f"{gap} (a frame in between was damaged)" if self._spoiled else str(gap)
            self._note("imu.frames_lost", {"why": why})
            self._fail(Disconnected(f"{self.named}: {why}"), begun_only=gap.at == 0)
        self._spoiled = 0
        mask = decoder.invalid(decoded.status)
        if not mask[-1]:
            self.last_valid_s = self.last_frame_s
        invalid = np.flatnonzero(mask)
        if len(invalid):
            at = int(invalid[0])
            words = ", ".join(f"{name} {raw}" for name, raw, _ in decoder.words(decoded.status[at]))
            self._fail(
                DeviceFault(f"the unit says that its data are not valid, in frame {decoded.counters[at]}: {words}")
            )
        self._share(decoded)

    def _share(self, decoded: Decoded) -> None:
        with self._lock:
            for tape in self._tapes:
                if tape.failure is not None:
                    continue
                counts = decoded.counts[tape.before(len(decoded.counts), self._gathered_s) :]
                if len(counts) == 0:
                    continue
                tape.begun = True
                tape.blocks.append(counts)
                tape.held += len(counts)
                if tape.held > tape.most:
                    tape.failure = Disconnected(
                        f"{self.named}: more than {tape.most} frames waited to be recorded; the last one that was kept "
                        f"has counter {decoded.counters[-1]}"
                    )

    def _fail(self, failure: BenchError, begun_only: bool = False) -> None:
        with self._lock:
            for tape in self._tapes:
                if tape.begun or not begun_only:
                    tape.failure = tape.failure or failure


def _gathered(line: Transport) -> bytes:
    """Bytes that have come, with those that come shortly after: frames are decoded many at a time."""
    first = line.receive(0.2)
    if not first:
        return b""
    wall_clock.pause(LISTEN_S)
    parts, length = [first], len(first)
    while length < MOST_AT_ONCE and (more := line.receive(0.0)):
        parts.append(more)
        length += len(more)
    return b"".join(parts)
