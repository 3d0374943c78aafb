"""One who listens to a job's events, and how what he is told is written."""

import asyncio
from collections import deque
from typing import Protocol

from bench_service.bench.live.values import BenchLive
from bench_service.model.job import Event


class Frames(Protocol):
    """How what listeners are told is written."""

    @property
    def quiet(self) -> bytes:
        """Nothing has happened for a while."""
        ...

    @property
    def dropped(self) -> bytes:
        """The listener was too slow; this is the last it hears."""
        ...

    def event(self, event: Event) -> bytes: ...

    def live(self, live: BenchLive) -> bytes: ...


class Listener:
    """What waits for him, and whether it ends."""

    def __init__(self, after: int, joined_at: int, lag: int) -> None:
        """`after`: sequence of the last event that he knows. `joined_at`: that of the last one when he came."""
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
        """Queue an event. False where too many wait already: the listener is dropped, and its queue let go."""
        if len(self._frames) >= self._lag:
            self.dropped = self.ended = True
            self._frames.clear()
        else:
            self._frames.append((sequence, frame))
        self._wake()
        return not self.dropped

    def put_word(self, frame: bytes) -> None:
        """What has no sequence: only the newest such word waits."""
        self._word = frame
        self._wake()

    def beat(self, quiet: bytes) -> None:
        """Say that nothing has happened, where nothing was put since the last beat."""
        if not self._told:
            self.put_word(quiet)
        self._told = False

    def end(self) -> None:
        """Nothing more will come."""
        self.ended = True
        self._wake()

    async def next(self) -> bytes:
        """All that waits, in one piece, as soon as anything does; empty: the end."""
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
