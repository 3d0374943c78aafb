"""Scale factor of a gyro triad from whole turns of the table (IEEE Std 647, scale factor by whole revolutions).

A recording begins and ends with the table at rest at the same angle and holds n whole turns of its outer axis, so each
channel's integrated output is, exactly and for any shape of the ramps,

    ``y = b·T + K·(2πn·e + E) + ½·s·∫|a| dt + q/a₀·∫a² dt + c/a₀²·∫a³ dt``

with e the turning axis and E the Earth's turn, both in the unit's axes, ``a(t) = (K·e)·ω(t)`` the channel's own output,
s the asymmetry (scale factor for positive less that for negative rates, relative), q and c the quadratic and the cubic
share of the output at the reference rate a₀. Of n and −n turns b, E, s and q go into the half sum, K and c into the
half difference ``(y₊ − y₋)/2 = 2πn·K·e + …``: neither the Earth's rate nor the bias touches a scale factor. All
stations of all three axes are fitted at once by generalised least squares, weighted by noise and by the table's
declared flaws.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, pi
from typing import Literal

import numpy as np
from scipy.linalg import block_diag

from procedures.analysis.calibration.table_errors import TableErrors, TableUncertainty, per_latitude, table_errors
from procedures.analysis.least_squares.chi_square import judged_p_value
from procedures.analysis.least_squares.determination import require_full_rank
from procedures.analysis.least_squares.inverse import scaled_pinv
from procedures.analysis.least_squares.whitening import whitener
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.frames import earth_rate_b, table_rotation
from procedures.core.recording import Station
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles
from procedures.core.turn import Turn

Term = Literal["asymmetry", "quadratic", "cubic"]
TERMS: tuple[Term, ...] = ("asymmetry", "quadratic", "cubic")

RAMP_SQUARE, RAMP_CUBE = 13.0 / 35.0, 43.0 / 140.0
"""Means of the ramp's ``(3s² − 2s³)²`` and of its cube."""
UNKNOWN_NOISE_SD = units.ARCSEC
"""Noise assumed in [rad] while it is not known, until the residuals scale it."""

_CROSS = np.eye(9).reshape(9, 3, 3)[[1, 2, 3, 5, 6, 7]]
"""Matrices with a single one in place of each cross-coupling, (6, 3, 3)."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(32)


@dataclass(frozen=True)
class Turning:
    """Motion of the unit with the table during n stations, in the unit's axes."""

    seconds: Array
    """Length T of each recording [s], (n,)."""
    axis_b: Array
    """Unit vector of the turning axis e, (n, 3)."""
    angle_rad: Array
    """The whole turns, signed, (n,)."""
    rate_rad_s: Array
    """The constant rate, signed, (n,)."""
    earth_rad: Array
    """Earth's turn E during each recording, in the unit's axes [rad], (n, 3)."""
    moments: Array
    """``∫|ω| dt``, ``∫ω² dt``, ``∫ω³ dt`` of the table's rate [rad, rad²/s, rad³/s²], (n, 3)."""
    angles: tuple[TableAngles, ...]
    """Table angles at the beginning and the end of each recording."""
    earth_rate_b: Array
    """Earth's rate in the unit's axes at these angles [rad/s], (n, 3)."""

    @property
    def turned_b(self) -> Array:
        """Turn vector ``2πn·e`` of each station, (n, 3) [rad]."""
        return self.angle_rad[:, None] * self.axis_b

    @property
    def channels(self) -> tuple[int, ...]:
        """Index of the unit's axis that each station turns about: the one nearest to e."""
        return tuple(int(i) for i in np.argmax(np.abs(self.axis_b), axis=1))


