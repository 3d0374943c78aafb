"""Routes of a unit's calibrations: history, known coefficients, and which one of each triad counts."""

from collections.abc import Callable
from typing import Annotated

from fastapi import Depends, Path, Query, Response
from pydantic import Field

from bench_service.api.http.dependencies import After, ClientName, IdempotencyKey, Limit, ProvenName, Service
from bench_service.api.http.errors import made, problems
from bench_service.api.http.fields import Request
from bench_service.api.http.printed import PDF, PRINTED, printed
from bench_service.api.units.calibration_schemas import (
    CalibrationApproval,
    CalibrationChoice,
    CalibrationDetail,
    CalibrationEntry,
    CalibrationPage,
    CalibrationRejection,
    CalibrationView,
    RuleChoice,
    Triad,
)
from bench_service.evidence.calibration_exports import export_calibration as exported_file
from bench_service.evidence.entered_calibrations import stored_calibration
from bench_service.formats.calibration_exports.forms import MEDIA_TYPES, CalibrationForm
from bench_service.model.calibrations import Decider
from bench_service.model.errors import NotFound
from bench_service.model.records import Idempotency
from bench_service.routing import Routes
from procedures.core.unit import SERIAL

router = Routes(prefix="/api/v1/units/{serial}/calibrations", tags=["units"])
Serial = Annotated[str, Path(pattern=SERIAL)]


@router.get("", responses=problems(404))
def list_calibrations(
    serial: str,
    service: Service,
    triad: Annotated[Triad | None, Query(description="Only calibrations of this triad")] = None,
    after: After = None,
    limit: Limit = 50,
) -> CalibrationPage:
    """List the unit's calibrations, newest first; at most one of each triad is current."""
    service.stores.units.unit(serial)
    page = service.stores.calibrations.list(serial, triad=triad, after=after, limit=limit)
    return CalibrationPage(items=[CalibrationView.of(c) for c in page.items], next=page.next)


async def _decider(client: ClientName, proven: ProvenName) -> Callable[[str | None, str], Decider]:
    """The person who decides: the one who has logged in, or the name in the body, or the client's."""
    return lambda by, remark: Decider(proven or by or client, remark, proven is not None)


DeciderOf = Annotated[Callable[[str | None, str], Decider], Depends(_decider)]
"""Function that returns the decider, from the name and the remark that the body gives."""


@router.post(
    "",
    status_code=201,
    responses={**problems(404, 409, 413, 507), **made(201, "calibration_id", "read_calibration")},
)
def enter_calibration(
    serial: Serial,
    body: CalibrationEntry,
    service: Service,
    decider: DeciderOf,
    response: Response,
    key: IdempotencyKey = None,
) -> CalibrationView:
    """Enter known coefficients of a triad, with their standard uncertainties and their origin."""
    service.stores.units.unit(serial)
    calibration = stored_calibration(serial, body.entry())
    by = decider(body.by, body.remark)
    stored = service.stores.calibrations.add(
        calibration, by, body.choose, Idempotency.of("calibrations-enter", key, [serial, body])
    )
    response.headers["Location"] = f"/api/v1/units/{serial}/calibrations/{stored.id}"
    return CalibrationView.of(stored)


class CertificateText(Request):
    """A digital calibration certificate to be printed."""

    certificate: str = Field(min_length=1, max_length=900_000, description="The XML, with or without its signature")


@router.post("/certificate.pdf", response_class=Response, responses={**problems(404, 413, 507), **PDF})
async def print_certificate(serial: Serial, body: CertificateText, service: Service) -> Response:
    """Print a certificate of the unit's calibrations as PDF/A-3, with the XML inside byte for byte.

    Refused where its numbers are not those stored here.
    """
    data = await PRINTED.run(service.reports.of_certificate, serial, body.certificate)
    return printed(data, f"{serial}-certificate.pdf")


@router.post("/choose-by-rule", responses=problems(404, 409, 413, 507))
def choose_by_rule(serial: str, body: RuleChoice, service: Service, decider: DeciderOf) -> CalibrationView:
    """Give a triad back to the rule: its newest usable calibration by a job that passed becomes current."""
    service.stores.units.unit(serial)
    by = decider(body.by, body.remark)
    return CalibrationView.of(service.stores.calibrations.choose_by_rule(serial, body.triad, by))


@router.get("/{calibration_id}", responses=problems(404))
def read_calibration(serial: str, calibration_id: str, service: Service) -> CalibrationDetail:
    """Read one calibration with its lineage, and the results that rest on it."""
    stored = service.stores.calibrations.get(calibration_id)
    if stored.unit != serial:
        raise NotFound("calibration", calibration_id, f"unit {serial} has none with this id")
    made_by = None if stored.result_id is None else service.stores.results.get(stored.result_id)
    return CalibrationDetail.of_use(stored, made_by, service.stores.calibrations.used_by(calibration_id))


EXPORTED: dict[int | str, dict[str, object]] = {
    200: {
        "description": "The calibration as a file for other software",
        "content": {kind: {"schema": {"type": "string", "format": "binary"}} for kind in MEDIA_TYPES},
    }
}


@router.get("/{calibration_id}/export", response_class=Response, responses={**problems(404), **EXPORTED})
def export_calibration(
    serial: str,
    calibration_id: str,
    service: Service,
    form: Annotated[CalibrationForm, Query(alias="format")] = CalibrationForm.JSON,
    other: Annotated[
        str | None,
        Query(max_length=100, description="Calibration of the other triad; without it, of the same result or current"),
    ] = None,
) -> Response:
    """Export a calibration in the form that other software applies."""
    file = exported_file(service.stores, serial, calibration_id, form, other)
    return Response(
        file.text, media_type=file.media_type, headers={"Content-Disposition": f'attachment; filename="{file.name}"'}
    )


@router.post("/{calibration_id}/choose", responses=problems(404, 409, 413, 507))
def choose_calibration(
    serial: str,
    calibration_id: str,
    body: CalibrationChoice,
    service: Service,
    decider: DeciderOf,
    key: IdempotencyKey = None,
) -> CalibrationView:
    """Make a calibration the one of its triad that new jobs use; jobs that began before keep theirs."""
    by = decider(body.by, body.remark)
    asked = Idempotency.of("calibrations-choose", key, [serial, calibration_id, body])
    return CalibrationView.of(service.stores.calibrations.choose(serial, calibration_id, by, asked))


@router.post("/{calibration_id}/approve", responses=problems(404, 409, 413, 507))
def approve_calibration(
    serial: str,
    calibration_id: str,
    body: CalibrationApproval,
    service: Service,
    decider: DeciderOf,
    key: IdempotencyKey = None,
) -> CalibrationView:
    """Approve a calibration, and say until when it is valid."""
    by = decider(body.by, body.remark)
    asked = Idempotency.of("calibrations-approve", key, [serial, calibration_id, body])
    return CalibrationView.of(service.stores.calibrations.approve(serial, calibration_id, by, body.valid_until, asked))


@router.post("/{calibration_id}/reject", responses=problems(404, 409, 413, 507))
def reject_calibration(
    serial: str,
    calibration_id: str,
    body: CalibrationRejection,
    service: Service,
    decider: DeciderOf,
    key: IdempotencyKey = None,
) -> CalibrationView:
    """Reject a calibration: no new job uses it, also where it is current."""
    by = decider(body.by, body.remark)
    asked = Idempotency.of("calibrations-reject", key, [serial, calibration_id, body])
    return CalibrationView.of(service.stores.calibrations.reject(serial, calibration_id, by, asked))
