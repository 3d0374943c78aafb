"""Forward model of a triad: true motion in, integer counts out.

``U = b + a + ½·asymmetry·|a| + nonlinearity·a²/reference`` with ``a = K·v`` (thesis 3.30, 3.34, plus two even terms),
integrated over a sample, plus noise, into a dithered counter that keeps its phase.
Written without sight of the inverse that the analysis uses.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from procedures.core import units
from simulators.imu.blocks import Dither
from simulators.imu.climate import Drift
from simulators.imu.counter import FRACTION_BITS, Counter, Counts
from simulators.imu.noise import TriadNoise
from simulators.truth import Array, TriadTruth, keyed_generator

TRIADS = ("gyro", "accelerometer")


@dataclass(frozen=True)
class Coefficients:
    """True coefficients of a triad during one launch. SI, *rate* as in `TriadTruth`; `bias` (3,), `matrix` (3, 3)."""

    bias: Array
    matrix: Array
    asymmetry: Array
    """Relative scale-factor asymmetry of each channel, (3,)."""
    quadratic: Array
    """Quadratic coefficient of each channel [1/rate], (3,)."""

    def output(self, v: Array) -> Array:
        """Noise-free nominal output of inputs of shape (n, 3) [rate], as (3, n)."""
        through, even = self._through(v)
        return self.bias[:, None] + through + even

    def through(self, v: Array) -> Array:
        """Output for inputs of shape (n, 3) without the bias, (3, n) [rate]."""
        through, even = self._through(v)
        return through + even

    def _through(self, v: Array) -> tuple[Array, Array]:
        inputs = v.T
        through = np.array([row[0] * inputs[0] + row[1] * inputs[1] + row[2] * inputs[2] for row in self.matrix])
        even = 0.5 * self.asymmetry[:, None] * np.abs(through) + self.quadratic[:, None] * through**2
        return through, even


def launch_coefficients(truth: TriadTruth, seed: int, launch: int, triad: str) -> Coefficients:
    """Draw the coefficients of launch number `launch`: bias and each row of K move from run to run."""
    draw = keyed_generator(seed, launch, triad, "run to run").standard_normal(6)
    bias = np.array(truth.bias) + truth.bias_run_to_run_sd * draw[:3]
    factor = 1.0 + truth.scale_factor_run_to_run_sd_ppm * units.PPM * draw[3:]
    return Coefficients(
        bias,
        np.array(truth.matrix) * factor[:, None],
        np.array(truth.scale_factor_asymmetry_ppm) * units.PPM,
        np.array(truth.scale_factor_nonlinearity_ppm) * units.PPM / truth.nonlinearity_reference,
    )


class TriadSensor:
    """One triad during one launch, with coefficients, noise and counter."""

    def __init__(self, truth: TriadTruth, rate_hz: float, key: tuple[int, int, str]) -> None:
        """Begin a launch of the triad. `key`: seed, launch number, triad's name."""
        self.coefficients = launch_coefficients(truth, *key)
        self.noise = TriadNoise(truth, rate_hz, key)
        self._rate_hz = rate_hz
        self._total = np.empty((3, 0))
        self._rest = np.full((1, 3), np.nan), np.full((3, 1), np.nan)
        start = keyed_generator(*key, "phase")
        phase = start.integers(0, 1 << FRACTION_BITS, 3)
        if truth.dithered:
            dither = Dither(key, self.noise.block_ticks, FRACTION_BITS)
            first = start.integers(0, 1 << FRACTION_BITS, (2, 3)).sum(axis=0)
            ahead = ((phase + first) >> FRACTION_BITS).tolist()
            self.counter = Counter(truth.pulse, phase.tolist(), dither.blocks, ahead)
        else:
            self.counter = Counter(truth.pulse, phase.tolist())

    def feel(
        self, tick: int, ticks: int, increments: Array, out: Counts | None = None, drift: Drift | None = None
    ) -> Counts:
        """Return the counts (3, ticks) of the ticks from `tick` since power-up, in `out` where given.

        `increments`: true ones, (ticks, 3), or (1, 3) where every tick is alike; `drift`: effect of temperature on the
        triad meanwhile, None: none.
        """
        if self._total.shape[1] != ticks:
            self._total = np.empty((3, ticks))
        if drift is None:
            self._total[...] = self._output(increments)
        else:
            through = self.coefficients.through(increments * self._rate_hz)
            np.divide(drift.sensed(self.coefficients.bias, through), self._rate_hz, out=self._total)
        self.noise.add_increments(self._total, tick)
        if drift is not None:
            drift.convert(self._total, self._rate_hz)
        return self.counter.count(self._total, tick, out)

    def _output(self, increments: Array) -> Array:
        """Noise-free increments of the integrated output; kept, because a table at rest sends the same for hours."""
        if len(increments) != 1:
            return self.coefficients.output(increments * self._rate_hz) / self._rate_hz
        if not np.array_equal(increments, self._rest[0]):
            self._rest = increments.copy(), self.coefficients.output(increments * self._rate_hz) / self._rate_hz
        return self._rest[1]

    def checkpoint(self) -> dict[str, Any]:
        """State of the triad to resume from, JSON-ready."""
        return {"phase": self.counter.phase, "ahead": self.counter.ahead, "noise": self.noise.checkpoint()}

    def resume(self, state: dict[str, Any]) -> None:
        """Go on from the state of a checkpoint."""
        self.noise.resume(state["noise"])
        self.counter.resume(state["phase"], state["ahead"])


def station_means(truth: TriadTruth, rate_hz: float, key: tuple[int, int, str], ticks: Array, v: Array) -> Array:
    """Mean nominal output at each station, shape (n, 3) [rate], without making the samples.

    `ticks`: beginning and end of each station in ticks since power-up, shape (n, 2), ascending, not overlapping;
    `v`: true constant input at each, (n, 3) [rate]. ``Ū = LSB·(⌊φ + d₁ + ΔΘ/LSB⌋ − ⌊φ + d₀⌋)/T`` where ΔΘ holds the
    output of the coefficients, the *same draws* of the slow processes and the same residue of the mechanical dither as
    the full path, and the random walk as one normal number a station. d₀ and d₁ are the counter's dither (zero without
    it). φ, the counter's phase when the station begins, is drawn uniform: between two stations the unit turns through
    many thousands of pulses. So for the same key means differ from those of the full path by white noise, dither and
    phase, and over many seeds they have the same distribution.
    """
    noise = TriadNoise(truth, rate_hz, key)
    seconds = (ticks[:, 1] - ticks[:, 0]) / rate_hz
    total = launch_coefficients(truth, *key).output(v) * seconds
    known = (noise.slow_integral(ticks.ravel()) + noise.residue_angle(ticks.ravel())).reshape(3, -1, 2)
    total += known[:, :, 1] - known[:, :, 0]
    total += noise.white_integral(seconds, "station white")
    pulse = np.array(truth.pulse)[:, None]
    start = keyed_generator(*key, "station phase").random((3, len(seconds)))
    end = start + total / pulse
    if truth.dithered:
        dither = keyed_generator(*key, "station dither").random((4, 3, len(seconds)))
        start, end = start + dither[0] + dither[1], end + dither[2] + dither[3]
    return (pulse * (np.floor(end) - np.floor(start)) / seconds).T
