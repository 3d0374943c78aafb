"""Treatment of samples before they go out: the calibrations that correct them, and decimation."""

from bench_service.evidence.stores import EvidenceStores
from bench_service.formats.samples_out.sheet import Treatment
from bench_service.model.calibrations import Approval
from bench_service.model.errors import NotFound
from procedures.core.errors import BadParameter


def treatment_of(stores: EvidenceStores, unit: str, corrected_by: str | None, decimate: int) -> Treatment:
    """Return the treatment of a unit's samples by calibrations of that unit, given as ids separated by commas (None: no
    correction), and by means over `decimate` samples.

    An expired calibration may correct what was recorded while it was valid; a rejected one corrects nothing. Raises
    `NotFound`, `BadParameter`.
    """
    ids = tuple(known.strip() for known in corrected_by.split(",")) if corrected_by else ()
    found = stores.calibrations.several(ids) if ids else ()
    for one in found:
        if one.unit != unit:
            raise NotFound("calibration", one.id, f"unit {unit} has none with this id")
        if one.approval is Approval.REJECTED:
            raise BadParameter("corrected_by", one.id, "a calibration that was not rejected")
    triads = [one.triad for one in found]
    if len(set(triads)) != len(triads):
        raise BadParameter("corrected_by", corrected_by, "at most one calibration of each triad")
    return Treatment(tuple(one.value for one in found), ids, decimate)
