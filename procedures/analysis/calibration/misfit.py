"""Misfit of a fit to its poses: residuals against the noise within the poses, and the worst pose.

Unknown noise is taken from the data, and a fit's uncertainty is scaled up to its residuals. That alone hides
a bad fit behind a wide interval. The scatter within the poses does not see the model, so the ratio of the two shows it:

``ratio = √(χ²/ν / (1 + κ))``

with χ² against the scatter within the poses, ν the spare equations and κ the share of slow noise (`slow_noise`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.calibration.magnitude import magnitude_gradient
from procedures.analysis.calibration.scalar import ScalarFit
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.limits import OURS, Check, Limit, check

MISFIT_MAX = 5.0
"""Residuals so many times the scatter within the poses fail. One pose of real units has two to three: hands creep and
sensors are not quite linear."""
REMARKABLE = 2.0
"""Threshold of the ratio beyond which a passing fit carries a warning."""
ALIKE = 0.75
"""Least sensitivity to a pose, relative to the most sensitive channel's, at which a channel is named with it."""
DEAD = 0.02
"""Least span of a live channel's means, relative to the median span of its triad."""
SCALE_WITHIN = 2.5
"""Scale factors of nominal outputs beyond this, or under its inverse, are a wrong unit. A rate that is
off by two leaves a scale factor of two, which the inspection names."""
SCALES_ALIKE = 20.0
"""Scale factors of one triad in counts that differ by more are not those of three like channels."""


@dataclass(frozen=True)
class Misfit:
    """Misfit of a fit: its residuals relative to the noise within its poses."""

    ratio: float | None
    """Root mean square of the residuals over what the scatter allows; None where no equation is spare."""
    spare: int
    """Degrees of freedom: equations more than unknowns."""
    worst: str
    """The pose and the channels with the greatest residual; empty where the fit has none to name."""

    @property
    def sentences(self) -> tuple[str, ...]:
        """Warnings about a fit that is not perfect, whether it passes or not."""
        if self.ratio is None and self.spare > 0:
            return (
                "nothing of the poses' noise is in the data and none is given: a bad fit cannot be told from noise; "
                f"the greatest residual is at {self.worst}",
            )
        if self.ratio is None:
            return (
                "as many unknowns as equations: nothing is left to check the fit with, and its residuals are zero "
                "however wrong a pose is; add poses",
            )
        if self.ratio > REMARKABLE:
            return (
                f"the residuals are {self.ratio:.3g} times what the scatter within the poses allows, the worst at "
                f"{self.worst}",
            )
        return ()

    def checks(self, name: str, limit: float, source: str = OURS) -> tuple[Check, ...]:
        """Return the check of the ratio against its limit; nothing where no equation is left to check with."""
        if self.ratio is None:
            return ()
        bound = Limit("1", maximum=limit, source=source)
        return (check(name, self.ratio, bound, note=f"worst: {self.worst}"),)


def ratio_of(chi_square: float, spare: int, slow: float = 0.0) -> float | None:
    """Return ``√(χ²/ν/(1 + κ))``; None where no equation is spare."""
    return float(np.sqrt(chi_square / spare / (1.0 + slow))) if spare > 0 else None


def scalar_misfit(fit: ScalarFit, outputs: Array, labels: tuple[str, ...], slow: float) -> Misfit:
    """Return the misfit of a scalar calibration of outputs (n, 3); names the channels with most weight in the worst
    magnitude.
    """
    ratio = ratio_of(fit.chi_square, fit.degrees_of_freedom, slow)
    if ratio is None:
        return Misfit(None, fit.degrees_of_freedom, "")
    shown = fit.residual_sd > 1e-6 * np.max(fit.residual_sd)
    sigmas = np.where(shown, np.abs(fit.residuals) / np.where(shown, fit.residual_sd, 1.0), 0.0)
    pose = int(np.argmax(sigmas))
    centred = outputs[[pose]] - fit.parameters[:3]
    share = np.abs(magnitude_gradient(centred @ fit.correction.T, fit.correction)[0] / fit.parameters[3:6])
    channels = [axis for axis, s in zip("xyz", share.tolist(), strict=True) if s >= ALIKE * share.max()]
    where = f"{labels[pose]}, channel{'s' if len(channels) > 1 else ''} {' and '.join(channels)}"
    return Misfit(ratio, fit.degrees_of_freedom, f"{where} ({fit.residuals[pose]:+.3g} of the magnitude)")


def residual_misfit(
    residuals: Array, expected_sd: Array, chi_square: float, spare: int, labels: Sequence[str], slow: float = 0.0
) -> Misfit:
    """Return the misfit of residuals (n, 3), channel by channel, with their expected standard deviations (n, 3)."""
    ratio = ratio_of(chi_square, spare, slow)
    if ratio is None:
        return Misfit(None, spare, "")
    shown = expected_sd > 1e-6 * np.max(expected_sd)
    sigmas = np.where(shown, np.abs(residuals) / np.where(shown, expected_sd, 1.0), 0.0)
    pose, channel = divmod(int(np.argmax(sigmas)), residuals.shape[1])
    return Misfit(ratio, spare, f"{labels[pose]}, channel {'xyz'[channel]} ({residuals[pose, channel]:+.3g})")


def require_live(triad: str, outputs: Array, output_unit: str, expected: Array | None = None) -> None:
    """Refuse means (n, 3) of which a channel does not change from pose to pose as the others do. Raises
    `UnfitRecording`.

    `expected` (n, 3) are the inputs where they are known; else every channel is expected to change about equally.
    """
    spans = np.ptp(outputs, axis=0)
    felt = spans / (1.0 if expected is None else np.ptp(expected, axis=0))
    for axis, span, ratio in zip("xyz", spans.tolist(), felt.tolist(), strict=True):
        if ratio < DEAD * np.median(felt):
            raise UnfitRecording(
                f"{triad} {axis} changes by {span:.3g} {output_unit} between the poses, its most sensitive channel "
                f"by {spans.max():.3g}: the channel is stuck or gives no signal, or no pose turns it to the reference"
            )


def require_plausible_scales(triad: str, scales: Array, nominal: bool) -> None:
    """Refuse scale factors (3,) that are negative or absurd, naming the channel. Raises `UnfitRecording`.

    `nominal`: the outputs are in SI units, so that a scale factor near one is expected; counts are compared with each
    other alone.
    """
    sizes = np.abs(scales)
    middle = 1.0 if nominal else float(np.median(sizes))
    allowed = SCALE_WITHIN if nominal else SCALES_ALIKE
    for axis, scale in zip("xyz", scales.tolist(), strict=True):
        if not np.isfinite(scale) or scale < 0.0:
            raise UnfitRecording(
                f"the scale factor of {triad} {axis} comes out as {scale:.4g}: the channel is reversed or exchanged "
                "with another, or the positions are not those that are declared"
            )
        if not middle / allowed <= scale <= middle * allowed:
            what = "one" if nominal else f"the triad's middle one, {middle:.3g}"
            raise UnfitRecording(
                f"the scale factor of {triad} {axis} comes out as {scale:.4g}, more than {allowed:g} times off {what}: "
                "the channel gives no signal, is clipped, or is in another unit than declared"
            )
