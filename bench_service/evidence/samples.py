"""Treatment of samples before they go out: the calibrations and temperature corrections, and decimation."""

from bench_service.evidence.corrections import StoredCorrection
from bench_service.evidence.stores import EvidenceStores
from bench_service.formats.samples_out.sheet import Treatment
from bench_service.model.calibrations import Approval, StoredCalibration
from bench_service.model.errors import NotFound
from procedures.core.errors import BadParameter


def treatment_of(stores: EvidenceStores, unit: str, corrected_by: str | None, decimate: int) -> Treatment:
    """Return the treatment of a unit's samples by calibrations and temperature corrections of that unit, given as ids
    separated by commas.

    An expired one may correct what was recorded while it was valid; a rejected one corrects nothing. Raises `NotFound`,
    `BadParameter`.
    """
    calibrations: list[StoredCalibration] = []
    corrections: list[StoredCorrection] = []
    for known in (one.strip() for one in corrected_by.split(",")) if corrected_by else ():
        found = _found(stores, unit, known)
        if found.approval is Approval.REJECTED:
            raise BadParameter("corrected_by", known, "a calibration or correction that was not rejected")
        if isinstance(found, StoredCorrection):
            corrections.append(found)
        else:
            calibrations.append(found)
    triads = [one.triad for one in calibrations]
    if len(set(triads)) != len(triads):
        raise BadParameter("corrected_by", corrected_by, "at most one calibration of each triad")
    return Treatment(
        tuple(one.value for one in calibrations),
        tuple(one.id for one in calibrations),
        decimate,
        tuple(one.correction for one in corrections),
        tuple(one.id for one in corrections),
    )


def _found(stores: EvidenceStores, unit: str, known: str) -> StoredCalibration | StoredCorrection:
    """The calibration or temperature correction of a unit with an id. Raises `NotFound`."""
    try:
        calibration = stores.calibrations.get(known)
    except NotFound:
        calibration = None
    if calibration is not None and calibration.unit == unit:
        return calibration
    try:
        return stores.corrections.get(unit, known)
    except NotFound as error:
        words = f"unit {unit} has no calibration and no temperature correction with this id"
        raise NotFound("calibration", known, words) from error