def turning(stations: Sequence[Station], seconds: Array, site: Site) -> Turning:
    """Geometry of stations that last `seconds` (n,) each. Raises `BadParameter` where one does not turn the outer axis.

    The motion is symmetric about its middle, so of the Earth's turn across the axis only ``∫cos θ dt`` remains, the
    same for n and −n: ``E = e·(e·Ω)·T + Ω_⊥·∫cos θ dt`` with Ω in the unit's axes at rest. The axis is taken to be
    vertical for this: a level error of an arcsecond would change E by some 1e-9 rad.
    """
    turns, angles = _turns(stations)
    axis = np.array([table_rotation(a).inv().apply([0.0, 1.0, 0.0]) for a in angles])
    earth = earth_rate_b(list(angles), site)
    along = np.einsum("nj,nj->n", earth, axis)[:, None] * axis
    cosine = np.array([_cosine_integral(turn, float(t)) for turn, t in zip(turns, seconds, strict=True)])
    rate = units.DEG * np.array([turn.rate_deg_s * np.sign(turn.turns) for turn in turns])
    ramp = np.array([turn.ramp_s for turn in turns])
    steady = np.array([turn.duration_s for turn in turns]) - 2.0 * ramp
    square = rate**2 * (steady + 2.0 * ramp * RAMP_SQUARE)
    cube = rate**3 * (steady + 2.0 * ramp * RAMP_CUBE)
    angle = units.DEG * np.array([turn.angle_deg for turn in turns])
    return Turning(
        np.asarray(seconds, dtype=np.float64),
        axis,
        angle,
        rate,
        along * np.asarray(seconds)[:, None] + (earth - along) * cosine[:, None],
        np.column_stack([np.abs(angle), square, cube]),
        angles,
        earth,
    )


def _turns(stations: Sequence[Station]) -> tuple[tuple[Turn, ...], tuple[TableAngles, ...]]:
    turns = tuple(s.turn for s in stations if s.turn is not None and s.turn.axis == "outer")
    angles = tuple(s.angles for s in stations if s.angles is not None)
    if not len(turns) == len(angles) == len(stations) or not stations:
        raise BadParameter("stations", len(stations), "each must be at known angles and turn the outer axis")
    return turns, angles


def _cosine_integral(turn: Turn, seconds: float) -> float:
    """``∫cos θ dt`` over a recording [s]: at rest 1, the ramps by Gauss-Legendre, the steady part in closed form.

    A ramp is cut so that the axis turns by half a turn at most in each piece.
    """
    rate = turn.rate_deg_s * units.DEG
    pieces = ceil(rate * turn.ramp_s / pi)
    s = (np.arange(pieces)[:, None] + 0.5 * (_NODES + 1.0)) / pieces
    on_ramp = 0.5 * float(np.sum(np.cos(rate * turn.ramp_s * s**3 * (1.0 - 0.5 * s)) @ _WEIGHTS)) / pieces
    steady = -2.0 * float(np.sin(0.5 * rate * turn.ramp_s)) / rate
    return seconds - turn.duration_s + 2.0 * turn.ramp_s * on_ramp + steady


def turn_flaws(motion: Turning, uncertainty: TableUncertainty) -> TableErrors:
    """Effect of the table's flaws on the turned angle and on the Earth's turn meanwhile, ∂v/∂p (n, 3, P).

    Columns as `table_errors` has them. The axis' direction in the unit and the angles at the ends change the turned
    angle; the outer axis' pointing counts twice, at the beginning and at the end, independently: √2 along the axis.
    Level and azimuth move axis and unit together and change the Earth's turn E alone: a heading ψ turns its part across
    the axis, ``δE = δψ·(E × e)``, and a tilt about a horizontal h its part along it, ``δE = δε·T·e·(e·(Ω × h))``; a
    latitude φ likewise, ``δE = δφ·T·e·(e·∂Ω/∂φ)``. What tilt and latitude change across the axis is left out: it comes
    and goes with every turn.
    """
    u = replace(uncertainty, gravity_relative_sd=0.0, mounting_sd_arcsec=0.0)
    flaws = table_errors(motion.angles, motion.turned_b, u, of_gravity=False)
    for i, (angles, axis) in enumerate(zip(motion.angles, motion.axis_b, strict=True)):
        flaws.sensitivity[i, :, 6 + 3 * i] = np.sqrt(2.0) * axis
        across = table_rotation(angles).inv()
        for column, level in ((2, across.apply([1.0, 0.0, 0.0])), (3, across.apply([0.0, 0.0, 1.0]))):
            along = float(axis @ np.cross(motion.earth_rate_b[i], level))
            flaws.sensitivity[i, :, column] = motion.seconds[i] * along * axis
        flaws.sensitivity[i, :, 4] = np.cross(motion.earth_rad[i], axis)
    if uncertainty.latitude_sd_arcsec > 0.0:
        along = np.sum(motion.axis_b * per_latitude(motion.angles, motion.earth_rate_b), axis=1)
        flaws.sensitivity[:, :, -1] = (motion.seconds * along)[:, None] * motion.axis_b
    return flaws


