"""Ferraris' calibration: parameters, result and analysis that the procedure and the method share."""

from collections.abc import Sequence

from pydantic import Field

from procedures.analysis.calibration.summary import TriadSummary
from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.analysis.calibration.triad_analysis import analyse_means, suspected
from procedures.analysis.own_axes import own_axis_check
from procedures.analysis.turns.ferraris import analyse_ferraris, rest_means
from procedures.analysis.turns.summary import WholeTurns
from procedures.core import units
from procedures.core.imu_model import TriadCalibration
from procedures.core.limits import Check, Limit, PlannedCheck, check, verdict
from procedures.core.recording import AXES, TRIADS, Recording
from procedures.core.report import Report
from procedures.core.site import Site
from procedures.core.unit import Unit
from procedures.parameters import Parameters, largest, level_check, planned_tests
from procedures.procedure import Outcome
from procedures.reports import calibration as pictures
from procedures.reports import whole_turns as of_turns
from procedures.triad_checks import RESIDUALS


class FerrarisLimits(Parameters):
    """Requirements on the calibration itself (this program's own)."""

    gyro_scale_3_sigma_ppm: float = Field(20.0, gt=0.0, le=1e6, description="three standard uncertainties")
    residual_p_value_min: float = Field(
        0.001, ge=0.0, le=1.0, description="smallest p-value accepted for each triad's residuals"
    )
    condition_max: float = Field(
        100.0, ge=1.0, le=1e9, description="largest condition number of the accelerometers' design"
    )

    @property
    def of_scale(self) -> Limit:
        """Limit of the gyros' scale factors, with its source."""
        return largest(self, "gyro_scale_3_sigma_ppm", "ppm")


class Result(Outcome):
    """Gyros from rests and turns, accelerometers from the rests."""

    gyro: WholeTurns
    accelerometer: TriadSummary


def calibrated(
    recordings: Sequence[Recording], site: Site, table: TableUncertainty, unit: Unit | None, limits: FerrarisLimits
) -> Result:
    """Return the calibration of both triads, with checks. Raises `UnfitRecording`, `MissingChannel`, `Undetermined`.
    `unit` None: no noise is known, and the residuals stand in.
    """
    gyro = analyse_ferraris(recordings, site, table, unit.gyro if unit else None)
    at_rest = analyse_means(rest_means(recordings), site, table, unit.accelerometer if unit else None)
    (force,) = suspected([at_rest])
    checks = (*_gyro_checks(gyro, limits), *_force_checks(force, limits))
    known = (("gyro", gyro.noise_known), ("accelerometer", force.noise_known))
    warnings = tuple(
        f"the noise of the {triad} triad is not known: its uncertainties come from the residuals"
        for triad, found in known
        if not found
    )
    return Result(checks=checks, verdict=verdict(checks), warnings=warnings, gyro=gyro, accelerometer=force)


def calibrations(result: Result) -> tuple[TriadCalibration, ...]:
    """Return the calibrations of both triads in a result."""
    return result.gyro.calibration, result.accelerometer.calibration


def report(result: Result) -> Report:
    """Return the report: coefficients of both triads, budgets, residuals and magnitudes."""
    note = "U = b + K·ω: b from the rests and the sums of turns there and back, K from their differences."
    force = result.accelerometer
    tables = (
        pictures.coefficient_table("Coefficients of the gyro triad", result.gyro.coefficients, note),
        pictures.triad_table(force),
        *pictures.budget_tables("gyro", result.gyro.budgets),
        pictures.budget_table("accelerometer", force.budgets),
        of_turns.rate_table(result.gyro),
    )
    return Report(sections=(*tables, *pictures.triad_figures(force), pictures.station_table(force.magnitudes)))


def planned_residuals(limits: FerrarisLimits, unit: Unit) -> tuple[PlannedCheck, ...]:
    """Return the planned tests of the residuals of triads whose noise is known."""
    known = [triad for triad in TRIADS if unit.triad(triad) is not None]
    return planned_tests(limits, "residual_p_value_min", *(f"{triad} {RESIDUALS}" for triad in known))


def _gyro_checks(found: WholeTurns, limits: FerrarisLimits) -> list[Check]:
    sd_ppm = [found.coefficient(f"K{k}{k}").standard_uncertainty / units.PPM for k in (1, 2, 3)]
    checks = [
        check(f"gyro scale factor {axis}, 3σ", 3.0 * sd, limits.of_scale) for axis, sd in zip(AXES, sd_ppm, strict=True)
    ]
    if found.p_value is not None:
        checks.append(level_check(limits, "residual_p_value_min", f"gyro {RESIDUALS}", found.p_value))
    return checks


def _force_checks(found: TriadSummary, limits: FerrarisLimits) -> list[Check]:
    most = largest(limits, "condition_max", "1")
    checks = [check("accelerometer condition number", found.condition, most)]
    checks.append(own_axis_check("accelerometer", found.calibration.matrix_array))
    if found.p_value is not None:
        name = f"accelerometer {RESIDUALS}"
        checks.append(level_check(limits, "residual_p_value_min", name, found.p_value, found.residual_note))
    return checks
