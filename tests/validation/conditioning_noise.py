"""Cell means of a channel's noise, made without the judge: Gauss-Markov bank, cumulative sums, differenced readings.

Numbers are in the thesis's own units. Gyros: deg/h, so Q in arcsec, N in deg/h·√s, K in deg/h/√s; accelerometers: µg.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.signal import lfilter

from procedures.core.noise import NoiseCoefficients
from simulators.truth import Array

HOURS_6 = 21_600
_PER_SQRT_HOUR = 60.0
"""deg/√h in deg/h·√s."""


@dataclass(frozen=True)
class Channel:
    """A channel's noise; its name says where the coefficients are from."""

    name: str
    noise: NoiseCoefficients


def _gyro(name: str, q: float, n: float, b: float, k: float = 0.0) -> Channel:
    return Channel(name, NoiseCoefficients(q, n * _PER_SQRT_HOUR, b, k / _PER_SQRT_HOUR))


GYRO_X = _gyro("gyro x (T 4.1)", 0.39, 0.0014, 0.0016)
GYRO_Z = _gyro("gyro z (T 4.1)", 0.22, 0.0006, 0.0015)
ACCELEROMETER = Channel("accelerometer (T 4.2)", NoiseCoefficients(11.0, 0.0, 0.75))
SYNTHETIC = _gyro("synthetic (T 3.1.2)", 1.5, 0.007, 0.015)
WANDERING = _gyro("random rate walk (T 4.1 z, untrimmed)", 0.22, 0.0006, 0.0015, 0.002)
STATIONARY = (
    _gyro("white", 0.0, 0.0014, 0.0),
    GYRO_X,
    _gyro("gyro y (T 4.1)", 0.26, 0.0011, 0.0017),
    GYRO_Z,
    ACCELEROMETER,
    SYNTHETIC,
)


def noise_cells(noise: NoiseCoefficients, rng: Generator, count: int, rate_hz: float = 1.0) -> Array:
    """Rates of a channel at rest, (count,), one a sample; the slow processes are held through a second."""
    cells = np.zeros(count)
    if noise.quantization > 0.0:
        cells += noise.quantization * rate_hz * np.diff(rng.standard_normal(count + 1))
    if noise.random_walk > 0.0:
        cells += noise.random_walk * np.sqrt(rate_hz) * rng.standard_normal(count)
    held = max(1, round(rate_hz))
    seconds = -(-count // held)
    step_s = held / rate_hz
    if noise.bias_instability > 0.0:
        cells += np.repeat(_flicker(noise, rng, seconds, step_s), held)[:count]
    if noise.rate_random_walk > 0.0:
        walk = noise.rate_random_walk * np.sqrt(step_s) * np.cumsum(rng.standard_normal(seconds))
        cells += np.repeat(walk, held)[:count]
    return cells


def _flicker(noise: NoiseCoefficients, rng: Generator, count: int, step_s: float) -> Array:
    """Three Gauss-Markov processes a decade over the flicker's band, each begun stationary."""
    low, high = np.log(noise.flicker_band_s)
    members = int(np.ceil(3.0 * (high - low) / np.log(10.0)))
    edges = np.linspace(low, high, members + 1)
    total = np.zeros(count)
    sd = noise.bias_instability * np.sqrt((high - low) / members / np.pi)
    for tau in np.exp(0.5 * (edges[:-1] + edges[1:])):
        decay = np.exp(-step_s / tau)
        draws = rng.standard_normal(count) * np.sqrt(1.0 - decay**2)
        draws[0] = rng.standard_normal()
        total += sd * np.asarray(lfilter([1.0], [1.0, -decay], draws))
    return total