def parameter_names(terms: Sequence[Term]) -> tuple[str, ...]:
    """Return the names of a channel's parameters, in the order of the design's columns."""
    return ("b", "K1", "K2", "K3", *terms)


def design(motion: Turning, slopes: Array, terms: Sequence[Term], reference_rad_s: float) -> Array:
    """Columns of b, K_i1…K_i3 and of the terms for each channel, shape (3, n, 4 + terms).

    `slopes` (n, 3) is K·e as far as known, channel by channel: ``a = slope·ω``.
    """
    linear = np.column_stack([motion.seconds, motion.turned_b + motion.earth_rad])
    size = np.abs(slopes)
    columns = {
        "asymmetry": 0.5 * size * motion.moments[:, :1],
        "quadratic": size**2 * motion.moments[:, 1:2] / reference_rad_s,
        "cubic": slopes**3 * motion.moments[:, 2:] / reference_rad_s**2,
    }
    # The sign of a channel's output is that of slope·ω, which |a| and a² do not show and a³ does.
    return np.array([np.column_stack([linear, *(columns[t][:, c] for t in terms)]) for c in range(3)])


@dataclass(frozen=True)
class TurnEstimator:
    """Generalised least squares of all three channels: the gain on the integrated outputs and the covariance.

    Parameters are ordered channel by channel, k of each; outputs channel by channel, n of each.
    """

    design: Array
    """Design matrix of each channel, (3, n, k)."""
    gain: Array
    """Gain from outputs to parameters, (3k, 3n)."""
    weights: Array
    """W with ``WᵀW`` the inverse of the outputs' covariance, (3n, 3n)."""
    noise_covariance: Array
    """Noise covariance of the parameters, (3k, 3k)."""
    table_per_sd: Array
    """Change of the parameters per standard deviation of each flaw, (3k, P)."""
    source: tuple[str, ...]
    condition: float

    @property
    def covariance(self) -> Array:
        """Noise and table together, (3k, 3k)."""
        return self.noise_covariance + self.table_per_sd @ self.table_per_sd.T

    def of_source(self, source: str) -> Array:
        """Return the standard uncertainties (3k,) from one of the table's flaws."""
        return np.sqrt(np.sum(self.table_per_sd[:, [s == source for s in self.source]] ** 2, axis=1))


