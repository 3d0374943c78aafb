"""Growth of position, velocity and attitude errors over hours from a unit's residual errors: covariance by source.

The navigator is linear (`error_model`), so its error is a sum over sources: constants, noise, initial alignment. Noise
enters as the means over even cells of time, whose covariance `station_noise` gives: white, flicker and rate random walk
alike, so that the noise of the alignment is correlated with that of the navigation after it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import brentq
from scipy.special import erf

from procedures.analysis.calibration.station_noise import mean_covariance
from procedures.analysis.navigation.error_model import Place, Responses, responses, self_alignment
from procedures.analysis.navigation.instrument_errors import TriadErrors
from procedures.core.arrays import Array
from procedures.core.noise import NoiseCoefficients

POINTS = 60
"""Number of times, in addition to zero, at which the growth is reported."""
CELLS = 4
"""Cells of noise between two such times. Over a day a cell is 6 min, a fourteenth of the Schuler period: against cells
four times as short, standard deviations of position differ by 0.3 %, of tilts and velocities by 1.5 % (measured).
"""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(200)
"""Quadrature over the circle's angle; with ten times as many nodes the radius differs by 1e-9 at most (measured)."""
SLOW = {
    "random walk": "random_walk",
    "bias instability": "bias_instability",
    "rate random walk": "rate_random_walk",
    "rate ramp": "rate_ramp",
}


@dataclass(frozen=True)
class Alignment:
    """Source of the navigator's initial attitude: its own alignment of a duration, or a given attitude with standard
    deviations.
    """

    duration_s: float | None = None
    """Duration of the self-alignment with the same sensors; None: the attitude was given."""
    tilt_sd_rad: float = 0.0
    """Standard deviation of a given attitude about each horizontal axis."""
    heading_sd_rad: float = 0.0
    velocity_sd_m_s: float = 0.0
    warm_up_s: float = 0.0
    """Time from the launch to the beginning of the alignment."""


@dataclass(frozen=True)
class Growth:
    """Covariance of the navigator's errors over time, (m, 9, 9) by source."""

    time_s: Array
    """Times from zero on, shape (m,)."""
    by_source: Mapping[str, Array]
    """Covariances by source, each (m, 9, 9), over `error_model.STATES`."""

    @property
    def total(self) -> Array:
        """Sum of the covariances over the independent sources, shape (m, 9, 9)."""
        return np.sum(list(self.by_source.values()), axis=0)


def error_growth(
    place: Place,
    attitude: Array,
    gyro: TriadErrors,
    accelerometer: TriadErrors,
    alignment: Alignment,
    duration_s: float,
) -> Growth:
    """Growth over `duration_s` for a unit parked at `attitude` rot_nb (3, 3).

    Quantization counts in the alignment alone, ``2Q²/T²`` of its mean; afterwards it is bounded by Q in angle (√2·Q in
    velocity) and is left out.
    """
    steps = POINTS * CELLS
    grid = responses(place, duration_s, steps)
    constant = _responses_to_constants(place, grid, alignment)[::CELLS]
    sources: dict[str, Array] = {}
    for triad, errors, columns in (("gyro", gyro, slice(0, 3)), ("accelerometer", accelerometer, slice(3, 6))):
        for name, covariance in errors.constant.items():
            answer = constant[:, :, columns] @ attitude
            sources[f"{triad} {name}"] = answer @ covariance @ answer.transpose(0, 2, 1)
    to_level = block_diag(attitude @ gyro.of_channels, attitude @ accelerometer.of_channels)
    sources.update(_noise_growth(place, grid, to_level, gyro.noise, accelerometer.noise, alignment))
    if alignment.duration_s is None:
        a = alignment
        sd = [a.tilt_sd_rad, a.heading_sd_rad, a.tilt_sd_rad, a.velocity_sd_m_s, 0.0, a.velocity_sd_m_s, 0.0, 0.0, 0.0]
        moved = grid.transition[::CELLS] * np.array(sd)
        sources["initial attitude"] = moved @ moved.transpose(0, 2, 1)
    return Growth(np.linspace(0.0, duration_s, POINTS + 1), sources)


def constant_error(place: Place, alignment: Alignment, inputs: Array, duration_s: float) -> Array:
    """Return the errors (9,) after `duration_s` of constant sensor errors (6,) in level axes: gyros, then
    accelerometers.
    """
    grid = responses(place, duration_s, 1)
    return _responses_to_constants(place, grid, alignment)[-1] @ inputs


