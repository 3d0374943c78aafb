"""Interface of the store of units' correction sets, which come in with the result that gives them
(`ResultStore.add`).
"""

from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

from bench_service.model.calibrations import Act, Approval, Decider, Decision
from bench_service.model.records import Idempotency, Page
from procedures.core.limits import Verdict
from procedures.core.unit_correction import CorrectionKind, UnitCorrection


@dataclass(frozen=True)
class StoredCorrection:
    """A correction set in a unit's history; of each kind at most one is current."""

    id: str
    unit: str
    result_id: str
    made_at: datetime
    current: bool
    correction: UnitCorrection
    simulated: bool
    verdict: Verdict
    """Verdict of the result that gave it."""
    of_job: bool
    """True where a job gave it as its own result; False for a second analysis and for a method."""
    approval: Approval = Approval.OPEN
    valid_until: datetime | None = None
    """End of its validity; None: it has none."""
    decisions: tuple[Decision, ...] = ()
    """All decisions about it, oldest first; `calibration_id` of each is this correction's id."""

    @property
    def by_rule(self) -> bool:
        """True where the rule made the correction current; False where a person chose it, or it is not current."""
        choices = [d for d in self.decisions if d.act in (Act.CHOSEN, Act.GIVEN_BACK)]
        return self.current and (not choices or choices[-1].act is Act.GIVEN_BACK)

    @property
    def why_not_current(self) -> str:
        """Reason why it is not its kind's current one, with the way out; empty where it is."""
        what = f"correction {self.id} of the kind {self.correction.kind!r}"
        if self.current:
            return ""
        if any(d.act is Act.CHOSEN for d in self.decisions):
            return (
                f"{what} was chosen by a person, and another one has taken its place since; choose it again to use it"
            )
        if self.verdict is not Verdict.PASS:
            return (
                f"{what} comes from result {self.result_id}, whose verdict is {self.verdict}: only one of a job that "
                "passed becomes current by itself; choose it with a remark to use it nevertheless"
            )
        if not self.of_job:
            return f"{what} comes from a second analysis or a method: it counts only where a person chooses it"
        return (
            f"{what} is not the current one: a newer one of a job that passed took its place, or one that a person "
            "chose stands; choose it to use it"
        )

    def unusable(self, at: datetime) -> str:
        """Return the reason why it may not be used at a time, with the way out; empty where it may."""
        what = f"correction {self.id} of the kind {self.correction.kind!r}"
        other = "make another correction of its history current, or run the job that gives one again"
        if self.approval is Approval.REJECTED:
            last = next((d for d in reversed(self.decisions) if d.act is Act.REJECTED), None)
            why = f" by {last.by}: {last.remark}" if last else ""
            return f"{what} was rejected{why}; {other}, or approve it"
        if self.valid_until is not None and at >= self.valid_until:
            day = self.valid_until.strftime("%Y-%m-%d %H:%M UTC")
            return f"{what} expired at {day}; {other}, or approve it with a later valid_until"
        return ""


class CorrectionStore(Protocol):
    """Store of correction sets: history and choice. Every method is one transaction. Interface; the SQL is in
    `persistence`.
    """

    def list(
        self, unit: str, *, kind: CorrectionKind | None = None, after: str | None = None, limit: int = 50
    ) -> Page[StoredCorrection]:
        """Return one page of a unit's corrections, of one kind or all, newest first."""
        ...

    def get(self, unit: str, correction_id: str) -> StoredCorrection:
        """Return one correction by its id. Raises `NotFound`, also for a correction of another unit."""
        ...

    def current(self, unit: str, kind: CorrectionKind) -> StoredCorrection | None: ...

    def used_by(self, correction_id: str) -> tuple[str, ...]:
        """Return the ids of the results that rest on a correction, newest first."""
        ...

    def make_current(
        self, unit: str, correction_id: str, by: Decider, idempotency: Idempotency | None = None
    ) -> StoredCorrection:
        """Choose the correction that new jobs use; it supersedes the current one of its kind.

        A known key with the same fingerprint changes nothing. Raises `NotFound`, `IdempotencyConflict`, and
        `CorrectionRefused` for one of a result that did not pass where there is no remark.
        """
        ...

    def choose_by_rule(self, unit: str, kind: CorrectionKind, by: Decider) -> StoredCorrection:
        """Give a kind back to the rule: its newest usable correction by a job that passed becomes current.

        Raises `CorrectionRefused` where there is none.
        """
        ...

    def approve(
        self,
        unit: str,
        correction_id: str,
        by: Decider,
        valid_until: datetime | None,
        idempotency: Idempotency | None = None,
    ) -> StoredCorrection:
        """Store a person's approval of a correction, with the end of its validity where one is given, and return it.
        Raises `NotFound`.
        """
        ...

    def reject(
        self, unit: str, correction_id: str, by: Decider, idempotency: Idempotency | None = None
    ) -> StoredCorrection:
        """Store a person's rejection of a correction and return it: no new job uses it, also where it is current.
        Raises `NotFound`.
        """
        ...