def turn_estimator(
    motion: Turning,
    slopes: Array,
    terms: Sequence[Term],
    reference_rad_s: float,
    noise: Array | None,
    flaws: TableErrors,
    matrix: Array,
    cross_sd: float = 0.0,
) -> TurnEstimator:
    """``x̂ = (AᵀS⁻¹A)⁻¹AᵀS⁻¹·y`` with ``S = C + F·Fᵀ``, C the noise of the integrated outputs and F the table's flaws.

    `noise` (3, n, n) is the covariance of the station means [(rad/s)²], None where it is not known: then all outputs
    weigh alike, and only the flaws that stay through the job are added. `matrix` K carries the flaws into the outputs;
    its cross-couplings may each be off by `cross_sd`, as before a unit is calibrated: an axis that lies wrong by ε puts
    ``K_ij·ε`` into a scale factor, of which the diagonal of K knows nothing.
    Raises `Undetermined` naming the parameters that the rates cannot separate.
    """
    columns = design(motion, slopes, terms, reference_rad_s)
    channels, n, _ = columns.shape
    condition = max(
        require_full_rank(f"the coefficients of gyro {axis} (fewer terms need fewer rates)", a, parameter_names(terms))
        for axis, a in zip("xyz", columns, strict=True)
    )
    seconds = np.outer(motion.seconds, motion.seconds)
    own = np.eye(channels * n) * UNKNOWN_NOISE_SD**2 if noise is None else block_diag(*[c * seconds for c in noise])
    matrices = [matrix, *(cross_sd * unknown for unknown in _CROSS if cross_sd > 0.0)]
    of_table = np.hstack([flaws.of_outputs(m).transpose(1, 0, 2).reshape(channels * n, -1) for m in matrices])
    source = flaws.source * len(matrices)
    if noise is None:
        of_table = of_table * np.array([s != "pointing" for s in source], dtype=np.float64)
        weights = whitener(own)
    else:
        weights = whitener(own + of_table @ of_table.T)
    gain = scaled_pinv(weights @ block_diag(*columns)) @ weights
    return TurnEstimator(columns, gain, weights, gain @ own @ gain.T, gain @ of_table, source, condition)


@dataclass(frozen=True)
class TurnFit:
    """Coefficients of a gyro triad from whole turns."""

    estimator: TurnEstimator
    parameters: Array
    """(3, k), channel by channel as `parameter_names`."""
    covariance: Array
    """(3k, 3k), scaled by the residuals where the noise was not known."""
    noise_covariance: Array
    residuals: Array
    """Integrated outputs minus model, (n, 3) [rad]."""
    output_sd: Array
    """Expected standard deviation of each integrated output by noise and table, (n, 3) [rad]."""
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None
    """P-value of chi-square; None where the noise was not known."""


def fit_turns(
    motion: Turning,
    outputs: Array,
    terms: Sequence[Term],
    reference_rad_s: float,
    noise: Array | None,
    flaws: TableErrors,
) -> TurnFit:
    """Fit integrated outputs (n, 3) [rad]; K and slopes for the weights come from plain least squares beforehand.

    `flaws`: those of the table on this motion (`turn_flaws`). `noise` as in `turn_estimator`; None: it is scaled to the
    residuals.
    """
    slopes = outputs / motion.angle_rad[:, None]
    first = turn_estimator(motion, slopes, (), reference_rad_s, None, flaws, np.eye(3))
    matrix = (first.gain @ outputs.T.ravel()).reshape(3, 4)[:, 1:]
    plan = turn_estimator(motion, motion.axis_b @ matrix.T, terms, reference_rad_s, noise, flaws, matrix)
    return fitted(plan, outputs, noise is not None)


def fitted(plan: TurnEstimator, outputs: Array, noise_known: bool) -> TurnFit:
    """Return the fit of integrated outputs (n, 3) [rad] by an estimator; unknown noise is scaled to the residuals."""
    parameters = (plan.gain @ outputs.T.ravel()).reshape(3, -1)
    modelled = np.einsum("cnk,ck->nc", plan.design, parameters)
    residuals = outputs - modelled
    whitened = plan.weights @ residuals.T.ravel()
    chi_square, freedom = float(whitened @ whitened), residuals.size - parameters.size
    factor = 1.0 if noise_known or freedom == 0 else chi_square / freedom
    noise_covariance = factor * plan.noise_covariance
    output_sd = np.sqrt(factor * np.diagonal(np.linalg.inv(plan.weights.T @ plan.weights))).reshape(3, -1).T
    p_value = judged_p_value(chi_square, freedom, noise_known)
    covariance = noise_covariance + plan.table_per_sd @ plan.table_per_sd.T
    return TurnFit(plan, parameters, covariance, noise_covariance, residuals, output_sd, chi_square, freedom, p_value)
