"""Calibrations in SQL: history, choice and decisions. Those of a result come in with it (`result_store`)."""

from collections.abc import Callable, Sequence
from datetime import datetime

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from bench_service import wall_clock
from bench_service.model.calibrations import Act, Approval, Decider, Decision, StoredCalibration, takes_over
from bench_service.model.errors import CalibrationRefused, NotFound
from bench_service.model.records import Idempotency, Page, StoredResult
from bench_service.persistence.database import Database
from bench_service.persistence.evidence.calibration_rows import calibrations_where, complete, decision_row, rows_of
from bench_service.persistence.idempotency import again_after_conflict, made_before, remember
from bench_service.persistence.paging import page
from bench_service.persistence.tables.evidence import CalibrationRow, ResultCalibrationRow
from bench_service.persistence.tables.jobs import JobRow
from procedures.core.imu_model import TriadCalibration
from procedures.core.limits import Verdict


class SqlCalibrationStore:
    """SQL implementation of `bench_service.evidence.calibrations.CalibrationStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def list(
        self, unit: str, *, triad: str | None = None, after: str | None = None, limit: int = 50
    ) -> Page[StoredCalibration]:
        query = select(CalibrationRow).where(CalibrationRow.unit == unit)
        if triad is not None:
            query = query.where(CalibrationRow.triad == triad)
        with self._database.read() as session:
            rows = page(session, query, CalibrationRow.id, after, limit, _itself)
            return Page(tuple(complete(session, rows.items)), rows.next)

    def get(self, calibration_id: str) -> StoredCalibration:
        return self.several((calibration_id,))[0]

    def several(self, ids: Sequence[str]) -> tuple[StoredCalibration, ...]:
        with self._database.read() as session:
            found = {c.id: c for c in calibrations_where(session, CalibrationRow.id.in_(ids))}
        for wanted in ids:
            if wanted not in found:
                raise NotFound("calibration", wanted)
        return tuple(found[wanted] for wanted in ids)

    def current(self, unit: str) -> tuple[StoredCalibration, ...]:
        with self._database.read() as session:
            return tuple(calibrations_where(session, CalibrationRow.unit == unit, CalibrationRow.is_current))

    def of_results(self, results: Sequence[str]) -> tuple[StoredCalibration, ...]:
        with self._database.read() as session:
            found = calibrations_where(session, CalibrationRow.result_id.in_(results))
        place = {result: position for position, result in enumerate(results)}
        return tuple(sorted(found, key=lambda c: (place[c.result_id or ""], c.triad != "gyro")))

    def used_by(self, calibration_id: str) -> tuple[str, ...]:
        used = ResultCalibrationRow
        query = select(used.result_id).where(used.calibration_id == calibration_id).distinct()
        with self._database.read() as session:
            return tuple(session.scalars(query.order_by(used.result_id.desc())))

    def add(
        self, calibration: StoredCalibration, by: Decider, choose: bool, idempotency: Idempotency | None = None
    ) -> StoredCalibration:
        def once(session: Session) -> str:
            _insert(session, calibration)
            _decide(session, calibration.id, Act.ENTERED, by)
            if choose:
                _require_choosable(_one(session, calibration.unit, calibration.id), by)
                _make_current(session, calibration.unit, calibration.id, by_rule=False)
                _decide(session, calibration.id, Act.CHOSEN, by)
            return calibration.id

        return self._done(once, calibration.unit, "calibration", idempotency)

    def choose(
        self, unit: str, calibration_id: str, by: Decider, idempotency: Idempotency | None = None
    ) -> StoredCalibration:
        def once(session: Session) -> str:
            _require_choosable(_one(session, unit, calibration_id), by)
            _make_current(session, unit, calibration_id, by_rule=False)
            _decide(session, calibration_id, Act.CHOSEN, by)
            return calibration_id

        return self._done(once, unit, "calibration choice", idempotency)

    def choose_by_rule(self, unit: str, triad: str, by: Decider) -> StoredCalibration:
        def once(session: Session) -> str:
            found = _by_rule(session, unit, triad)
            _make_current(session, unit, found, by_rule=True)
            _decide(session, found, Act.CHOSEN, by)
            return found

        return self._done(once, unit, "calibration choice", None)

    def approve(
        self,
        unit: str,
        calibration_id: str,
        by: Decider,
        valid_until: datetime | None,
        idempotency: Idempotency | None = None,
    ) -> StoredCalibration:
        def once(session: Session) -> str:
            until = {} if valid_until is None else {"valid_until": valid_until}
            _change(session, unit, calibration_id, approval=Approval.APPROVED.value, **until)
            _decide(session, calibration_id, Act.APPROVED, by)
            return calibration_id

        return self._done(once, unit, "calibration approval", idempotency)

    def reject(
        self, unit: str, calibration_id: str, by: Decider, idempotency: Idempotency | None = None
    ) -> StoredCalibration:
        def once(session: Session) -> str:
            _change(session, unit, calibration_id, approval=Approval.REJECTED.value)
            _decide(session, calibration_id, Act.REJECTED, by)
            return calibration_id

        return self._done(once, unit, "calibration rejection", idempotency)

    def _done(
        self, once: Callable[[Session], str], unit: str, kind: str, idempotency: Idempotency | None
    ) -> StoredCalibration:
        """Do it in one transaction, unless its key is known, and read what became of the calibration."""

        def whole() -> StoredCalibration:
            with self._database.write() as session:
                made = made_before(session, idempotency, kind)
                if made is None:
                    made = once(session)
                    remember(session, idempotency, kind, made, wall_clock.now())
                    session.flush()
                return _one(session, unit, made)

        return again_after_conflict(whole)


def add_calibrations(session: Session, result: StoredResult, triads: Sequence[TriadCalibration], by_rule: bool) -> None:
    """Add a result's calibrations to the unit's history, and make current those that the rule lets take over.

    `by_rule`: False for a second analysis or a method, whose calibrations become current only when a person chooses
    them. Of two that become current at once, the index lets one wait and the store try again.
    """
    if not triads or result.unit is None:
        return
    known = calibrations_where(session, CalibrationRow.unit == result.unit, CalibrationRow.is_current)
    current = {c.triad: c for c in known}
    for triad in triads:
        made = _of_result(result, result.unit, triad)
        _insert(session, made)
        if by_rule and takes_over(result.verdict, current.get(triad.triad), wall_clock.now()):
            _make_current(session, result.unit, made.id, by_rule=True)
            _decide(session, made.id, Act.CHOSEN, Decider("", f"result {result.id} passed"))


def _of_result(result: StoredResult, unit: str, triad: TriadCalibration) -> StoredCalibration:
    return StoredCalibration(
        id=wall_clock.new_id(),
        unit=unit,
        value=triad,
        method=result.name,
        origin="",
        result_id=result.id,
        verdict=result.verdict,
        made_at=result.created_at,
        simulated=result.simulated,
        current=False,
        by_rule=False,
        approval=Approval.OPEN,
        valid_from=None,
        valid_until=None,
    )


def _insert(session: Session, calibration: StoredCalibration) -> None:
    row, coefficients = rows_of(calibration)
    session.add(row)
    session.flush()
    session.add_all(coefficients)
    session.flush()


def _decide(session: Session, calibration_id: str, act: Act, by: Decider) -> None:
    at = wall_clock.now()
    session.add(decision_row(Decision(calibration_id, act, at, by.by, by.proven, by.remark, wall_clock.new_id())))
    session.flush()


def _one(session: Session, unit: str, calibration_id: str) -> StoredCalibration:
    found = calibrations_where(session, CalibrationRow.id == calibration_id, CalibrationRow.unit == unit)
    if not found:
        raise NotFound("calibration", calibration_id, f"unit {unit} has none with this id")
    return found[0]


def _change(session: Session, unit: str, calibration_id: str, **values: object) -> None:
    _one(session, unit, calibration_id)
    session.execute(update(CalibrationRow).where(CalibrationRow.id == calibration_id).values(**values))
    session.expire_all()


def _require_choosable(calibration: StoredCalibration, by: Decider) -> None:
    """Check that a person may choose a calibration. Raises `CalibrationRefused` with the way out."""
    why = calibration.unusable(wall_clock.now())
    if why:
        raise CalibrationRefused(why)
    if calibration.verdict not in (None, Verdict.PASS) and not by.remark:
        raise CalibrationRefused(
            f"calibration {calibration.id} of the {calibration.triad} triad comes from result {calibration.result_id}, "
            f"whose verdict is {calibration.verdict}: give a remark that says why it is used nevertheless"
        )


def _by_rule(session: Session, unit: str, triad: str) -> str:
    """Id of the newest calibration that the rule would make current. Raises `CalibrationRefused` without one."""
    verdicts = select(JobRow.result_id).where(JobRow.unit == unit, JobRow.result_id.is_not(None))
    mine = (CalibrationRow.unit == unit, CalibrationRow.triad == triad, CalibrationRow.result_id.in_(verdicts))
    at = wall_clock.now()
    for found in reversed(calibrations_where(session, *mine)):
        if found.verdict is Verdict.PASS and not found.unusable(at):
            return found.id
    raise CalibrationRefused(
        f"no job that passed has given unit {unit} a usable calibration of its {triad} triad: calibrate it, or choose "
        "one of its history"
    )


def _make_current(session: Session, unit: str, calibration_id: str, by_rule: bool) -> None:
    """Let a calibration supersede its triad's current one; both rows are locked in the order of their ids."""
    row = CalibrationRow
    triad = select(row.triad).where(row.id == calibration_id).scalar_subquery()
    mine = (row.unit == unit, row.triad == triad)
    session.scalars(select(row.id).where(*mine).order_by(row.id).with_for_update()).all()
    session.execute(update(row).where(*mine, row.is_current).values(is_current=False, by_rule=False))
    session.execute(update(row).where(row.id == calibration_id).values(is_current=True, by_rule=by_rule))
    session.expire_all()


def _itself(row: CalibrationRow) -> CalibrationRow:
    return row
