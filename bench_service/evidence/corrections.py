"""PORT of memory for the correction sets of units, stored with the result that gives them (`store.ResultStore.add`)."""

from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

from bench_service.model.records import Idempotency, Page
from procedures.core.unit_correction import CorrectionKind, UnitCorrection


@dataclass(frozen=True)
class StoredCorrection:
    """A correction set in a unit's history; of each kind one is current, or none."""

    id: str
    unit: str
    result_id: str
    made_at: datetime
    current: bool
    correction: UnitCorrection
    simulated: bool


class CorrectionStore(Protocol):
    """History and choice of correction sets. Every method is one transaction."""

    def list(
        self, unit: str, *, kind: CorrectionKind | None = None, after: str | None = None, limit: int = 50
    ) -> Page[StoredCorrection]:
        """A unit's corrections, newest first."""
        ...

    def get(self, unit: str, correction_id: str) -> StoredCorrection:
        """Return one correction by its id. Raises `NotFound`, also for a correction of another unit."""
        ...

    def current(self, unit: str, kind: CorrectionKind) -> StoredCorrection | None: ...

    def used_by(self, correction_id: str) -> tuple[str, ...]:
        """Ids of the results that rest on a correction, newest first."""
        ...

    def make_current(self, unit: str, correction_id: str, idempotency: Idempotency | None = None) -> StoredCorrection:
        """Choose the correction that new jobs use; it supersedes the current one of its kind.

        A known key with the same fingerprint changes nothing. Raises `NotFound`, `IdempotencyConflict`.
        """
        ...
