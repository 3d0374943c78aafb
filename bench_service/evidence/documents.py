"""Results of analyses as JSON that can be stored; a value that cannot be stored is refused here, by its field."""

from collections.abc import Sequence
from typing import Any

from pydantic_core import to_jsonable_python

from bench_service.formats.plain_json import faults, is_finite
from procedures.core.errors import UnfitResult
from procedures.core.imu_model import TriadCalibration
from procedures.core.unit_correction import UnitCorrection
from procedures.procedure import Outcome


def document_of(outcome: Outcome) -> dict[str, Any]:
    """Return the result of an analysis as a JSON object. Raises `UnfitResult` naming the first value that cannot be
    stored.
    """
    document = outcome.model_dump(mode="json")
    require_fit(document, "a result")
    return document


def require_storable(calibrations: Sequence[TriadCalibration], corrections: Sequence[UnitCorrection]) -> None:
    """Check calibrations and corrections. Raises `UnfitResult` for a value that cannot be stored, by its field."""
    given = {"calibrations": calibrations, "corrections": corrections}
    require_fit(to_jsonable_python(given, inf_nan_mode="constants"), "a calibration or correction")


def require_fit(document: dict[str, Any], what: str) -> None:
    """Check that a document can be stored. Raises `UnfitResult` naming the first value that JSON cannot hold."""
    fault = next(faults(document), None)
    if fault is None:
        return
    number = isinstance(fault.value, int | float) and not is_finite(fault.value)
    needed = f"{what} must be finite" if number else fault.allowed
    raise UnfitResult(".".join(map(str, fault.path)), fault.value, needed)