def radius_containing(probability: float, covariance: Array) -> float:
    """Radius [m] of the circle about the truth that contains `probability` of a Gaussian of covariance (2, 2).

    ``P(R) = ∫ φ(x/σ₁)/σ₁·erf(√(R² − x²)/(σ₂√2)) dx`` over −R…R in the ellipse's own axes, σ₁ the larger.
    """
    sd = np.sqrt(np.maximum(np.linalg.eigvalsh(covariance)[::-1], 0.0))
    if sd[0] == 0.0:
        return 0.0
    small = max(float(sd[1] / sd[0]), 1e-6)

    def outside(radius: float) -> float:
        x, height = radius * np.sin(0.5 * np.pi * _NODES), radius * np.cos(0.5 * np.pi * _NODES)
        density = np.exp(-0.5 * x**2) / np.sqrt(2.0 * np.pi) * erf(height / (small * np.sqrt(2.0))) * height
        return float(0.5 * np.pi * _WEIGHTS @ density) - probability

    return float(sd[0] * brentq(outside, 0.0, 12.0))


def _responses_to_constants(place: Place, grid: Responses, alignment: Alignment) -> Array:
    """Errors over the grid per constant sensor error, (n + 1, 9, 6), from navigation and any self-alignment."""
    answer = grid.of_constant
    return answer if alignment.duration_s is None else answer + grid.transition @ self_alignment(place)


def _noise_growth(
    place: Place,
    grid: Responses,
    to_level: Array,
    gyro: tuple[NoiseCoefficients, ...],
    accelerometer: tuple[NoiseCoefficients, ...],
    alignment: Alignment,
) -> dict[str, Array]:
    """Covariances (m, 9, 9) of every kind of noise that a triad has."""
    before = alignment.duration_s or grid.step_s
    edges = alignment.warm_up_s + before + np.arange(len(grid.of_cell) + 1) * grid.step_s
    windows = np.vstack([[alignment.warm_up_s, edges[0]], np.column_stack([edges[:-1], edges[1:]])])
    first = np.zeros((9, 6)) if alignment.duration_s is None else self_alignment(place)
    start = grid.transition @ first
    found: dict[str, Array] = {}
    cells = _CellCovariances(windows)
    for offset, triad, noise in ((0, "gyro", gyro), (3, "accelerometer", accelerometer)):
        for title, name in SLOW.items():
            total = np.zeros((POINTS + 1, 9, 9))
            for c, channel in enumerate(noise):
                covariance = cells.of(channel, name)
                if np.any(covariance):
                    column = to_level[:, offset + c]
                    total += _carried(start @ column, grid.of_cell @ column, covariance)
            if np.any(total):
                found[f"{triad} {title}"] = total
    return found


class _CellCovariances:
    """Covariances of the means over the alignment and the cells; those of unit noise are computed once."""

    def __init__(self, windows: Array) -> None:
        self._windows = windows
        self._unit: dict[tuple[str, tuple[float, float]], Array] = {}

    def of(self, noise: NoiseCoefficients, name: str) -> Array:
        """Covariance of one noise process, shape (n + 1, n + 1) [rate²]; quantization counts in the first window."""
        size: float = getattr(noise, name)
        covariance = size**2 * self._of_unit(name, noise.flicker_band_s) if size > 0.0 else self._none()
        if name == "random_walk":
            covariance[0, 0] += 2.0 * (noise.quantization / (self._windows[0, 1] - self._windows[0, 0])) ** 2
        return covariance

    def _of_unit(self, name: str, band_s: tuple[float, float]) -> Array:
        if (name, band_s) not in self._unit:
            alone = replace(NoiseCoefficients(flicker_band_s=band_s), **{name: 1.0})
            self._unit[name, band_s] = mean_covariance(alone, self._windows)
        return self._unit[name, band_s]

    def _none(self) -> Array:
        return np.zeros((len(self._windows), len(self._windows)))


def _carried(start: Array, of_cell: Array, covariance: Array) -> Array:
    """Sum over pairs of cells: errors per mean of the alignment, start (n + 1, 9), and per cell, of_cell (n, 9)."""
    total = np.zeros((POINTS + 1, 9, 9))
    for m in range(POINTS + 1):
        k = m * CELLS
        answer = np.column_stack([start[k], of_cell[:k][::-1].T])
        total[m] = answer @ covariance[: k + 1, : k + 1] @ answer.T
    return total
