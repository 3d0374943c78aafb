"""A listener to a job's events, and the format of the messages that it gets."""

import asyncio
from collections import deque
from typing import Protocol

from bench_service.bench.live.values import BenchLive
from bench_service.model.job import Event


class Frames(Protocol):
    """The wire format of the messages to listeners; the API implements it as server-sent events. Interface."""

    @property
    def quiet(self) -> bytes:
        """Return the message that is sent as a heartbeat while nothing happens."""
        ...

    @property
    def dropped(self) -> bytes:
        """Return the last message to a listener that was dropped because it was too slow."""
        ...

    def event(self, event: Event) -> bytes: ...

    def live(self, live: BenchLive) -> bytes: ...


class Listener:
    """Queue of messages to one listener, bounded: a listener that is too slow is dropped."""

    def __init__(self, after: int, joined_at: int, lag: int) -> None:
        """Set up for a client that has events up to `after`; `joined_at`: the newest sequence when it joined."""
        self.after = after
        self.joined_at = joined_at
        self.ended = False
        self.dropped = False
        self._lag = lag
        self._frames: deque[tuple[int, bytes]] = deque()
        self._word: bytes | None = None
        self._told = True
        self._woken = asyncio.Event()

    def put(self, sequence: int, frame: bytes) -> bool:
        """Queue an event's message; return False where the queue is full: the listener is dropped, and its queue
        emptied.
        """
        if len(self._frames) >= self._lag:
            self.dropped = self.ended = True
            self._frames.clear()
        else:
            self._frames.append((sequence, frame))
        self._wake()
        return not self.dropped

    def put_word(self, frame: bytes) -> None:
        """Queue a message without sequence: only the newest such message waits."""
        self._word = frame
        self._wake()

    def beat(self, quiet: bytes) -> None:
        """Queue a heartbeat, where nothing was queued since the last one."""
        if not self._told:
            self.put_word(quiet)
        self._told = False

    def end(self) -> None:
        """Mark the end: no more messages will come."""
        self.ended = True
        self._wake()

    async def next(self) -> bytes:
        """Wait until there is a message, and return all waiting ones in one piece; empty bytes at the end."""
        while True:
            frames = [frame for sequence, frame in self._frames if sequence > self.after]
            if self._frames:
                self.after = max(self.after, self._frames[-1][0])
                self._frames.clear()
            if self._word is not None and not self.ended:
                frames.append(self._word)
            self._word = None
            if frames or self.ended:
                return b"".join(frames)
            self._woken.clear()
            await self._woken.wait()

    def _wake(self) -> None:
        self._told = True
        self._woken.set()
