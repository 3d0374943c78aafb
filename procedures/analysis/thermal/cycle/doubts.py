"""Warnings that limit the confidence in the numbers of a thermal cycle."""

from collections.abc import Sequence

from procedures.analysis.thermal.cycle.forms import RunSoaks
from procedures.analysis.thermal.cycle.results import AxisFound, RunFound
from procedures.analysis.thermal.cycle.runs import CycleSettings
from procedures.core.recording import AXES

SINGLE_REGIME_SHARE = 0.02
"""Share of a run in a regime below which that regime is not reported."""
WORSE = 1.5
"""A dynamic regime that the fit explains so many times worse than the static one has heat where no sensor is. Tried on
the rig: 0.8 to 1.0 where every term acts at a sensor, 2.4 to 2.8 where some act at a block without one."""
REFERENCE_WITHIN_C = 8.0
"""Greatest distance of a reference soak from the reference temperature without a warning."""


def doubts(
    runs: Sequence[RunFound], soaked: Sequence[RunSoaks], axes: Sequence[AxisFound], settings: CycleSettings
) -> list[str]:
    """Return warnings that limit the confidence in the numbers of a cycle."""
    warnings: list[str] = []
    for run, soak in zip(runs, soaked, strict=True):
        warnings += _of_regimes(run, settings.regime.delay_s)
        if abs(soak.reference.case_c - settings.reference_c[0]) > REFERENCE_WITHIN_C:
            warnings.append(
                f"{run.name}: the soak nearest to the reference of {settings.reference_c[0]:g} °C had its case at "
                f"{soak.reference.case_c:.1f} °C: 3σ is about that one, and K0 and B0 are extrapolated"
            )
    for name, axis in zip(AXES, axes, strict=True):
        still, moving = axis.residual_sd_m_s2
        if still and moving and moving > WORSE * still:
            warnings.append(
                f"accelerometer {name}: what the fit leaves is {moving / still:.1f} times as large on ramps as in "
                f"soaks ({moving:.2g} against {still:.2g} m/s²): heat acts where no sensor is, or a sensor's lag is "
                "not what it was given as"
            )
        if axis.preferred_order != 2:
            warnings.append(
                f"accelerometer {name}: by the Bayesian criterion order {axis.preferred_order} describes the cycle "
                f"best, the correction is of the second ({axis.order_reason})"
            )
    return warnings


def _of_regimes(run: RunFound, delay_s: float) -> list[str]:
    warnings: list[str] = []
    if min(run.static_share, 1.0 - run.static_share) < SINGLE_REGIME_SHARE:
        warnings.append(f"{run.name}: {run.static_share:.0%} of the run was static: one regime is hardly there")
    for number, (leg, regime) in enumerate(zip(run.legs, run.regimes, strict=True), start=1):
        where = f"{run.name}, leg {number} ({leg.target_c:g} °C)"
        if regime.onset_delay_s is not None and regime.onset_delay_s > delay_s:
            warnings.append(
                f"{where}: the regime became dynamic {regime.onset_delay_s:.0f} s after the ramp began, later than the "
                f"indicator's {delay_s:.0f} s"
            )
        if regime.chatter:
            warnings.append(f"{where}: the regime became dynamic {regime.chatter} times with no ramp to explain it")
    return warnings
