"""Work that a conductor has done beside itself: each piece in a thread of its own, so that it holds nothing else up.

Nothing is remembered over the end of the process: a piece must be safe to begin again under the same key.
"""

from collections.abc import Callable
from concurrent import futures
from contextvars import copy_context
from threading import Thread


class Beside:
    """Pieces of work that go on, and outcomes that nobody has asked for yet. For one thread that asks."""

    def __init__(self, tell: Callable[[], None]) -> None:
        """`tell`: called, in its thread, when a piece is done."""
        self._tell = tell
        self._pieces: dict[str, futures.Future[str]] = {}

    def outcome(self, key: str, work: Callable[[], str]) -> str | None:
        """What the piece of work gave, once; None while it goes on. Begins it where it does not. Raises what it raised.

        Asked again after that it begins anew.
        """
        piece = self._pieces.get(key)
        if piece is None:
            self._pieces[key] = self._begin(key, work)
            return None
        if not piece.done():
            return None
        del self._pieces[key]
        return piece.result()

    def wait(self, seconds: float) -> None:
        """Wait for what goes on, all in all for so long [s]; what lasts longer ends with the process."""
        futures.wait(self._pieces.values(), seconds)

    def _begin(self, key: str, work: Callable[[], str]) -> futures.Future[str]:
        """In a thread that the process does not wait for at its end, as it would for an executor's."""
        piece: futures.Future[str] = futures.Future()
        piece.add_done_callback(lambda _: self._tell())

        def run() -> None:
            try:
                piece.set_result(work())
            except Exception as failure:  # raised again where it is asked for
                piece.set_exception(failure)

        context = copy_context()  # lines of the log are about the same things
        Thread(target=context.run, args=(run,), name=f"beside {key}", daemon=True).start()
        return piece
