"""Records of known noise, made without sight of the analysis, and the least spread of any estimate from them.

The slow processes come from the simulated unit's own noise (`simulators.imu.noise`): its flicker is a bank of
Gauss-Markov processes, its rate random walk exact over cells. White rate and white reading errors are drawn here.
The Cramér-Rao bound takes the spectrum in closed form, folded as sampling folds it.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import pi

import numpy as np

from procedures.core import units
from simulators.imu.noise import TriadNoise
from simulators.truth import Array, TriadTruth

RATE_HZ = 400.0
PROCESSES = ("quantization", "random_walk", "bias_instability", "rate_random_walk", "rate_ramp")
ONES = (1.0, 1.0, 1.0)
EYE = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
BAND_S = (0.5, 1.0e5)
FOLDS = 40


@dataclass(frozen=True)
class Scenario:
    """A channel's noise, SI, and the length of its records."""

    title: str
    hours: float
    truth: dict[str, float] = field(default_factory=dict[str, float])

    def of(self, process: str) -> float:
        """A coefficient, zero where absent."""
        return self.truth.get(process, 0.0)


def gyro(q_arcsec: float = 0.0, n: float = 0.0, b: float = 0.0, k: float = 0.0, r: float = 0.0) -> dict[str, float]:
    """Coefficients in arcsec, deg/√h, deg/h, deg/h/√h and deg/h/h."""
    hourly = (units.ARCSEC, units.DEG_PER_SQRT_HOUR, units.DEG_PER_HOUR)
    scale = (*hourly, units.DEG_PER_HOUR_PER_SQRT_HOUR, units.DEG_PER_HOUR_PER_HOUR)
    values = zip(PROCESSES, (q_arcsec, n, b, k, r), scale, strict=True)
    return {name: value * unit for name, value, unit in values if value}


GYRO = Scenario("gyro", 6.0, gyro(0.39, 0.0014, 0.0016))
ACCELEROMETER = Scenario(
    "accelerometer", 6.0, {"quantization": 11 * units.MICRO_G, "bias_instability": 0.75 * units.MICRO_G}
)
THESIS = Scenario("thesis's synthetic", 6.0, gyro(1.5, 0.007, 0.015))
DRIFTING = Scenario("60 h, drifting", 60.0, gyro(0.39, 0.0014, 0.0016, 0.01, 0.02))
MIXTURES = (GYRO, ACCELEROMETER, THESIS, DRIFTING)
ALONE = (
    Scenario("Q alone", 6.0, gyro(0.39)),
    Scenario("N alone", 6.0, gyro(n=0.0014)),
    Scenario("B alone", 6.0, gyro(b=0.0016)),
    Scenario("K alone", 60.0, gyro(k=0.002)),
    Scenario("R on a trace of N", 6.0, gyro(n=1.4e-6, r=0.002)),
)


def _noise(scenario: Scenario, seed: int, *, white: bool) -> TriadNoise:
    def three(process: str) -> tuple[float, float, float]:
        value = scenario.of(process)
        return value, value, value

    truth = TriadTruth(
        bias=(0.0, 0.0, 0.0),
        matrix=EYE,
        quantization=ONES,
        random_walk=three("random_walk") if white else (0.0, 0.0, 0.0),
        bias_instability=three("bias_instability"),
        rate_random_walk=three("rate_random_walk"),
        rate_ramp=three("rate_ramp"),
        flicker_band_s=BAND_S,
    )
    return TriadNoise(truth, RATE_HZ, (seed, 1, "gyro"))


def cell_records(scenario: Scenario, seed: int, cell_s: float = 1.0) -> Array:
    """Cell means of three channels, (3, n) [rate]."""
    n = round(scenario.hours * 3600.0 / cell_s)
    rng = np.random.default_rng(seed)
    y = np.zeros((3, n))
    if any(scenario.of(process) for process in PROCESSES[2:]):
        edges = np.arange(n + 1) * RATE_HZ * cell_s
        y += np.diff(_noise(scenario, seed, white=False).slow_integral(edges), axis=1) / cell_s
    y += scenario.of("random_walk") / np.sqrt(cell_s) * rng.standard_normal((3, n))
    y += np.diff(scenario.of("quantization") * rng.standard_normal((3, n + 1)), axis=1) / cell_s
    return y


