"""Checks of a triad's calibration in positions, with the sources of their limits."""

from procedures.analysis.calibration.misfit import MISFIT_MAX
from procedures.analysis.calibration.summary import TriadSummary
from procedures.analysis.orientation_plan.requirements import IN_RUN_SOURCE
from procedures.analysis.own_axes import own_axis_check
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.limits import OURS, Check, Limit, check
from procedures.parameters import Parameters, largest, level_check

RESIDUALS = "residuals, p-value of chi-square"
"""Name of the check, after the triad's."""


def in_run_limit(triad: str, limits: Parameters) -> Limit:
    """Return the limit on a triad's error per axis with its source; no maximum where `limits` has none."""
    if triad == "gyro":
        return largest(limits, "gyro_bias_in_run_deg_h", "deg/h", IN_RUN_SOURCE)
    return largest(limits, "accelerometer_bias_in_run_m_s2", "m/s^2", IN_RUN_SOURCE)


def triad_checks(t: TriadSummary, in_run: Limit, limits: Parameters) -> list[Check]:
    """Return the checks of a triad's calibration: error per axis in sample, condition, and residuals by p-value or
    misfit. `limits` has `condition_max` and `residual_p_value_min`.
    """
    name, m = f"{t.calibration.triad} bias in run, δ/√3", t.magnitudes
    size, freedom = units.DISPLAY[m.unit][1], len(m.after) - 1.0
    in_sample = check(name, m.per_axis / size, in_run, m.per_axis_sd / size, degrees_of_freedom=freedom)
    of_fit = (t.condition, t.calibration.matrix_array, t.p_value, t.misfit)
    return [in_sample, *fit_checks(t, *of_fit, limits, "noise and table")]


def fit_checks(
    t: TriadSummary,
    condition: float,
    matrix: Array,
    p_value: float | None,
    misfit: float | None,
    limits: Parameters,
    allowing: str,
) -> list[Check]:
    """Return the checks of condition, own axes, and residuals by p-value or misfit; `allowing`: what the misfit allows
    for.
    """
    triad, most = t.calibration.triad, largest(limits, "condition_max", "1")
    checks = [check(f"{triad} condition number", condition, most), own_axis_check(triad, matrix)]
    if p_value is not None:
        checks.append(level_check(limits, "residual_p_value_min", f"{triad} {RESIDUALS}", p_value, t.residual_note))
    elif misfit is not None:
        limit = Limit("1", maximum=MISFIT_MAX, source=OURS)
        checks.append(check(f"{triad} residuals over what {allowing} allow", misfit, limit, note=f"worst: {t.worst}"))
    return checks
