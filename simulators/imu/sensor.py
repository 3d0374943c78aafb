"""Forward model of a triad: true motion in, integer counts out.

``U = b + a + ½·asymmetry·|a| + nonlinearity·a²/reference`` with ``a = K·v`` (thesis 3.30, 3.34, plus two even terms),
integrated over a sample, plus noise, into a counter that keeps its phase: ``count = floor(phase/LSB)`` differences.
Written without sight of the inverse that the analysis uses.
"""

from dataclasses import dataclass
from math import ldexp

import numpy as np
from numpy.typing import NDArray

from procedures.bench.errors import DeviceFault
from procedures.core import units
from simulators.imu.noise import TriadNoise
from simulators.truth import Array, TriadTruth, keyed_generator

TRIADS = ("gyro", "accelerometer")
FRACTION_BITS = 36
LARGEST_COUNT = 2**26
"""Counts in one sample beyond which the counter overflows."""


@dataclass(frozen=True)
class Coefficients:
    """What is true of a triad during one launch. SI, *rate* as in `TriadTruth`; `bias` (3,), `matrix` (3, 3)."""

    bias: Array
    matrix: Array
    asymmetry: Array
    """Relative, (3,)."""
    quadratic: Array
    """[1/rate], (3,)."""

    def output(self, v: Array) -> Array:
        """Noise-free nominal output of inputs of shape (n, 3) [rate], as (3, n)."""
        inputs = v.T
        through = np.array([row[0] * inputs[0] + row[1] * inputs[1] + row[2] * inputs[2] for row in self.matrix])
        even = 0.5 * self.asymmetry[:, None] * np.abs(through) + self.quadratic[:, None] * through**2
        return self.bias[:, None] + through + even


def launch_coefficients(truth: TriadTruth, seed: int, launch: int, triad: str) -> Coefficients:
    """Coefficients of launch number `launch`: bias and each row of K move by their run-to-run draws."""
    draw = keyed_generator(seed, launch, triad, "run to run").standard_normal(6)
    bias = np.array(truth.bias) + truth.bias_run_to_run_sd * draw[:3]
    factor = 1.0 + truth.scale_factor_run_to_run_sd_ppm * units.PPM * draw[3:]
    return Coefficients(
        bias,
        np.array(truth.matrix) * factor[:, None],
        np.array(truth.scale_factor_asymmetry_ppm) * units.PPM,
        np.array(truth.scale_factor_nonlinearity_ppm) * units.PPM / truth.nonlinearity_reference,
    )


class Counter:
    """Three counters that carry their phase, in units of 2⁻³⁶ pulse so that sums are exact in any grouping."""

    def __init__(self, pulse: tuple[float, float, float], phase: list[int]) -> None:
        """`pulse`: weight of a count [rate·s]; `phase`: carried fraction of each channel, 0 … 2³⁶ − 1."""
        self._per_pulse = ldexp(1.0, FRACTION_BITS) / np.array(pulse)[:, None]
        self._phase = np.array(phase, dtype=np.int64)

    @property
    def phase(self) -> list[int]:
        """The carried fractions."""
        return [int(p) for p in self._phase]

    def resume(self, phase: list[int]) -> None:
        """Go on from carried fractions."""
        self._phase = np.array(phase, dtype=np.int64)

    def count(self, increments: Array) -> NDArray[np.int64]:
        """Counts of each sample, shape (3, n), from increments of shape (3, n) [rate·s]."""
        fixed = increments * self._per_pulse
        largest = float(np.max(np.abs(fixed), initial=0.0))
        if not largest < ldexp(float(LARGEST_COUNT), FRACTION_BITS):
            raise DeviceFault(f"a sample of {ldexp(largest, -FRACTION_BITS):.3g} counts overflows the counter")
        steps = np.rint(fixed, out=fixed).astype(np.int64)
        # The carried fraction is a sum modulo 2^36, so that overflow of the 64-bit sum does no harm.
        ends = self._phase[:, None] + np.cumsum(steps, axis=1)
        ends &= (1 << FRACTION_BITS) - 1
        counts = steps
        counts[:, 0] += self._phase
        counts[:, 1:] += ends[:, :-1]
        self._phase = ends[:, -1].copy()
        return np.right_shift(counts, FRACTION_BITS, out=counts)


class TriadSensor:
    """One triad during one launch: coefficients, noise, counter."""

    def __init__(self, truth: TriadTruth, rate_hz: float, key: tuple[int, int, str]) -> None:
        """`key`: seed, launch number, triad's name."""
        self.coefficients = launch_coefficients(truth, *key)
        self.noise = TriadNoise(truth, rate_hz, key)
        self._rate_hz = rate_hz
        start = keyed_generator(*key, "phase").integers(0, 1 << FRACTION_BITS, 3)
        self.counter = Counter(truth.pulse, start.tolist())

    def feel(self, tick: int, ticks: int, increments: Array) -> NDArray[np.int64]:
        """Counts (3, ticks) of the ticks from `tick` since power-up; true `increments` (ticks, 3) or (1, 3)."""
        output = self.coefficients.output(increments * self._rate_hz) / self._rate_hz
        return self.counter.count(output + self.noise.increments(tick, ticks))


def station_means(truth: TriadTruth, rate_hz: float, key: tuple[int, int, str], ticks: Array, v: Array) -> Array:
    """Mean nominal output at each station, shape (n, 3) [rate], without making the samples.

    `ticks`: beginning and end of each station in ticks since power-up, shape (n, 2), ascending, not overlapping;
    `v`: true constant input at each, (n, 3) [rate]. ``Ū = LSB·(⌊φ + ΔΘ/LSB⌋ − ⌊φ⌋)/T`` where ΔΘ holds the output
    of the coefficients, the *same draws* of the slow processes as the full path, and the random walk as one normal
    number a station. φ, the counter's phase when the station begins, is drawn uniform: between two stations the unit
    turns through many thousands of pulses. So for the same key means differ from those of the full path by white
    noise and phase, and over many seeds they have the same distribution.
    """
    noise = TriadNoise(truth, rate_hz, key)
    seconds = (ticks[:, 1] - ticks[:, 0]) / rate_hz
    total = launch_coefficients(truth, *key).output(v) * seconds
    slow = noise.slow_integral(ticks.ravel()).reshape(3, -1, 2)
    total += slow[:, :, 1] - slow[:, :, 0]
    total += noise.white_integral(seconds, "station white")
    pulse = np.array(truth.pulse)[:, None]
    phase = keyed_generator(*key, "station phase").random((3, len(seconds)))
    return (pulse * np.floor(phase + total / pulse) / seconds).T