def full_rate_blocks(scenario: Scenario, seed: int) -> Iterator[Array]:
    """One channel at 400 Hz in blocks of 10 s, (4000,) [rate]."""
    noise, rng = _noise(scenario, seed, white=True), np.random.default_rng(seed)
    block, sd = 4000, scenario.of("quantization")
    last = sd * rng.standard_normal()
    for i in range(round(scenario.hours * 360.0)):
        error = sd * rng.standard_normal(block)
        rate = noise.increments(i * block, block)[0] + np.diff(error, prepend=last)
        last = error[-1]
        yield rate * RATE_HZ


def density(scenario: Scenario, f: Array, period_s: float) -> tuple[list[str], Array]:
    """Spectral density of cell means at f [Hz], (p, len(f)), two-sided, of each process but the ramp, and their names.

    ``Q²·4 sin²(πfΔ)/Δ``, ``N²``, and of the flicker and the walk the continuous density times sinc², folded.
    """
    names = [p for p in PROCESSES[:4] if scenario.of(p)]
    rows: list[Array] = []
    for process in names:
        square = scenario.of(process) ** 2
        if process == "quantization":
            rows.append(square * 4.0 * np.sin(pi * f * period_s) ** 2 / period_s)
        elif process == "random_walk":
            rows.append(np.full(len(f), square))
        else:
            folded = np.zeros(len(f))
            for i in range(-FOLDS, FOLDS + 1):
                g = np.abs(f + i / period_s)
                folded += _continuous(process, g) * np.sinc(g * period_s) ** 2
            rows.append(square * folded)
    return names, np.array(rows)


def _continuous(process: str, f: Array) -> Array:
    """Spectral density of a continuous process of unit B² or K²."""
    if process == "rate_random_walk":
        return 1.0 / (2.0 * pi * f) ** 2
    turns = 2.0 * pi * f
    return (np.arctan(turns * BAND_S[1]) - np.arctan(turns * BAND_S[0])) / (pi**2 * f)


def cramer_rao(scenario: Scenario, period_s: float = 1.0) -> dict[str, float]:
    """Least relative standard deviation of each coefficient from samples of `period_s`, all but it unknown too.

    The information of the logarithms of the squares, ``½ Σ_j S_k S_l/S²`` over the frequencies j/2T, all single up to
    the thousandth, then by an integral. The ramp's, in closed form, is of its generalised least squares.
    """
    duration = scenario.hours * 3600.0
    last = duration / period_s
    single = np.arange(1.0, 1000.0)
    rest = np.geomspace(1000.0, last, 4000)
    middle = 0.5 * (rest[1:] + rest[:-1])
    j, weight = np.concatenate([single, middle]), np.concatenate([np.ones(len(single)), np.diff(rest)])
    names, rows = density(scenario, j / (2.0 * duration), period_s)
    share = rows / rows.sum(axis=0)
    covariance = np.linalg.inv(0.5 * (share * weight) @ share.T)
    bounds = {name: 0.5 * float(np.sqrt(covariance[i, i])) for i, name in enumerate(names)}
    if scenario.of("rate_ramp"):
        odd = single[::2]
        # Mode j of the line t over T: ∫ t √(2/T) cos(πjt/T) dt = −2√(2T)·T/(πj)² for odd j; its density is S.
        line = 8.0 * duration**3 / (pi * odd) ** 4
        information = float(np.sum(line / rows.sum(axis=0)[: len(single)][::2]))
        bounds["rate_ramp"] = 1.0 / np.sqrt(information) / scenario.of("rate_ramp")
    return bounds
