"""Check of a calibration certificate: signature, structure, and its coefficients against those stored here."""

from dataclasses import dataclass
from typing import Any

from bench_service.evidence.calibrations import CalibrationStore
from bench_service.model.errors import NotFound


@dataclass(frozen=True)
class CheckedTriad:
    """A calibration that a certificate is about, compared with the stored one."""

    calibration: str
    triad: str
    stored: bool
    same: bool | None
    """True where every value and standard uncertainty is the stored one; None: it is not stored here."""
    approval: str | None


@dataclass(frozen=True)
class Checked:
    """Outcome of the check of a certificate: valid or not, signer, unit, calibrations, and a sentence a fault."""

    valid: bool
    signed_by: str | None
    unchanged: bool
    unit: str | None
    calibrations: tuple[CheckedTriad, ...]
    faults: tuple[str, ...]


def check_certificate(stored: CalibrationStore, data: bytes, pinned: bytes) -> Checked:
    """Check a certificate's XML against the laboratory's PEM certificate, and return the outcome. Raises nothing for a
    bad certificate: each fault is a sentence in `faults`.
    """
    from bench_service.formats.certificate.errors import CertificateRefused
    from bench_service.formats.certificate.rules import attached, faults
    from bench_service.formats.certificate.signature import verified

    try:
        root, signer = verified(data, pinned)
    except CertificateRefused as error:
        return Checked(False, None, False, None, (), (str(error),))
    try:
        wrong = tuple(faults(root))
        document = attached(root)
    except CertificateRefused as error:
        return Checked(False, signer, True, None, (), (str(error),))
    triads = tuple(_held(stored, str(document["unit"]), triad) for triad in document["triads"])
    differing = tuple(f"{one.triad}: not the coefficients stored here" for one in triads if one.same is False)
    return Checked(not wrong and not differing, signer, True, str(document["unit"]), triads, wrong + differing)


def _held(stored: CalibrationStore, unit: str, triad: dict[str, Any]) -> CheckedTriad:
    name, kind = str(triad["calibration"]), str(triad["triad"])
    try:
        here = stored.get(name)
    except NotFound:
        return CheckedTriad(name, kind, False, None, None)
    if here.unit != unit:
        return CheckedTriad(name, kind, False, None, None)
    own = [[c.name, c.value, c.standard_uncertainty] for c in here.coefficients]
    said = [[c["name"], c["value"], c["standard_uncertainty"]] for c in triad["coefficients"]]
    return CheckedTriad(name, kind, True, own == said, here.approval.value)
