"""Orderly end of a process that waits: SIGTERM and SIGINT set an event on which the process waits."""

import signal
import threading
from types import FrameType


def ending_on_signals() -> threading.Event:
    """Create an event that SIGTERM or SIGINT sets from now on. Must be called in the main thread."""
    ending = threading.Event()

    def end(_signal: int, _frame: FrameType | None) -> None:
        ending.set()

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, end)
    return ending
