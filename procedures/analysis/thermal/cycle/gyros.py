"""Gyros in a thermal cycle: tests of their rate against temperature and of their noise at rest (thesis 4.2.3)."""

from collections.abc import Sequence
from math import isfinite, log, sqrt

import numpy as np
from scipy.special import chdtrc

from procedures.analysis.noise_fit.estimate import NoiseFit
from procedures.analysis.noise_fit.likelihood import fit_noise
from procedures.analysis.noise_fit.powers import slow_powers
from procedures.analysis.thermal.correlation import Correlation, correlation
from procedures.analysis.thermal.cycle.results import CorrelationFound, GyroNoise, GyroTemperature
from procedures.analysis.thermal.cycle.runs import CycleSettings, PreparedRun
from procedures.analysis.thermal.profile_progress import SENSORS
from procedures.core.arrays import Array
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import AXES

PROCESSES = ("quantization", "random_walk", "bias_instability")
SMALLEST_P = 1e-300


def in_cells(values: Array, sample_s: float, cell_s: float) -> Array:
    """Return the means (n,) of whole cells of a series of one interval."""
    size = round(cell_s / sample_s)
    count = len(values) // size
    return values[: count * size].reshape(count, size).mean(axis=1)


def found(run: str, axis: str, c: Correlation) -> CorrelationFound:
    """Return a correlation as a value of the result."""
    return CorrelationFound(run, axis, c.r, c.effective_samples, c.slope, c.slope_sd, c.p_value)


def gyro_temperatures(
    runs: Sequence[PreparedRun], settings: CycleSettings, known: Sequence[NoiseCoefficients] | None
) -> tuple[GyroTemperature, ...]:
    """Correlate each gyro with its own sensor, run by run and all together.

    `known`: noise of x, y, z from a static run; None: the noise seen in the cycle itself, see `correlation`. The runs'
    p-values are joined by Fisher's ``−2·Σ ln p``, chi-square of twice as many degrees. Raises `UnfitRecording`.
    """
    answers: list[GyroTemperature] = []
    for axis, name in enumerate(AXES):
        sensor = SENSORS.index(f"temperature_gyro_{name}")
        noise = None if known is None else known[axis]
        per_run: list[CorrelationFound] = []
        for run in runs:
            first = round(settings.gyro_trim_s / run.series.sample_s)
            signal, temperature = (
                in_cells(v[first:], run.series.sample_s, settings.cell_s)
                for v in (run.series.gyro_rad_s[:, axis], run.series.sensors_c[:, sensor])
            )
            per_run.append(found(run.series.name, name, correlation(signal, temperature, settings.cell_s, noise)))
        weights = np.array([1.0 / c.slope_sd**2 for c in per_run])
        statistic = -2.0 * sum(log(max(c.p_value, SMALLEST_P)) for c in per_run)
        answers.append(
            GyroTemperature(
                name,
                tuple(per_run),
                float(chdtrc(2 * len(per_run), statistic)),
                float(weights @ [c.slope for c in per_run] / weights.sum()),
                1.0 / sqrt(float(weights.sum())),
            )
        )
    return tuple(answers)


def gyro_noises(
    runs: Sequence[PreparedRun], settings: CycleSettings, known: Sequence[NoiseCoefficients] | None
) -> tuple[GyroNoise, ...]:
    """Return Q, N, B of each gyro in each run by the likelihood of its second means' spectrum. Raises
    `UnfitRecording`.
    """
    answers: list[GyroNoise] = []
    for axis, name in enumerate(AXES):
        beside = None if known is None else _three(known[axis])
        for run in runs:
            first = round(settings.gyro_trim_s / run.series.sample_s)
            powers = slow_powers(run.series.gyro_rad_s[first:, axis], run.series.sample_s)
            fit = fit_noise(powers, None, level=settings.level, confidence=settings.confidence)
            answers.append(_noise(run.series.name, name, fit, beside))
    return tuple(answers)


def _noise(run: str, axis: str, fit: NoiseFit, known: tuple[float, float, float] | None) -> GyroNoise:
    q, n, b = (fit.of(p) for p in PROCESSES)
    return GyroNoise(
        run,
        axis,
        q.value,
        n.value,
        b.value,
        (q.standard_uncertainty, n.standard_uncertainty, b.standard_uncertainty),
        (_finite(q.upper_limit), _finite(n.upper_limit), _finite(b.upper_limit)),
        known,
    )


def _finite(limit: float) -> float | None:
    return limit if isfinite(limit) else None


def _three(noise: NoiseCoefficients) -> tuple[float, float, float]:
    return noise.quantization, noise.random_walk, noise.bias_instability
