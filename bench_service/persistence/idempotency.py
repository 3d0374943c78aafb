"""Idempotency keys: a repeated create makes one object, since its key is stored in the same transaction."""

from collections.abc import Callable
from datetime import datetime
from typing import TypeVar

from sqlalchemy.orm import Session

from bench_service.model.errors import IdempotencyConflict
from bench_service.model.records import Idempotency
from bench_service.persistence.database import Conflict, Database
from bench_service.persistence.tables.jobs import IdempotencyKeyRow

T = TypeVar("T")

_MOST_RETRIES = 32
"""Maximum number of retries after conflicts; each conflict means that a concurrent transaction committed first."""


class SqlKeyStore:
    """SQL implementation of `bench_service.evidence.idempotency_keys.KeyStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def made(self, idempotency: Idempotency | None, kind: str) -> str | None:
        if idempotency is None:
            return None
        with self._database.read() as session:
            return made_before(session, idempotency, kind)


def made_before(session: Session, idempotency: Idempotency | None, kind: str) -> str | None:
    """Return the id of what the key made, or None. Raises `IdempotencyConflict` for a key of another request."""
    if idempotency is None:
        return None
    row = session.get(IdempotencyKeyRow, idempotency.key)
    if row is None:
        return None
    if (row.kind, row.fingerprint) != (kind, idempotency.fingerprint):
        used = f"the idempotency key {idempotency.key!r} was used before with another request"
        raise IdempotencyConflict(f"{used}: a new request needs a new key")
    return row.made_id


def remember(session: Session, idempotency: Idempotency | None, kind: str, made_id: str, at: datetime) -> None:
    """Store the key with its object's id. A concurrent transaction with the same key waits here, and then fails with
    `Conflict`.
    """
    if idempotency is not None:
        session.add(
            IdempotencyKeyRow(
                key=idempotency.key, kind=kind, fingerprint=idempotency.fingerprint, made_id=made_id, created_at=at
            )
        )
        session.flush()


def again_after_conflict(work: Callable[[], T]) -> T:
    """Retry a transaction after each conflict, up to 32 times, and return its result. The retry sees the row that the
    concurrent transaction stored.
    """
    for _ in range(_MOST_RETRIES):
        try:
            return work()
        except Conflict:
            continue
    return work()
