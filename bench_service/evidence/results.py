"""Interface of the store of results, the calibrations and corrections that come with them, and lineage.

Every method is one transaction.
"""

from collections.abc import Sequence
from typing import Any, Protocol

from bench_service.model.records import Idempotency, Page, ResultValue, StoredResult
from bench_service.model.search import EVERYTHING, Search
from procedures.core.imu_model import TriadCalibration
from procedures.core.unit_correction import UnitCorrection


class ResultStore(Protocol):
    """Store of results of analyses with their lineage. Interface; the SQL is in `persistence`."""

    def add(
        self,
        result: StoredResult,
        calibrations: Sequence[TriadCalibration] = (),
        by_rule: bool = True,
        idempotency: Idempotency | None = None,
        corrections: Sequence[UnitCorrection] = (),
        content: str | None = None,
        reuse: bool = True,
    ) -> StoredResult:
        """Store a result with its lineage, calibrations and corrections, in one transaction.

        Calibrations, at most one of a triad, join the unit's history; where `by_rule` is true, those that
        `model.calibrations.takes_over` allows become current. The same rule holds for corrections, at most one of a
        kind.
        `content`: the digest of everything that the analysis read; with `reuse` a result of that content that is
        stored already is returned, and nothing is added.
        Raises `IdempotencyConflict`; a known key with the same fingerprint returns the first result.
        """
        ...

    def get(self, result_id: str) -> StoredResult:
        """Return one result by its id. Raises `NotFound`."""
        ...

    def of_content(self, content: str) -> StoredResult | None:
        """Return the stored result of a content digest, see `add`; None where there is none."""
        ...

    def list(
        self,
        *,
        job_id: str | None = None,
        unit: str | None = None,
        name: str | None = None,
        search: Search = EVERYTHING,
        after: str | None = None,
        limit: int = 50,
    ) -> Page[StoredResult]: ...

    def newest_verdict(self, unit: str, procedure: str, *, simulated: bool) -> StoredResult | None:
        """Return the newest result of the procedure that gave a job of the unit its verdict, no second analysis; None
        where there is none. `simulated`: results of a simulated bench, or of a real one.
        """
        ...

    def values(
        self,
        unit: str,
        procedure: str,
        quantity: str,
        *,
        simulated: bool,
        limit: int,
        before: str | None = None,
        parameters: dict[str, Any] | None = None,
    ) -> tuple[ResultValue, ...]:
        """The values of a quantity in the newest `limit` results of the procedure, simulated or real ones, newest
        first.

        Only results older than `before`, an id, and of a job with just these parameters, count, where these are given.
        """
        ...

    def of_recording(self, recording_id: str) -> tuple[str, ...]:
        """Return the ids of the results that used a recording."""
        ...
