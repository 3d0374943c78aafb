"""Predicted uncertainty of noise coefficients from a static run: Cramér-Rao bounds from the expected spectrum."""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from procedures.analysis.launch.results import PROCESSES
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import GYRO

CELL_S = 1.0
"""Cell length; the bound omits the faster part of the spectrum, which improves the quantization alone."""
MOST_MODES = 200_000
"""Most cells of a record; longer records use longer cells."""
SURE = 2.33
"""Least ratio of a coefficient's square to the square's standard uncertainty; below it the coefficient is likely to be
reported as not observed (one-sided test at 1 %)."""


@dataclass(frozen=True)
class PredictedCoefficient:
    """One expected noise coefficient and the uncertainty of its estimate."""

    process: str
    unit: str
    """SI unit of the coefficient."""
    value: float
    standard_uncertainty: float
    square_ratio: float
    """The coefficient's square over that square's standard uncertainty: the size of the test's statistic."""


def predicted_noise(
    channel: str, noise: NoiseCoefficients, duration_s: float, launches: int = 1
) -> tuple[PredictedCoefficient, ...]:
    """Cramér-Rao bounds of the processes that are not zero, from `launches` records of `duration_s`.

    Modes f_j = j/2T of the mean rate over cells have the power ``S_j = Q²(2 sin(πf_jΔ)/Δ)² + N² + B²/(2πf_j) +
    K²/(2πf_j)²`` (two-sided density), each chi-square with one degree of freedom: the information on the squares is
    ``½ Σ_j a_j b_j/S_j²``. The rate ramp is a deterministic slope: ``1/σ_R² = Σ_j r_j²/S_j``.
    """
    squares = np.array([getattr(noise, process) ** 2 for process in PROCESSES[:4]])
    if not np.any(squares > 0.0):
        return ()
    present = np.flatnonzero(squares > 0.0)
    columns = _columns(duration_s)[:, present]
    power = columns @ squares[present]
    scaled = columns / power[:, None]
    information = 0.5 * launches * (scaled.T @ scaled)
    size = np.sqrt(np.diagonal(information))
    covariance = np.linalg.inv(information / np.outer(size, size)) / np.outer(size, size)
    names = _si_units(channel)
    found: list[PredictedCoefficient] = []
    for index, variance in zip(present.tolist(), np.diagonal(covariance).tolist(), strict=True):
        value = sqrt(float(squares[index]))
        of_square = sqrt(variance)
        found.append(
            PredictedCoefficient(
                PROCESSES[index],
                names[index],
                value,
                of_square / (2.0 * value),
                float(squares[index]) / of_square,
            )
        )
    return tuple(found)


def unresolved_noise(channel: str, noise: NoiseCoefficients, duration_s: float) -> list[str]:
    """Return a sentence for each process that one launch is too short to distinguish from the others."""
    shown = units.NOISE_DISPLAY["rad/s" if channel in GYRO else "m/s^2"]
    sentences: list[str] = []
    for p in predicted_noise(channel, noise, duration_s):
        if p.square_ratio < SURE:
            unit, size = shown[p.process]
            sentences.append(
                f"{channel}: a {p.process.replace('_', ' ')} of {p.value / size:.3g} {unit} cannot be told from the "
                f"other noise in one launch of {duration_s / units.HOUR:.3g} h (its square is {p.square_ratio:.2g} "
                "standard uncertainties): expect “not observed” in many launches"
            )
    return sentences


def _columns(duration_s: float) -> Array:
    """Power of each mode for unit Q², N², B², K², (modes, 4) [rate²·s]."""
    modes = max(8, min(MOST_MODES, int(duration_s / CELL_S)))
    cell_s = duration_s / modes
    f = np.arange(1, modes) / (2.0 * duration_s)
    omega = 2.0 * pi * f
    quantization = (2.0 * np.sin(pi * f * cell_s) / cell_s) ** 2
    return np.stack([quantization, np.ones(len(f)), 1.0 / omega, 1.0 / omega**2], axis=1)


def _si_units(channel: str) -> tuple[str, str, str, str]:
    if channel in GYRO:
        return "rad", "rad/√s", "rad/s", "rad/s/√s"
    return "m/s", "m/s/√s", "m/s^2", "m/s^2/√s"
