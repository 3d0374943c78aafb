"""The cyclic garbage collector, kept out of the way while modules are imported.

An import makes objects that live as long as the process. The collector looks through all of them again and again while
they are made and finds none to free, a fifth of the time of a start. What was imported is then frozen: later
collections do not look through it either.
"""

import gc
from collections.abc import Generator
from contextlib import contextmanager
from threading import Lock

_mutex = Lock()
_paused = 0
"""Number of blocks, in whatever thread, that keep the collector away now."""


@contextmanager
def no_collection() -> Generator[None]:
    """Run the block without cyclic collection, then freeze what it made. For any thread, and for blocks in blocks."""
    pause()
    try:
        yield
    finally:
        resume()


def pause() -> None:
    """Switch the cyclic collector off until `resume` was called as often. For any thread."""
    global _paused
    with _mutex:
        _paused += 1
        gc.disable()


def resume() -> None:
    """Switch the cyclic collector on again, once no other block keeps it off; objects that exist now are left out of
    it.
    """
    global _paused
    with _mutex:
        _paused -= 1
        if _paused == 0:
            gc.freeze()
            gc.enable()
