"""A triad's field calibration, examined: dead channels and impossible scale factors refused, misfit and its cause."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.calibration.misfit import (
    REMARKABLE,
    Misfit,
    require_live,
    require_plausible_scales,
    residual_misfit,
)
from procedures.analysis.calibration.slow_noise import slow_share
from procedures.analysis.calibration.station_means import StationMeans
from procedures.analysis.field.fit import FieldFit, FieldModel, FieldUncertainty, fit_field, require_levers
from procedures.analysis.field.positions import field_vectors
from procedures.analysis.field.suspects import suspected
from procedures.core.arrays import Array
from procedures.core.errors import Undetermined, UnfitRecording
from procedures.core.recording import ACCELEROMETER, GYRO, Recording


@dataclass(frozen=True)
class FittedTriad:
    """Fit of one triad with its means, its misfit, and the suspected mistake."""

    fit: FieldFit
    means: StationMeans
    misfit: Misfit
    suspected: str
    """A mistake that would explain a misfit."""


def examined_fit(
    what: str, means: StationMeans, noise: Array, known: bool, model: FieldModel, uncertainty: FieldUncertainty
) -> FittedTriad:
    """Fit a triad and judge the fit; `noise` (3, n, n) of the means, `known` where it is of the unit's record.

    Raises `Undetermined`, and `UnfitRecording` for a dead channel or an impossible scale factor, by name, and where a
    mistake in positions or channels would explain what cannot be determined.
    """
    try:
        fit = _plausible_fit(what, means, noise, known, model, uncertainty)
    except (Undetermined, UnfitRecording) as refusal:
        reason = suspected(means.outputs, model)
        if not reason:
            raise
        raise UnfitRecording(f"{refusal}; {reason}") from refusal
    misfit = _misfit(fit, means, noise, known)
    doubtful = misfit.ratio is not None and misfit.ratio > REMARKABLE
    return FittedTriad(fit, means, misfit, suspected(means.outputs, model) if doubtful else "")


def _plausible_fit(
    what: str, means: StationMeans, noise: Array, known: bool, model: FieldModel, uncertainty: FieldUncertainty
) -> FieldFit:
    if model.estimate_scale:
        require_levers(what, model)
        expected = field_vectors(model.positions_rad, model.vector_r, model.tilt, np.array(model.tilt_rad))
        require_live(means.triad, means.outputs, means.output_unit, expected)
    fit = fit_field(what, means.outputs, noise, model, uncertainty, known)
    if model.estimate_scale:
        require_plausible_scales(means.triad, fit.scale, means.output_unit != "count")
    return fit


def _misfit(fit: FieldFit, means: StationMeans, noise: Array, known: bool) -> Misfit:
    slow = 0.0 if known else slow_share(means.slow_excess, noise) * fit.noise_share
    labels = tuple(f"position {i} ({label})" for i, label in enumerate(means.labels, start=1))
    return residual_misfit(fit.residuals, fit.residual_sd, fit.chi_square, fit.degrees_of_freedom, labels, slow)


def require_accelerometers(recordings: Sequence[Recording]) -> None:
    """Refuse recordings of gyros alone, with the way out. Raises `UnfitRecording`."""
    for recording in recordings:
        names = {c.name for c in recording.info.channels}
        if names.isdisjoint(ACCELEROMETER) and names.issuperset(GYRO):
            raise UnfitRecording(
                f"recording {recording.info.id} has only gyros: a field calibration finds the base by accelerometers; "
                "the method gyro_half_turns needs none"
            )
