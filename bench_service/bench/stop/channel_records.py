"""Records in the file of a stop channel as stop requests, and the file's lock.

A record of another version, which is no stop request, is as unreadable as a torn one.
"""

import fcntl
from typing import Any

from bench_service.bench.records_in_place import RECORD_BYTES, Unreadable, decoded, read_record
from bench_service.bench.stop.word import DAMAGED, StopWord


def words_in(page: bytes, leave_out_damaged: bool = False) -> tuple[StopWord, ...]:
    """Return the stop requests in a page of records. Raises `Unreadable` for a damaged record, unless
    `leave_out_damaged`.
    """
    found: list[StopWord] = []
    for at in range(0, len(page), RECORD_BYTES):
        try:
            document = decoded(page[at : at + RECORD_BYTES])
            if document is not None:
                found.append(_word(document))
        except Unreadable:
            if not leave_out_damaged:
                raise
    return tuple(found)


def document_in(file: int, number: int) -> dict[str, Any] | None:
    """Return the document of the stop request in a record, None for an empty record; one that is unreadable counts as
    damaged. Raises `OSError`.
    """
    try:
        found = read_record(file, number)
        return found if found is None else _word(found).document()
    except Unreadable:
        return {"id": DAMAGED.id}


def flocked(file: int) -> bool:
    """Lock a stop channel's file against other processes; False where another one has the lock. Never waits."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _word(document: dict[str, Any]) -> StopWord:
    try:
        return StopWord.of(document)
    except (TypeError, ValueError, KeyError, AttributeError):
        raise Unreadable from None
