"""Records of a chosen noise, to try a method on: Q, N, B, K and R of IEEE Std 952, and nothing else.

The noise is that of the simulated units (`noise`), read by an ideal converter: independent errors of standard deviation
Q at the ends of each sample. The same seed gives the same record, in whatever pieces it is taken.
"""

from collections.abc import Iterator

import numpy as np

from procedures.core.noise import NoiseCoefficients
from simulators.imu.noise import TriadNoise
from simulators.truth import Array, KeyedBlocks, TriadTruth

BLOCK = 50_000
"""Number of samples in a block."""
_LEAST = 1e-300
"""Quantization too small to matter: a triad's truth must have one, and the records get theirs separately."""


def synthesise(noise: NoiseCoefficients, rate_hz: float, count: int, seed: int) -> Iterator[Array]:
    """Yield the rates of one channel in blocks, (n,) each, `count` samples in all; `noise` is in SI.

    Library function: needs no bench and no unit. Raises `TruthError` for coefficients that are no noise.
    """
    truth = TriadTruth(
        (0.0, 0.0, 0.0),
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
        quantization=(_LEAST, _LEAST, _LEAST),
        random_walk=(noise.random_walk, 0.0, 0.0),
        bias_instability=(noise.bias_instability, 0.0, 0.0),
        rate_random_walk=(noise.rate_random_walk, 0.0, 0.0),
        rate_ramp=(noise.rate_ramp, 0.0, 0.0),
        flicker_band_s=noise.flicker_band_s,
    )
    made, draws = TriadNoise(truth, rate_hz, (seed, 1, "synthetic")), KeyedBlocks(seed, "synthetic readings")
    last = float(draws.at(0).standard_normal()) if noise.quantization > 0.0 else 0.0
    for number, start in enumerate(range(0, count, BLOCK)):
        size = min(BLOCK, count - start)
        rates = made.increments(start, size)[0] * rate_hz
        if noise.quantization > 0.0:
            readings = np.concatenate([[last], draws.at(number + 1).standard_normal(size)])
            last = float(readings[-1])
            rates = rates + noise.quantization * rate_hz * np.diff(readings)
        yield rates
