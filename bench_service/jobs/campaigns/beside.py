"""Work that a conductor has done beside itself: each piece in a thread of its own, so that it holds nothing else up.

Nothing is remembered over the end of the process: a piece must be safe to begin again under the same key.
"""

from collections.abc import Callable
from concurrent import futures

from bench_service.jobs.background import in_background


class Beside:
    """Pieces of work that go on, and outcomes that nobody has asked for yet. For one thread that asks."""

    def __init__(self, tell: Callable[[], None]) -> None:
        """`tell`: called, in any thread, when a piece is done."""
        self._tell = tell
        self._pieces: dict[str, futures.Future[str]] = {}

    def outcome(self, key: str, work: Callable[[], str]) -> str | None:
        """What the piece of work gave, once; None while it goes on. Begins it where it does not. Raises what it raised.

        Asked again after that it begins anew.
        """
        piece = self._pieces.get(key)
        if piece is None:
            self._pieces[key] = in_background(f"beside {key}", work)
            self._pieces[key].add_done_callback(lambda _: self._tell())
            return None
        if not piece.done():
            return None
        del self._pieces[key]
        return piece.result()

    def wait(self, seconds: float) -> None:
        """Wait for what goes on, all in all for so long [s]; what lasts longer ends with the process."""
        futures.wait(self._pieces.values(), seconds)
