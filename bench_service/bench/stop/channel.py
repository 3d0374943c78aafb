"""The stop channel of a bench, outside every database: a file and sockets that worker and supervisor watch.

A file of fixed length (`bench-<id>.stop`) holds the stop requests and the answers of worker and supervisor; its
records are written in place. Each of the two also has a Unix datagram socket, which wakes it, and which carries the
request where the file cannot be written. None of this needs a free byte, a free inode, a database or a network.

A stop request (`StopWord`) is asked (it is in the channel), then seen (by the driving process, or by the supervisor),
then safe (the devices report it). Light on purpose: `bench stop` imports this and little else.
"""

import fcntl
import json
import logging
import os
import socket
from collections import deque
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import Any

from bench_service.bench.records_in_place import (
    RECORD_BYTES,
    Unreadable,
    encoded,
    preallocate,
    read_record,
    write_record,
)
from bench_service.bench.stop.channel_records import document_in, flocked, words_in
from bench_service.bench.stop.folder_sockets import bound, send
from bench_service.bench.stop.word import DAMAGED, StopAnswer, StopWord
from bench_service.wall_clock import monotonic_s, pause

WORDS = 16
"""Maximum number of stops in the file; worker and supervisor keep as many more in memory, and leave out the rest."""
WORKER, SUPERVISOR = 0, 1
"""Roles that answer a stop; each is also the number of its answer's record."""
_FIRST = 2
"""Record number of the first stop request."""
LOCK_S = 0.2
"""Maximum time that a writer waits for another one [s]; a suspended process may hold the lock for ever."""
log = logging.getLogger(__name__)


