"""Calibration at any set of positions: parameters, result and analysis that the procedure and the method share.

Twelve coefficients a triad as in `calibration_12_orientations`, with K₂, asymmetry and g-sensitivity in addition where
they are asked for and the positions determine them (`analysis.calibration.extra_terms`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from procedures.analysis.calibration.estimator import Weighting
from procedures.analysis.calibration.extra_terms import ExtraFit, Kind, TermEstimate, fit_terms, require_terms, terms_of
from procedures.analysis.calibration.multiposition import TriadFit
from procedures.analysis.calibration.plan import TriadPlan, predicted_parts
from procedures.analysis.calibration.reference import INPUT_UNITS, reference_magnitude, reference_vectors
from procedures.analysis.calibration.reference_temperature import ThermalShare, thermal_share, thermal_warnings
from procedures.analysis.calibration.station_means import StationMeans, launch_warnings, station_means
from procedures.analysis.calibration.summary import TriadSummary, coefficient_unit
from procedures.analysis.calibration.table_errors import TableErrors, TableUncertainty, table_errors
from procedures.analysis.calibration.triad_analysis import analyse_inputs, brought_by_unit, noise_of_means, suspected
from procedures.analysis.own_axes import OWN_AXES
from procedures.analysis.recursive_bias.dwell import DwellsSaved, dwells_saved
from procedures.core.arrays import Array
from procedures.core.coefficient_name import CoefficientName
from procedures.core.imu_model import COEFFICIENT_NAMES, TriadCalibration, triad_calibration
from procedures.core.limits import Check, PlannedCheck, verdict
from procedures.core.recording import Recording
from procedures.core.report import Report, Table
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles
from procedures.core.unit import Unit
from procedures.dwells import saved_tables
from procedures.parameters import JudgedParameters, planned_tests
from procedures.procedure import Outcome, PredictedUncertainty
from procedures.reports import calibration as pictures
from procedures.triad_checks import RESIDUALS, fit_checks

TriadName = Literal["accelerometer", "gyro"]
ACCELEROMETER_TERMS: tuple[Kind, ...] = ("quadratic", "asymmetry")


class FitParameters(JudgedParameters):
    """Settings of the fit. Weights as in `calibration_12_orientations`."""

    triads: tuple[TriadName, ...] = Field(("gyro", "accelerometer"), min_length=1, max_length=2)
    weighting: Weighting = Field(
        "noise_and_table",
        description="noise_and_table: joint with the declared errors of the positions; noise: without",
    )
    terms: tuple[Kind, ...] = Field(
        (),
        max_length=3,
        description="in addition to b and K: quadratic K2·v² and asymmetry KA·|v| of the accelerometers, "
        "g_sensitivity of the gyros; each must be determined by the positions",
    )
    scalar_check: bool = Field(False, description="cross-check of the accelerometers with the magnitude alone")
    residual_p_value_min: float = Field(
        0.001, ge=0.0, le=1.0, description="smallest p-value accepted for the chi-square of the residuals"
    )
    condition_max: float = Field(
        100.0, ge=1.0, le=1e9, description="largest condition number of the column-scaled design"
    )

    def terms_for(self, triad: str) -> tuple[Kind, ...]:
        """Return the further terms that are asked of a triad, each once."""
        own = ACCELEROMETER_TERMS if triad == "accelerometer" else ("g_sensitivity",)
        return tuple(kind for kind in dict.fromkeys(self.terms) if kind in own)


@dataclass(frozen=True)
class Inputs:
    """Inputs of one triad at the positions, and the uncertainty of them."""

    vectors: Array
    """Shape (n, 3), unit's axes [SI]."""
    errors: TableErrors
    magnitude: float
    forces: Array | None = None
    """Specific forces at the same positions, (n, 3) [m/s²]; of the gyros alone."""


@dataclass(frozen=True)
class Extended:
    """A triad's calibration with its further terms, all fitted at once."""

    calibration: TriadCalibration
    terms: tuple[TermEstimate, ...]
    condition: float
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None
    """None: the noise is not known or no equation is spare, so nothing is judged."""


