"""Sources of limits: that of a default is the procedure's own, that of any other number is the request."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from bench_service.drivers.simulated import SimulatedDriver
from procedures import catalog
from procedures.core.imu_model import triad_calibration
from procedures.core.limits import ASKED, PlannedCheck
from procedures.core.recording import TRIADS
from procedures.core.unit import Unit
from procedures.procedure import Context, Procedure
from tests.kit.exported_calibrations import UNITS

NOMINAL = np.eye(3, 4, 1).ravel()


def calibrated(unit: Unit) -> Unit:
    """The unit with a nominal calibration of both triads, as a verification needs it."""
    found = tuple(triad_calibration(t, UNITS[t], UNITS[t], NOMINAL, 1e-16 * np.eye(12)) for t in TRIADS)
    return Unit(**{**vars(unit), "calibrations": found})


@pytest.fixture(scope="module")
def context() -> Context:
    driver = SimulatedDriver("sim")
    return Context(calibrated(driver.mounted()[0]), driver.description)


JUDGED = sorted(name for name, of in catalog.discover().items() if "limits" in of.params.model_fields)


def planned(procedure: Procedure[Any, Any], limits: dict[str, float], context: Context) -> dict[str, PlannedCheck]:
    params = procedure.resolve(procedure.params.model_validate({"limits": limits}), context)
    return {one.check: one for one in procedure.planned_checks(params, context)}


def others(procedure: Procedure[Any, Any]) -> Iterator[tuple[str, float]]:
    """Each limit that has a number by default, a little stricter or wider."""
    model = procedure.params.model_fields["limits"].annotation
    assert model is not None
    for field, of in model.model_fields.items():
        if isinstance(of.default, float):
            yield field, of.default * 0.999


def test_there_are_procedures_with_limits() -> None:
    assert {"thermal_cycle", "calibration_12_orientations", "verification_9_orientations"} <= set(JUDGED)


@pytest.mark.parametrize("name", JUDGED)
def test_a_changed_limit_is_the_requests_and_the_others_keep_their_source(name: str, context: Context) -> None:
    procedure = catalog.discover()[name]
    own = planned(procedure, {}, context)
    assert all(one.limit.source and one.limit.source != ASKED for one in own.values())
    for field, value in others(procedure):
        for check, one in planned(procedure, {field: value}, context).items():
            before = own[check].limit
            moved = (one.limit.minimum, one.limit.maximum) != (before.minimum, before.maximum)
            assert one.limit.source == (ASKED if moved else before.source), (field, check)
