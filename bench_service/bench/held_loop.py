"""Detection of a driver that holds the thread of its bench's event loop: no device of the bench is served meanwhile."""

import asyncio
from contextlib import suppress


class HeldLoop:
    """Measures for how long an event loop has run none of its tasks; for one thread, not the loop's own.

    A device may take the time that it is declared to need to be safe, and others are served meanwhile; a loop that is
    held serves none.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._turned = True
        self._held_s = 0.0

    def for_s(self, passed_s: float) -> float:
        """Return the time since the loop last ran a task [s], `passed_s` after the last look [s]."""
        if self._turned:
            self._turned, self._held_s = False, 0.0
            with suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(self._turn)
        else:
            self._held_s += passed_s
        return self._held_s

    def _turn(self) -> None:
        self._turned = True
