"""Routes of units under test: their declarations and their corrections."""

from typing import Annotated

from fastapi import Path, Response

from bench_service.api.http.dependencies import After, IdempotencyKey, Limit, Service
from bench_service.api.http.errors import problems
from bench_service.api.http.printed import PDF, PRINTED, printed
from bench_service.api.units.calibration_schemas import CalibrationApproval, CalibrationRejection
from bench_service.api.units.calibrations import DeciderOf
from bench_service.api.units.schemas import (
    CorrectionChoice,
    CorrectionPage,
    CorrectionRuleChoice,
    CorrectionView,
    UnitDeclaration,
    UnitView,
)
from bench_service.evidence.imports import require_real
from bench_service.model.records import Idempotency
from bench_service.routing import Routes
from procedures.core.unit import SERIAL, Unit
from procedures.core.unit_correction import CorrectionKind

router = Routes(prefix="/api/v1/units", tags=["units"])
Serial = Annotated[str, Path(pattern=SERIAL)]


@router.get("", responses=problems())
def list_units(service: Service) -> list[UnitView]:
    """List every unit with its declaration."""
    return [UnitView.of(unit) for unit in service.stores.units.units()]


@router.get("/{serial}", responses=problems(404))
def read_unit(serial: str, service: Service) -> UnitView:
    """Read one unit by its serial."""
    return UnitView.of(service.stores.units.unit(serial))


@router.get("/{serial}/report.pdf", response_class=Response, responses={**problems(404), **PDF})
async def read_printed_unit(serial: Serial, service: Service) -> Response:
    """Read a unit's report as PDF/A-3: record, calibrations with their history, latest results."""
    return printed(await PRINTED.run(service.reports.of_unit, serial), f"{serial}.pdf")


@router.put("/{serial}", responses=problems(413, 507))
def declare_unit(serial: Serial, body: UnitDeclaration, service: Service) -> UnitView:
    """Declare a unit or change its declaration. Its recordings, results and calibrations stay."""
    require_real(serial)
    service.stores.units.put_unit(
        Unit(
            serial,
            body.sample_rate_hz,
            tuple(body.channels),
            body.gyro,
            body.accelerometer,
            body.averaging_time_s,
        )
    )
    return UnitView.of(service.stores.units.unit(serial))


@router.get("/{serial}/corrections", responses=problems(404))
def list_corrections(
    serial: str, service: Service, kind: CorrectionKind | None = None, after: After = None, limit: Limit = 50
) -> CorrectionPage:
    """List the unit's correction sets, newest first; one of each kind is current."""
    service.stores.units.unit(serial)
    page = service.stores.corrections.list(serial, kind=kind, after=after, limit=limit)
    return CorrectionPage(items=[CorrectionView.of(c) for c in page.items], next=page.next)


@router.post("/{serial}/corrections/choose-by-rule", responses=problems(404, 409, 413, 507))
def choose_correction_by_rule(
    serial: str, body: CorrectionRuleChoice, service: Service, decider: DeciderOf
) -> CorrectionView:
    """Give a kind of correction back to the rule: its newest usable one by a job that passed becomes current."""
    service.stores.units.unit(serial)
    by = decider(body.by, body.remark)
    return CorrectionView.of(service.stores.corrections.choose_by_rule(serial, body.kind, by))


@router.get("/{serial}/corrections/{correction_id}", responses=problems(404))
def read_correction(serial: str, correction_id: str, service: Service) -> CorrectionView:
    """Read one correction set, and the results that rest on it."""
    stored = service.stores.corrections.get(serial, correction_id)
    return CorrectionView.of(stored, service.stores.corrections.used_by(correction_id))


@router.post("/{serial}/corrections/{correction_id}/current", responses=problems(404, 409, 413, 507))
def choose_correction(
    serial: str,
    correction_id: str,
    service: Service,
    decider: DeciderOf,
    body: CorrectionChoice | None = None,
    key: IdempotencyKey = None,
) -> CorrectionView:
    """Make a correction set the one that new jobs use; jobs that began before keep theirs.

    A body is needed, with a remark, for a correction of a result that did not pass.
    """
    by = decider(None, "") if body is None else decider(body.by, body.remark)
    asked = Idempotency.of("corrections", key, [serial, correction_id, *([] if body is None else [body])])
    return CorrectionView.of(service.stores.corrections.make_current(serial, correction_id, by, asked))


@router.post("/{serial}/corrections/{correction_id}/approve", responses=problems(404, 409, 413, 507))
def approve_correction(
    serial: str,
    correction_id: str,
    body: CalibrationApproval,
    service: Service,
    decider: DeciderOf,
    key: IdempotencyKey = None,
) -> CorrectionView:
    """Approve a correction set, and say until when it is valid."""
    by = decider(body.by, body.remark)
    asked = Idempotency.of("corrections-approve", key, [serial, correction_id, body])
    return CorrectionView.of(service.stores.corrections.approve(serial, correction_id, by, body.valid_until, asked))


@router.post("/{serial}/corrections/{correction_id}/reject", responses=problems(404, 409, 413, 507))
def reject_correction(
    serial: str,
    correction_id: str,
    body: CalibrationRejection,
    service: Service,
    decider: DeciderOf,
    key: IdempotencyKey = None,
) -> CorrectionView:
    """Reject a correction set: no new job uses it, also where it is current."""
    by = decider(body.by, body.remark)
    asked = Idempotency.of("corrections-reject", key, [serial, correction_id, body])
    return CorrectionView.of(service.stores.corrections.reject(serial, correction_id, by, asked))
