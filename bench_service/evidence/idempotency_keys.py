"""Interface of the store of clients' idempotency keys, with the object that each key made."""

from typing import Protocol

from bench_service.model.records import Idempotency


class KeyStore(Protocol):
    """Store of clients' idempotency keys: which object each key made. Interface; the SQL is in `persistence`."""

    def made(self, idempotency: Idempotency | None, kind: str) -> str | None:
        """Id of the "job", "recording", "result", "campaign", "campaign_run", "schedule" or "batch" that a key
        made.

        None for a key that is new, and without one. Called before a request is examined: an object once made is
        returned, also where the same request would be refused now. Raises `IdempotencyConflict` for a key of another
        request.
        """
        ...
