"""Accounts, tokens and sessions in memory: authentication never waits for the database.

A thread of its own looks every second whether something has changed, and reads all of it then; an unknown credential
has it look at once. While the database is away the last state stands: a known session or token still stops a bench.
"""

import logging
from concurrent.futures import Future, InvalidStateError
from contextlib import suppress
from dataclasses import replace
from datetime import datetime, timedelta
from threading import Event, Lock, Thread

from bench_service.access.credentials import AccessToken, Account, Session
from bench_service.access.stores import AccessStore, Snapshot
from bench_service.model.errors import ServiceError
from bench_service.wall_clock import now

LOOK_S = 1.0
"""Interval between two looks for changes by other processes [s]: a revocation takes effect within it."""
TOUCH = timedelta(seconds=60)
"""Interval at which the time of last use is stored."""
LEAVE_S = 1.0
"""Longest time that the end of the service waits for the thread [s]."""

log = logging.getLogger(__name__)


class AccessBook:
    """Accounts, tokens and sessions in the memory of one process, kept up to date by a thread; authentication reads
    them without the database.
    """

    def __init__(self, store: AccessStore) -> None:
        """Set up and read the state. Raises `StorageFailure`."""
        self._store = store
        self._state = store.load()
        self._mutex = Lock()
        self._waiting: list[Future[None]] = []
        self._woken = Event()
        self._ending = False
        self._thread: Thread | None = None
        self._used: dict[str, datetime] = {}
        self._used_tokens: dict[str, datetime] = {}
        self._touched_at = now()

    @property
    def state(self) -> Snapshot:
        """The newest known state of accounts, tokens and sessions."""
        return self._state

    @property
    def log_in_on(self) -> bool:
        """Return whether people must log in: from the first account on."""
        return bool(self._state.accounts)

    def begin(self) -> None:
        """Start the thread that follows the changes of other processes."""
        self._thread = Thread(target=self._run, name="access", daemon=True)
        self._thread.start()

    def end(self) -> None:
        """End the thread and wait for it, within a limit; one that hangs in the database is left."""
        self._ending = True
        self._woken.set()
        if self._thread is not None:
            self._thread.join(LEAVE_S)

    def read_again(self) -> None:
        """Read the state from the database now, after a change of this process. Raises `StorageFailure`."""
        self._take(self._store.load())

    def _take(self, state: Snapshot) -> None:
        """Take a state that was read, unless another thread has read a newer one meanwhile."""
        with self._mutex:
            if state.revision >= self._state.revision:
                self._state = state

    def refreshed(self) -> "Future[None]":
        """Have the state read by the thread; the future is done after that, or after a failure."""
        with self._mutex:
            if self._waiting:
                return self._waiting[0]
            waiting: Future[None] = Future()
            if self._thread is None or self._ending:
                waiting.set_result(None)
                return waiting
            self._waiting.append(waiting)
        self._woken.set()
        return waiting

    def account(self, name: str) -> Account | None:
        """Return the account of a name; None where there is none."""
        return self._state.accounts.get(name)

    def token(self, digest: str) -> AccessToken | None:
        """Return the token of a digest, valid or expired; None for one that is unknown or revoked."""
        return self._state.tokens.get(digest)

    def session(self, digest: str) -> Session | None:
        """Return the session of a digest with its last use, valid or expired; None for one that is unknown or was
        ended.
        """
        found = self._state.sessions.get(digest)
        used = self._used.get(digest)
        if found is None or used is None or used <= found.last_used_at:
            return found
        return replace(found, last_used_at=used)

    def note_use(self, session: str | None = None, token: str | None = None) -> None:
        """Remember that a session (digest) or a token (id) was used now; the thread stores it later."""
        if session is not None:
            self._used[session] = now()
        if token is not None:
            self._used_tokens[token] = now()

    def _run(self) -> None:
        said = ""
        while not self._ending:
            self._woken.wait(LOOK_S)
            self._woken.clear()
            with self._mutex:
                waiting, self._waiting = self._waiting, []
            try:
                self._look(at_once=bool(waiting))
                said = ""
            except ServiceError as error:
                if str(error) != said:
                    log.warning("accounts and tokens cannot be read, the last known ones stay in use: %s", error)
                said = str(error)
            except Exception:  # a defect here must not leave requests waiting
                log.exception("accounts and tokens could not be read")
            for each in waiting:
                with suppress(InvalidStateError):  # the process that waited has gone
                    each.set_result(None)

    def _look(self, at_once: bool) -> None:
        if at_once or self._store.revision() != self._state.revision:
            self._take(self._store.load())
        if now() - self._touched_at >= TOUCH and (self._used or self._used_tokens):
            self._touched_at = now()
            used, tokens = dict(self._used), dict(self._used_tokens)
            self._store.touch(used, tokens)
            self._take(self._store.load())
            for known, stored in ((self._used, used), (self._used_tokens, tokens)):
                for key, at in stored.items():
                    if known.get(key) == at:
                        del known[key]
