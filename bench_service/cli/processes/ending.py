"""Orderly end of a process on SIGTERM and SIGHUP (its terminal was closed), as on SIGINT (Ctrl-C).

A process that was started with SIGHUP ignored, as by `nohup`, goes on ignoring it. One whose terminal is gone writes
into nothing from then on.
"""

import os
import signal
import threading
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from types import FrameType
from typing import Any

OUTPUTS = (1, 2)
"""Descriptors of standard output and standard error."""
ENDS = (signal.SIGTERM, signal.SIGHUP)
"""Signals that end a process in order wherever Ctrl-C has a meaning of its own."""


def ending_on_signals() -> threading.Event:
    """Return an event that SIGTERM, SIGINT or SIGHUP sets from now on. Must be called in the main thread."""
    ending = threading.Event()
    _call_on((*ENDS, signal.SIGINT), ending.set)
    return ending


@contextmanager
def calling_at_end(end: Callable[[], object]) -> Generator[None]:
    """Run the block so that each SIGTERM and each SIGHUP calls `end`, which must not wait, instead of ending it.

    Without effect in a thread other than the main one.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = _call_on(ENDS, end)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def ending_like_ctrl_c() -> Generator[Callable[[], None]]:
    """Run the block so that the first SIGTERM or SIGHUP raises `KeyboardInterrupt` in it, as Ctrl-C does.

    Later ones are ignored, for terminal and shell both send one; so are all once the function that is given has been
    called: nothing may interrupt an end that makes a bench safe. Without effect in a thread other than the main one.
    """
    over = threading.Event()

    def interrupt() -> None:
        if not over.is_set():
            over.set()
            raise KeyboardInterrupt

    with calling_at_end(interrupt):
        yield over.set


def _call_on(numbers: Iterable[signal.Signals], act: Callable[[], object]) -> dict[signal.Signals, Any]:
    """Call `act` on these signals from now on, an ignored SIGHUP excepted; the handlers that there were."""
    terminals = [descriptor for descriptor in OUTPUTS if _is_terminal(descriptor)]

    def handle(number: int, _frame: FrameType | None) -> None:
        if number == signal.SIGHUP:
            _into_nothing(terminals)
        act()

    heard = [n for n in numbers if n != signal.SIGHUP or signal.getsignal(n) != signal.SIG_IGN]
    return {number: signal.signal(number, handle) for number in heard}


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
