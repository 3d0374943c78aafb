"""Work that a conductor has done beside itself: each piece in a thread of its own, so that it holds nothing else up.

Nothing is remembered over the end of the process: a piece must be safe to begin again under the same key.
"""

from collections.abc import Callable
from contextvars import copy_context
from threading import Thread

from bench_service.wall_clock import monotonic_s


class Beside:
    """Pieces of work that go on, and outcomes that nobody has asked for yet. For one thread that asks."""

    def __init__(self, tell: Callable[[], None]) -> None:
        """`tell`: called, in its thread, when a piece is done."""
        self._tell = tell
        self._pieces: dict[str, _Piece] = {}

    def outcome(self, key: str, work: Callable[[], str]) -> str | None:
        """What the piece of work gave, once; None while it goes on. Begins it where it does not. Raises what it raised.

        Asked again after that it begins anew.
        """
        piece = self._pieces.get(key)
        if piece is None:
            piece = self._pieces[key] = _Piece(key, work, self._tell)
            return None
        if not piece.over:
            return None
        del self._pieces[key]
        if piece.failure is not None:
            raise piece.failure
        return piece.gave

    def wait(self, seconds: float) -> None:
        """Wait for what goes on, all in all for so long [s]; what lasts longer ends with the process."""
        deadline = monotonic_s() + seconds
        for piece in self._pieces.values():
            piece.thread.join(max(0.0, deadline - monotonic_s()))


class _Piece:
    """One piece of work, begun."""

    def __init__(self, key: str, work: Callable[[], str], tell: Callable[[], None]) -> None:
        self.gave: str | None = None
        self.failure: Exception | None = None
        self.over = False
        self._work = work
        self._tell = tell
        context = copy_context()  # lines of the log are about the same things
        self.thread = Thread(target=context.run, args=(self._run,), name=f"beside {key}", daemon=True)
        self.thread.start()

    def _run(self) -> None:
        try:
            self.gave = self._work()
        except Exception as failure:  # raised again where it is asked for
            self.failure = failure
        self.over = True
        self._tell()
