"""A unit as earlier steps of a campaign will leave it, with planned calibrations, for previews of steps that need
them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from procedures.core.coefficient_name import CoefficientName
from procedures.core.imu_model import COEFFICIENT_NAMES, TriadCalibration, triad_calibration
from procedures.core.recording import TRIADS
from procedures.core.unit import Unit
from procedures.procedure import PredictedUncertainty, Procedure

NO_CALIBRATIONS = Procedure.calibrations
"""The `calibrations` of a procedure or method whose results are no calibration."""
NO_CORRECTIONS = Procedure.corrections
"""The `corrections` of one whose results are no correction."""
NOMINAL = np.eye(3, 4, 1).ravel()
"""Coefficients of nominal outputs: no bias, K the identity."""
OUTPUT_UNITS = {"gyro": "rad/s", "accelerometer": "m/s^2"}


@dataclass
class Progress:
    """The results that earlier steps leave for later ones."""

    calibrated: bool = False
    """True once the unit's current calibration is of this campaign."""
    calibrating: set[str] = field(default_factory=set[str])
    """Steps whose results give calibrations."""
    correcting: set[str] = field(default_factory=set[str])
    """Steps whose results give corrections."""
    averaging_time_s: float | None = None
    """Averaging time that an earlier step is expected to give the unit's record; None: the record's own."""
    averaging_time_of: str = ""
    """The step that is to give it."""
    left_out: set[str] = field(default_factory=set[str])
    planned: dict[str, tuple[PredictedUncertainty, ...]] = field(
        default_factory=dict[str, tuple[PredictedUncertainty, ...]]
    )
    """Predicted uncertainties of the coefficients of each step that calibrates, by the name of the step."""

    def record(self, unit: Unit) -> Unit:
        """Return the unit with what earlier steps are expected to have entered into its record."""
        return unit if self.averaging_time_s is None else replace(unit, averaging_time_s=self.averaging_time_s)

    def predicted_uncertainties_of(self, steps: Sequence[str]) -> tuple[tuple[PredictedUncertainty, ...], ...]:
        """Predicted uncertainties of the coefficients, one tuple per named step that has a prediction, in the order of
        `steps`; the others are left out.
        """
        return tuple(self.planned[name] for name in steps if self.planned.get(name))

    def expected(self, unit: Unit) -> Unit | None:
        """Return the unit with planned calibrations in place of those that it lacks; None where it lacks more than are
        planned.
        """
        made: Mapping[str, TriadCalibration] = {}
        for uncertainties in self.planned.values():
            made = {**made, **_nominal(uncertainties)}
        known = {c.triad: c for c in unit.calibrations}
        wanted = {**made, **known}
        if set(wanted) < set(TRIADS):
            return None
        return replace(unit, calibrations=tuple(wanted.values()), calibration_ids=(), withheld=())


def _nominal(uncertainties: tuple[PredictedUncertainty, ...]) -> dict[str, TriadCalibration]:
    """Nominal calibrations of the triads whose twelve coefficients are all predicted, without correlations."""
    by_name = {p.name: p.standard_uncertainty for p in uncertainties}
    found: dict[str, TriadCalibration] = {}
    for triad, unit in OUTPUT_UNITS.items():
        sd = [by_name.get(CoefficientName(triad, name)) for name in COEFFICIENT_NAMES]
        if all(u is not None for u in sd):
            variances = np.array(sd, dtype=np.float64) ** 2
            found[triad] = triad_calibration(triad, unit, unit, NOMINAL, np.diag(variances))
    return found
