"""PORT of memory for the calibrations of units, one a triad: history, choice, and what people decided.

A calibration comes in with the result that gives it (`results.ResultStore.add`), or is entered by a person. Every
method is one transaction.
"""

from collections.abc import Sequence
from datetime import datetime
from typing import Protocol

from bench_service.model.calibrations import Decider, StoredCalibration
from bench_service.model.records import Idempotency, Page


class CalibrationStore(Protocol):
    """Store of calibrations: history, choice of the current one, decisions of people. Interface; the SQL is in
    `persistence`.
    """

    def list(
        self, unit: str, *, triad: str | None = None, after: str | None = None, limit: int = 50
    ) -> Page[StoredCalibration]:
        """Return one page of a unit's calibrations, of one triad or both, newest first."""
        ...

    def get(self, calibration_id: str) -> StoredCalibration:
        """Return one calibration by its id. Raises `NotFound`."""
        ...

    def several(self, ids: Sequence[str]) -> tuple[StoredCalibration, ...]:
        """Return the calibrations with these ids, in the order given. Raises `NotFound`."""
        ...

    def current(self, unit: str) -> tuple[StoredCalibration, ...]:
        """Return the unit's current calibrations, at most one a triad; usable or not."""
        ...

    def of_results(self, results: Sequence[str]) -> tuple[StoredCalibration, ...]:
        """Return the calibrations that results gave, in the order of the results; gyros before accelerometers."""
        ...

    def used_by(self, calibration_id: str) -> tuple[str, ...]:
        """Return the ids of the results that rest on a calibration, newest first."""
        ...

    def add(
        self, calibration: StoredCalibration, by: Decider, choose: bool, idempotency: Idempotency | None = None
    ) -> StoredCalibration:
        """Store a calibration that a person entered, make it current where `choose` is true, and return it. Raises
        `IdempotencyConflict`.
        """
        ...

    def choose(
        self, unit: str, calibration_id: str, by: Decider, idempotency: Idempotency | None = None
    ) -> StoredCalibration:
        """Make a calibration its triad's current one, which stands until it is rejected or expires.

        Raises `CalibrationRefused` for one that may not be used, or that failed and has no remark; `NotFound`.
        """
        ...

    def choose_by_rule(self, unit: str, triad: str, by: Decider) -> StoredCalibration:
        """Give the triad back to the rule: its newest usable calibration by a job that passed becomes current.

        Raises `CalibrationRefused` where there is none.
        """
        ...

    def approve(
        self,
        unit: str,
        calibration_id: str,
        by: Decider,
        valid_until: datetime | None,
        idempotency: Idempotency | None = None,
    ) -> StoredCalibration:
        """Store a person's approval of a calibration, with the end of its validity where one is given, and return it.
        Raises `NotFound`.
        """
        ...

    def reject(
        self, unit: str, calibration_id: str, by: Decider, idempotency: Idempotency | None = None
    ) -> StoredCalibration:
        """Store a person's rejection of a calibration and return it: it is not used any more, also where it is current.
        Raises `NotFound`.
        """
        ...