class StopChannel:
    """The stop channel of one bench on its host: the file with its stop requests and answers, and the sockets that wake
    its readers. Every verb is bounded by the file system's own time.
    """

    def __init__(self, folder: Path, bench_id: str) -> None:
        self.bench_id = bench_id
        self._folder = folder
        self._path = folder / f"bench-{bench_id}.stop"
        self._names = (f"bench-{bench_id}.stop-worker", f"bench-{bench_id}.stop-supervisor")
        self._file: int | None = None
        self._came: dict[str, StopWord] = {}
        """Stop requests that came by the socket and could not be written into the file."""
        self._not_kept: deque[str] = deque(maxlen=WORDS)
        """Ids of stop requests by this process for which the file has no room."""
        self._last: tuple[bytes, tuple[StopWord, ...]] = (b"", ())
        self._answers = [StopAnswer(), StopAnswer()]
        self._mutex = Lock()

    @property
    def exists(self) -> bool:
        """True where the bench has, or had, a process on this host."""
        devices = self._folder / f"bench-{self.bench_id}.devices"
        return os.path.exists(self._path) or os.path.exists(devices)  # unlike `Path.exists`, false for another's folder

    def prepare(self) -> None:
        """Make the file with its full length. Raises `OSError` where there is no room."""
        self._folder.mkdir(parents=True, exist_ok=True)
        file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            preallocate(file, _FIRST + WORDS)
        finally:
            os.close(file)

    def ask(self, word: StopWord) -> bool:
        """Enter a stop request; return True where worker or supervisor will see it. Raises nothing."""
        written = False
        with suppress(OSError):
            if not self._write(word):
                self._not_kept.append(word.id)
            written = True  # also without room: only a reason is lost, the bench is stopped
        sent = self._send({"stop": word.document()})
        return written or sent

    def wake(self) -> bool:
        """Wake the bench's worker, so that it looks into its queue; return True where a worker listens."""
        return self._send({"wake": True}, (WORKER,))

    def standing(self) -> tuple[StopWord, ...]:
        """Return the stop requests not yet released, oldest first. Raises nothing: an unreadable record stops the
        bench.
        """
        try:
            found = self._read()
        except FileNotFoundError:
            found = ()
        except OSError as error:
            log.warning("the stop channel of bench %s cannot be read: %s", self.bench_id, error)
            found = self._last[1]
        there = {word.id for word in found}
        came = [word for word in list(self._came.values()) if word.id not in there]
        return tuple(sorted((*found, *came), key=lambda word: word.at))

    def mark_booked(self, ids: Iterable[str]) -> None:
        """Mark the stop requests with these ids as stored in the database."""
        self._change(ids, lambda word: replace(word, booked=True))

    def clear(self, ids: Iterable[str]) -> None:
        """Remove the stop requests with these ids from the file, because they were released."""
        self._change(ids, lambda _: None)

    def replace_damaged(self) -> None:
        """Put a stop of its own, which the database can have and a person release, in place of an unreadable record.

        Nobody else writes meanwhile, so of two processes that do it at once one finds nothing left to replace.
        """
        if all(word.id != DAMAGED.id for word in self.standing()):
            return
        with suppress(OSError), self._locked() as file:
            for number in range(_FIRST, _FIRST + WORDS):
                found = document_in(file, number)
                if found is not None and found["id"] == DAMAGED.id:
                    record = encoded(StopWord(DAMAGED.reason, DAMAGED.by, DAMAGED.via).document())
                    assert record is not None, "its texts are short"
                    write_record(file, number, record)

    def answer(self, role: int, answer: StopAnswer) -> None:
        """Write the answer of worker or supervisor (`role`) to the stop requests: ids of those seen, and of those after
        which the bench is safe.

        An unchanged answer is not written. One that cannot be written is logged; the next call tries again.
        """
        if answer == self._answers[role]:
            return
        record = encoded({"by": answer.by, "seen": sorted(answer.seen), "safe": sorted(answer.safe)})
        assert record is not None, "at most 2 * WORDS ids of 36 characters, twice"
        try:
            write_record(self._open(), role, record)
        except OSError as error:
            log.warning("the answer to a stop of bench %s cannot be written: %s", self.bench_id, error)
            return
        self._answers[role] = answer

    def answered(self, role: int) -> StopAnswer:
        """Return the last answer of worker or supervisor; an empty one where none can be read. Raises nothing."""
        try:
            found = read_record(self._open(), role)
        except (OSError, Unreadable):
            found = None
        if found is None:
            return StopAnswer()
        return StopAnswer(found["by"], frozenset(found["seen"]), frozenset(found["safe"]))

    def state(self, word_id: str) -> str:
        """Return the state of a stop request by the answers to it: "asked", "seen" or "safe". One without a record is
        as far as the least of those that stand.
        """
        answers = [self.answered(role) for role in (WORKER, SUPERVISOR)]
        safe, seen, ids = answers[0].safe | answers[1].safe, answers[0].seen | answers[1].seen, {word_id}
        if word_id in self._not_kept and word_id not in seen:
            ids = {word.id for word in self.standing()} or ids
        return "safe" if ids <= safe else "seen" if ids <= seen | safe else "asked"

    def listen(self, role: int) -> socket.socket | None:
        """Open the receiving socket of `role`, worker or supervisor; None where none can be opened."""
        try:
            return bound(self._folder, self._names[role])
        except OSError as error:
            log.warning("bench %s has no socket for a stop, only the file is used: %s", self.bench_id, error)
            return None

    def receive(self, listening: socket.socket) -> bool:
        """Take all messages that came, and write stop requests into the file; return True where one was a wake-up call.
        Never waits.
        """
        woken = False
        while True:
            try:
                message = json.loads(listening.recv(2 * RECORD_BYTES))
                woken = woken or bool(message.get("wake"))
                if "stop" in message:
                    self._take(StopWord.of(message["stop"]))
            except BlockingIOError:
                return woken
            except (ValueError, TypeError, KeyError, AttributeError) as error:
                log.warning("bench %s received a message that is not a stop: %s", self.bench_id, error)
            except OSError as error:
                log.warning("the stop socket of bench %s: %s", self.bench_id, error)
                return woken

    def close(self) -> None:
        """Close the channel's file; the next verb opens it again."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def _take(self, word: StopWord) -> None:
        try:
            if self._write(word):
                return
        except OSError as error:
            log.warning("a stop of bench %s is kept in memory: %s", self.bench_id, error)
        if len(self._came) < WORDS:
            self._came[word.id] = word

    def _open(self) -> int:
        if self._file is None:
            self._file = os.open(self._path, os.O_RDWR | os.O_CLOEXEC)
        return self._file

    @contextmanager
    def _locked(self) -> Generator[int]:
        """Lock the file; after `LOCK_S` continue without the lock: at worst a reason is lost, never a stop."""
        file, deadline = self._open(), monotonic_s() + LOCK_S
        mine = self._mutex.acquire(timeout=LOCK_S)
        try:
            while not flocked(file) and monotonic_s() < deadline:
                pause(0.002)
            yield file
        finally:
            fcntl.flock(file, fcntl.LOCK_UN)
            if mine:
                self._mutex.release()

    def _read(self) -> tuple[StopWord, ...]:
        """Read the stop requests; they are parsed again only after a change."""
        size, page = WORDS * RECORD_BYTES, b""
        for _ in range(20):
            page = os.pread(self._open(), size, _FIRST * RECORD_BYTES)
            if page == self._last[0]:
                return self._last[1]
            with suppress(Unreadable):
                words = words_in(page)
                self._last = (page, words)
                return words
            pause(0.001)
        return (*words_in(page, leave_out_damaged=True), DAMAGED)

    def _write(self, word: StopWord) -> bool:
        """Write into the first free record; False where none is free."""
        with self._locked() as file:
            free: int | None = None
            for number in range(_FIRST, _FIRST + WORDS):
                found = document_in(file, number)
                if found is not None and found["id"] == word.id:
                    return True
                if found is None and free is None:
                    free = number
            if free is None:
                log.warning(
                    "the file of bench %s has %d stops; one more by %s has no room", self.bench_id, WORDS, word.by
                )
                return False
            record = encoded(word.document())
            assert record is not None, "its texts are cut"
            write_record(file, free, record)
            return True

    def _change(self, ids: Iterable[str], change: Callable[[StopWord], StopWord | None]) -> None:
        wanted = set(ids)
        if not wanted:
            return
        for word_id in wanted & set(self._came):  # never away for a moment: the guard's thread reads it meanwhile
            changed = change(self._came[word_id])
            if changed is None:
                del self._came[word_id]
            else:
                self._came[word_id] = changed
        try:
            self._change_file(wanted, change)
        except FileNotFoundError:
            return
        except OSError as error:  # no descriptor left, or another user's file: a later comparison does it
            log.warning("the stop channel of bench %s cannot be changed: %s", self.bench_id, error)

    def _change_file(self, wanted: set[str], change: Callable[[StopWord], StopWord | None]) -> None:
        with self._locked() as file:
            for number in range(_FIRST, _FIRST + WORDS):
                found = document_in(file, number)
                if found is not None and found["id"] in wanted:
                    changed = None if found["id"] == DAMAGED.id else change(StopWord.of(found))
                    record = b"\0" * RECORD_BYTES if changed is None else encoded(changed.document())
                    assert record is not None, "it was a record before"
                    write_record(file, number, record)

    def _send(self, message: dict[str, Any], roles: Iterable[int] = (SUPERVISOR, WORKER)) -> bool:
        body = json.dumps(message).encode()
        sent = [send(self._folder, self._names[role], body) for role in roles]
        return any(sent)