class Result(Outcome):
    """Calibration of each triad, and of those with further terms the extended one, which then counts."""

    triads: tuple[TriadSummary, ...]
    extended: tuple[Extended, ...] = ()
    thermal: ThermalShare | None = Field(
        None,
        exclude_if=lambda share: share is None,
        description="thermal correction of the accelerometers, where it was applied",
    )
    dwells: DwellsSaved | None = Field(
        None, exclude_if=lambda saved: saved is None, description="dwells ended by the stop rule, and the time saved"
    )


def inputs_at(
    triads: Sequence[str], angles: Sequence[TableAngles], site: Site, uncertainty: TableUncertainty
) -> dict[str, Inputs]:
    """Return, by triad, the inputs at table angles (n) and their uncertainty by the table."""
    forces = reference_vectors("accelerometer", angles, site)
    found: dict[str, Inputs] = {}
    for triad in triads:
        vectors, of_gravity = reference_vectors(triad, angles, site), triad == "accelerometer"
        errors = table_errors(angles, vectors, uncertainty, of_gravity=of_gravity)
        found[triad] = Inputs(vectors, errors, reference_magnitude(triad, site), None if of_gravity else forces)
    return found


def predicted(plan: TriadPlan) -> list[PredictedUncertainty]:
    """Return the predicted uncertainties of the twelve coefficients of a plan; none where the noise is not known."""
    parts, unit = predicted_parts(plan), INPUT_UNITS[plan.triad]
    if parts is None:
        return []
    rows = [(name, coefficient_unit(name, unit, unit)) for name in COEFFICIENT_NAMES]
    return [
        PredictedUncertainty(CoefficientName(plan.triad, name), of, float(np.hypot(n, t)), n, t)
        for (name, of), n, t in zip(rows, parts[0].tolist(), parts[1].tolist(), strict=True)
    ]


def require_determined(params: FitParameters, triad: str, inputs: Inputs) -> None:
    """Refuse terms that the positions cannot determine. Raises `Undetermined` with the position to add."""
    kinds = params.terms_for(triad)
    if kinds:
        require_terms(f"the {triad} coefficients", inputs.vectors, terms_of(kinds, inputs.vectors, inputs.forces))


def calibrated(
    recordings: Sequence[Recording],
    params: FitParameters,
    inputs: dict[str, Inputs],
    unit: Unit | None,
    lag_s: tuple[float, float] | None = None,
) -> Result:
    """Calibrate the triads of `inputs`. Raises `UnfitRecording`, `MissingChannel`, `Undetermined`.

    `lag_s`, time constants of case and converter sensor: both triads are first brought to the references of the unit's
    corrections; None: they are taken as they are.
    """
    share: ThermalShare | None = None
    doubts: tuple[str, ...] = ()
    fitted: list[tuple[TriadSummary, TriadFit]] = []
    extended: list[Extended] = []
    for triad, given in inputs.items():
        require_determined(params, triad, given)
        means, record = station_means(recordings, triad), unit.triad(triad) if unit else None
        more, brought = dict[str, Array](), None
        if unit is not None and lag_s is not None:
            means, more, brought = brought_by_unit(recordings, means, unit, lag_s)
        scalar = params.scalar_check and triad == "accelerometer"
        of_inputs = (given.vectors, given.errors, given.magnitude, record)
        found = analyse_inputs(means, *of_inputs, scalar, params.weighting, more)
        if brought is not None:
            share, doubts = thermal_share(brought, found[1]), thermal_warnings(brought)
        fitted.append(found)
        if kinds := params.terms_for(triad):
            noise, known = noise_of_means(means, record)
            noise = noise + sum(more.values())
            terms = terms_of(kinds, given.vectors, given.forces)
            what, in_units = f"the {triad} coefficients", (means.output_unit, INPUT_UNITS[triad])
            whole = fit_terms(what, given.vectors, means.outputs, noise, given.errors, terms, in_units, known)
            extended.append(_extended(triad, means, whole))
    summaries = suspected(fitted)
    checks = tuple(c for t in summaries for c in _checks(t, _of(extended, t), params))
    return Result(
        checks=checks,
        verdict=verdict(checks),
        warnings=launch_warnings(recordings) + _unknown_noise(summaries) + doubts,
        triads=summaries,
        extended=tuple(extended),
        thermal=share,
        dwells=dwells_saved(recordings),
    )


