"""Calibration results of one triad, as plain JSON-ready numbers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.calibration.budget import Budget
from procedures.analysis.calibration.estimator import Weighting
from procedures.analysis.calibration.misfit import residual_misfit
from procedures.analysis.calibration.multiposition import TriadFit
from procedures.analysis.calibration.scalar import PARAMETERS, ScalarFit, observable_derivative, scalar_parameters
from procedures.analysis.calibration.verification import Magnitudes
from procedures.core.coefficient_name import CoefficientName
from procedures.core.imu_model import COEFFICIENT_NAMES, TriadCalibration, coefficient_unit


@dataclass(frozen=True)
class Coefficient:
    """Coefficient of ``U = b + K·v`` with its standard uncertainty and the contributions to it."""

    name: CoefficientName
    unit: str
    estimate: float
    standard_uncertainty: float
    from_noise: float
    from_table: float
    from_table_source: dict[str, float]
    """The table's part by source: orthogonality, level, azimuth, gravity, pointing."""


@dataclass(frozen=True)
class StationResidual:
    """Outputs minus model at one station, channels x, y, z, and the expected standard deviation of each residual."""

    label: str
    residual: tuple[float, ...]
    expected_sd: tuple[float, ...]


@dataclass(frozen=True)
class ScalarParameter:
    """Cross-check of one of the nine parameters: from magnitudes alone, from the linear fit, and their difference."""

    name: str
    unit: str
    scalar: float
    standard_uncertainty: float
    linear: float
    difference_sigmas: float
    """Difference in standard deviations of the difference, both estimates' common data allowed for."""


@dataclass(frozen=True)
class ScalarCheck:
    """The scalar calibration of the same stations, which trusts no angle of the table."""

    parameters: tuple[ScalarParameter, ...]
    condition: float
    p_value: float | None


@dataclass(frozen=True)
class TriadSummary:
    """Complete calibration results of one triad: coefficients, residuals, tests, magnitudes, budgets."""

    calibration: TriadCalibration
    coefficients: tuple[Coefficient, ...]
    condition: float
    residuals: tuple[StationResidual, ...]
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None
    noise_known: bool
    magnitudes: Magnitudes
    scalar: ScalarCheck | None = None
    weighting: Weighting = "noise"
    """Weights of the fit; results of procedure versions before 1.1.0 lack the field and were weighted by noise."""
    misfit: float | None = None
    """Residuals over what noise and table allow; None without a spare equation and in results of older versions."""
    worst: str = ""
    """Station and channel with the greatest residual."""
    left_out: Magnitudes | None = None
    """Magnitudes out of sample, each station corrected by the fit of the others; None where that cannot be made."""
    suspect: str = ""  # by `triad_analysis.suspected`, from all triads of the same stations
    """The flaw of the reference that the residuals look like, as a sentence; empty where they are as declared."""
    budgets: tuple[Budget, ...] = ()
    """Uncertainty budget of each coefficient; empty in results of older versions."""

    @property
    def residual_note(self) -> str:
        """Note for the check of the residuals: where the greatest one is, and what they look like."""
        return "; ".join(text for text in (f"worst: {self.worst}", self.suspect) if text)


def triad_summary(
    fit: TriadFit,
    magnitudes: Magnitudes,
    labels: Sequence[str],
    scalar: ScalarCheck | None = None,
    slow: float = 0.0,
    left_out: Magnitudes | None = None,
) -> TriadSummary:
    """Return the numbers of a fit, ready to be stored. `slow`: share of slow noise, where the noise is not known.
    `scalar` and `left_out`: the cross-checks, None where they were not made.
    """
    misfit = residual_misfit(fit.residuals, fit.residual_sd, fit.chi_square, fit.degrees_of_freedom, labels, slow)
    return TriadSummary(
        fit.calibration(),
        _coefficients(fit),
        fit.condition,
        tuple(
            StationResidual(label, tuple(r.tolist()), tuple(sd.tolist()))
            for label, r, sd in zip(labels, fit.residuals, fit.residual_sd, strict=True)
        ),
        fit.chi_square,
        fit.degrees_of_freedom,
        fit.p_value,
        fit.noise_known,
        magnitudes,
        scalar,
        fit.weighting,
        misfit.ratio,
        misfit.worst,
        left_out,
    )


def _coefficients(fit: TriadFit) -> tuple[Coefficient, ...]:
    total = np.sqrt(np.diagonal(fit.covariance))
    noise = np.sqrt(np.diagonal(fit.noise_covariance))
    table = np.sqrt(np.diagonal(fit.table.covariance))
    sources = fit.table.by_source()
    return tuple(
        Coefficient(
            CoefficientName(fit.triad, name),
            coefficient_unit(name, fit.output_unit, fit.input_unit),
            float(fit.coefficients[i]),
            float(total[i]),
            float(noise[i]),
            float(table[i]),
            {source: float(part[i]) for source, part in sources.items()},
        )
        for i, name in enumerate(COEFFICIENT_NAMES)
    )


def scalar_check(fit: TriadFit, scalar: ScalarFit) -> ScalarCheck:
    """Scalar against linear, parameter by parameter.

    Both are functions of the same outputs, so the difference has the covariance ``D·(C + F·Fᵀ)·Dᵀ`` with
    ``D = J·G_linear − G_scalar`` over all outputs of all channels, C noise and F the table's flaws; G_linear is the
    estimator that made the fit, with its own weights.
    """
    linear_gain = np.einsum("pk,kcn->pnc", observable_derivative(fit.coefficients), fit.estimator.gain)
    difference = linear_gain - scalar.gain
    variance = np.einsum("pnc,cnm,pmc->p", difference, fit.station_noise, difference)
    flaws = np.einsum("pnc,ncq->pq", difference, fit.of_table)
    sd = np.sqrt(variance + np.sum(flaws**2, axis=1))
    linear = scalar_parameters(fit.coefficients)
    own = scalar.standard_uncertainties
    parameters = tuple(
        ScalarParameter(
            name,
            _scalar_unit(name, fit),
            float(scalar.parameters[i]),
            float(own[i]),
            float(linear[i]),
            float((scalar.parameters[i] - linear[i]) / sd[i]) if sd[i] > 1e-9 * own[i] else 0.0,
        )
        for i, name in enumerate(PARAMETERS)
    )
    return ScalarCheck(parameters, scalar.condition, scalar.p_value)


def _scalar_unit(name: str, fit: TriadFit) -> str:
    if name.startswith("t"):
        return "rad"
    if name.startswith("b"):
        return fit.output_unit
    return "1" if fit.output_unit == fit.input_unit else f"{fit.input_unit}/{fit.output_unit}"
