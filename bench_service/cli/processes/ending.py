"""Orderly end of a process on SIGTERM, SIGINT (Ctrl-C) and SIGHUP (its terminal was closed).

A process that was started with SIGHUP ignored, as by `nohup`, goes on ignoring it.
"""

import os
import signal
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from types import FrameType

OUTPUTS = (1, 2)
"""Descriptors of standard output and standard error."""


def ending_on_signals() -> threading.Event:
    """Return an event that SIGTERM, SIGINT or SIGHUP sets from now on. Must be called in the main thread."""
    ending = threading.Event()

    def end(_signal: int, _frame: FrameType | None) -> None:
        ending.set()

    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, end)
    return ending


@contextmanager
def ending_like_ctrl_c() -> Generator[Callable[[], None]]:
    """Run the block so that the first SIGTERM or SIGHUP raises `KeyboardInterrupt` in it, as Ctrl-C does.

    Later ones are ignored, for terminal and shell both send one; so are all once the function that is given has been
    called: nothing may interrupt an end that makes a bench safe. Without effect in a thread other than the main one.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda: None
        return
    terminals = [descriptor for descriptor in OUTPUTS if _is_terminal(descriptor)]
    numbers = [n for n in (signal.SIGTERM, signal.SIGHUP) if signal.getsignal(n) != signal.SIG_IGN]

    def ignore() -> None:
        for number in numbers:
            signal.signal(number, signal.SIG_IGN)

    def interrupt(number: int, _frame: FrameType | None) -> None:
        ignore()
        if number == signal.SIGHUP:
            _into_nothing(terminals)
        raise KeyboardInterrupt

    before = [(number, signal.signal(number, interrupt)) for number in numbers]
    try:
        yield ignore
    finally:
        for number, handler in before:
            signal.signal(number, handler)


def _is_terminal(descriptor: int) -> bool:
    try:
        return os.isatty(descriptor)
    except OSError:
        return False


def _into_nothing(descriptors: list[int]) -> None:
    """Lead output to a terminal that is gone into nothing: each line would fail, and end the process in mid-way."""
    nothing = os.open(os.devnull, os.O_WRONLY)
    for descriptor in descriptors:
        os.dup2(nothing, descriptor)
    os.close(nothing)