def calibrations(result: Result) -> tuple[TriadCalibration, ...]:
    """One calibration a triad: with further terms where they were asked for, since b and K are biased without them."""
    by_triad = {e.calibration.triad: e.calibration for e in result.extended}
    return tuple(by_triad.get(t.calibration.triad, t.calibration) for t in result.triads)


def quantities(params: FitParameters) -> tuple[str, ...]:
    """Return the names of the checks and coefficients that a result will have."""
    checks = (" condition number", OWN_AXES, f" {RESIDUALS}")
    return tuple(f"{triad}{n}" for triad in params.triads for n in (*checks, *(f".{c}" for c in COEFFICIENT_NAMES)))


def planned_residuals(params: FitParameters, triads: Sequence[str]) -> tuple[PlannedCheck, ...]:
    """Return the planned tests of the residuals of triads whose noise is known."""
    return planned_tests(params, "residual_p_value_min", *(f"{triad} {RESIDUALS}" for triad in triads))


def report(result: Result) -> Report:
    """Return the report: coefficients, further terms, checks, thermal correction where it was applied, residuals and
    magnitudes.
    """
    magnitudes = [t.magnitudes for t in result.triads]
    tables = [pictures.triad_table(t) for t in result.triads]
    tables += [_term_table(e) for e in result.extended]
    tables += [pictures.budget_table(t.calibration.triad, t.budgets) for t in result.triads if t.budgets]
    tables += [table for t in result.triads if (table := pictures.scalar_table(t)) is not None]
    tables += [pictures.magnitude_table(magnitudes, "Magnitudes over the positions")]
    thermal = [] if result.thermal is None else pictures.thermal_tables(result.thermal, magnitudes[0].labels)
    figures = [f for t in result.triads for f in pictures.triad_figures(t)]
    stations = [pictures.station_table(m) for m in magnitudes]
    return Report(sections=(*tables, *saved_tables(result.dwells), *thermal, *figures, *stations))


def _extended(triad: str, means: StationMeans, fit: ExtraFit) -> Extended:
    calibration = triad_calibration(triad, means.output_unit, INPUT_UNITS[triad], fit.coefficients, fit.covariance)
    return Extended(calibration, fit.terms, fit.condition, fit.chi_square, fit.degrees_of_freedom, fit.p_value)


def _of(extended: Sequence[Extended], summary: TriadSummary) -> Extended | None:
    return next((e for e in extended if e.calibration.triad == summary.calibration.triad), None)


def _checks(t: TriadSummary, extended: Extended | None, params: FitParameters) -> list[Check]:
    of = extended or t
    misfit = t.misfit if extended is None else None
    of_fit = (of.condition, of.calibration.matrix_array, of.p_value, misfit)
    return fit_checks(t, *of_fit, params, "noise and positions")


def _unknown_noise(summaries: Sequence[TriadSummary]) -> tuple[str, ...]:
    return tuple(
        f"the noise of the {t.calibration.triad} triad is not known: its uncertainties come from the scatter within "
        "the recordings and the residuals, which do not show noise slower than the job"
        for t in summaries
        if not t.noise_known
    )


def _term_table(extended: Extended) -> Table:
    rows = tuple(
        (t.name, t.unit, t.estimate, t.standard_uncertainty, t.p_value, "yes" if t.present else "no")
        for t in extended.terms
    )
    columns = ("term", "unit", "estimate", "± standard uncertainty", "p without it", "present")
    c = extended.calibration
    bias = f"({', '.join(f'{b:.6g}' for b in c.bias_array)}) {c.output_unit}"
    note = f"Fitted with b and K at once, which then are other than without the terms: b = {bias}."
    return Table(f"Further terms of the {c.triad} triad", columns, rows, note)
