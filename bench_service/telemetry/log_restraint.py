"""Restraint of the log: a line that repeats is written a few times and then counted, and no flood fills the disk.

Warnings and errors of one place with one text are written `FIRST` times in `WINDOW_S`; the next one after that time
says how many were left out. A library's lines count as equal by their place alone, whatever their text, because some
put a whole traceback into it. Beyond that no more lines are written than a full bucket of `BURST`, refilled at `STEADY`
a second.
"""

import logging
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock

from bench_service.wall_clock import monotonic_s

WINDOW_S = 60.0
FIRST = 5
"""Equal lines that are written in a window."""
STEADY = 50.0
"""Lines a second that are written however long a flood lasts."""
BURST = 2000.0
"""Lines that are written at once after a quiet time."""
MOST = 1000
"""Different lines that are counted, the latest ones."""
OWN = ("bench_service", "procedures", "simulators")


@dataclass
class _Count:
    since_s: float
    written: int = 0
    left_out: int = 0


class Restraint(logging.Filter):
    """Filter of one handler: decides which records are written, and notes in them what was left out before."""

    def __init__(self, clock: Callable[[], float] = monotonic_s) -> None:
        super().__init__()
        self._clock = clock
        self._mutex = Lock()
        self._counts: OrderedDict[tuple[str, int, str], _Count] = OrderedDict()
        self._room = BURST
        self._filled_s = clock()
        self._dropped = 0

    def filter(self, record: logging.LogRecord) -> bool:
        with self._mutex:
            now_s = self._clock()
            if record.levelno >= logging.WARNING and not self._is_new(record, now_s):
                return False
            return self._has_room(record, now_s)

    def _is_new(self, record: logging.LogRecord, now_s: float) -> bool:
        text = record.getMessage() if record.name.split(".")[0] in OWN else ""
        key = (record.pathname, record.lineno, text)
        count = self._counts.setdefault(key, _Count(now_s))
        self._counts.move_to_end(key)
        while len(self._counts) > MOST:
            self._counts.popitem(last=False)
        left_out = 0
        if now_s - count.since_s >= WINDOW_S:
            left_out = count.left_out
            count.since_s, count.written, count.left_out = now_s, 0, 0
        if count.written >= FIRST:
            count.left_out += 1
            return False
        count.written += 1
        if left_out:
            _note(record, f"(and {left_out} more like this in the {WINDOW_S:g} s before)")
        return True

    def _has_room(self, record: logging.LogRecord, now_s: float) -> bool:
        self._room = min(BURST, self._room + STEADY * (now_s - self._filled_s))
        self._filled_s = now_s
        if self._room < 1.0:
            self._dropped += 1
            return False
        self._room -= 1.0
        if self._dropped:
            _note(record, f"(after {self._dropped} lines that were too many to be written)")
            self._dropped = 0
        return True


def _note(record: logging.LogRecord, text: str) -> None:
    """Add a text to a record's message."""
    record.msg, record.args = f"{record.getMessage()} {text}", None
