"""Surroundings of a launch at rest: correlation with its temperatures, base vibration, lines and dithers.

Whether an output at rest follows the temperature (thesis 4.1.3), what the base shakes by and at which lines (paper A,
"conditions" and p. 5-6).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from procedures.analysis.coloured_noise import FEWEST
from procedures.analysis.launch.density import Density
from procedures.analysis.launch.lines import SpectralLine
from procedures.analysis.thermal.correlation import correlation
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import GYRO

GROUP_S = 60.0
"""Length of the means that are correlated, shorter where a launch has fewer than `FEWEST` of them [s]."""
MOST_GROUPS = 1024
VIBRATION_HZ = 1.0
"""Lowest frequency that counts as vibration of the base [Hz]."""


@dataclass(frozen=True)
class TemperatureCorrelation:
    """Correlation of a channel with one temperature over a launch; the noise is the channel's own, most likely one."""

    sensor: str
    r: float
    """Pearson's coefficient of the means."""
    slope: float
    """[rate/K] for a temperature in °C, else rate per count of it."""
    slope_sd: float
    """Standard uncertainty, which allows for the autocorrelation of the channel's noise."""
    effective_samples: float
    p_value: float
    """Chance of as steep a slope from that noise alone."""


def correlations(series: Array, temperatures: Mapping[str, Array], cell_s: float) -> tuple[TemperatureCorrelation, ...]:
    """Return the correlations of cells (n,) with every temperature of the launch, (n,) each; none if there are too few
    cells.
    """
    size = max(1, min(round(GROUP_S / cell_s), len(series) // FEWEST), -(-len(series) // MOST_GROUPS))
    count = len(series) // size
    if count < FEWEST:
        return ()

    def means(row: Array) -> Array:
        return row[: count * size].reshape(count, size).mean(axis=1)

    found: list[TemperatureCorrelation] = []
    own = means(series)
    for name, row in temperatures.items():
        try:
            c = correlation(own, means(row), size * cell_s)
        except UnfitRecording:
            continue  # a temperature, or a channel, that stands still goes with nothing
        found.append(TemperatureCorrelation(name, c.r, c.slope, c.slope_sd, c.effective_samples, c.p_value))
    return tuple(found)


@dataclass(frozen=True)
class Vibration:
    """Root mean square of a channel between two frequencies, its own noise taken out."""

    from_hz: float
    to_hz: float
    total: float
    """With the channel's noise [rate]."""
    own_noise: float
    """Root mean square of the fitted quantization, random walk and flicker in that band [rate]."""
    vibration: float
    """``√(total² − own_noise²)``; zero where the noise explains all [rate]."""
    lines: float
    """Root mean square of the lines in that band, part of `total` [rate]."""


def vibration(
    density: Density, lines: Sequence[SpectralLine], noise: NoiseCoefficients, bandwidth_hz: float
) -> Vibration | None:
    """Root mean square above `VIBRATION_HZ`; None where the density does not reach there.

    ``∫S·df`` over the bins, which have no lines, and half of each line's squared amplitude.
    """
    f, s = np.array(density.frequency_hz), np.array(density.density)
    if not len(f) or f[-1] <= 1.5 * VIBRATION_HZ:
        return None
    inside = f >= VIBRATION_HZ
    edges = np.concatenate([[VIBRATION_HZ], 0.5 * (f[inside][1:] + f[inside][:-1]), [bandwidth_hz]])
    width = np.diff(edges)
    of_lines = sum(0.5 * line.amplitude**2 for line in lines if line.frequency_hz >= VIBRATION_HZ)
    total = float(np.sum(s[inside] * width)) + of_lines
    period = 0.5 / bandwidth_hz
    own = 2.0 * noise.random_walk**2 + noise.bias_instability**2 / (np.pi * f[inside])
    own = own + 8.0 * (noise.quantization * np.sin(np.pi * f[inside] * period)) ** 2 / period
    mine = float(np.sum(own * width))
    left = sqrt(max(total - mine, 0.0))
    return Vibration(VIBRATION_HZ, bandwidth_hz, sqrt(total), sqrt(mine), left, sqrt(of_lines))


HARMONICS = 3
"""Greatest multiple of a dither's frequency that is sought."""
WITHIN = 2e-3
"""Tolerance of a match, relative to the folded frequency's distance …"""
WITHIN_HZ = 0.15
"""… and at the least [Hz]: a segment of a launch resolves hundredths, and a dither wanders by its temperature."""


def folded_hz(frequency_hz: float, rate_hz: float) -> float:
    """Return the frequency at which samples at a rate show a sine, 0 … half of the rate [Hz]."""
    return abs(frequency_hz - rate_hz * round(frequency_hz / rate_hz))


def with_origins(
    lines: Sequence[SpectralLine], channel: str, dither_hz: Sequence[float], rate_hz: float
) -> tuple[SpectralLine, ...]:
    """Return the lines with their origins: the channel's own dither, another gyro's (cross-talk), a multiple, or
    none.
    """
    return tuple(replace(line, origin=_origin(line.frequency_hz, channel, dither_hz, rate_hz)) for line in lines)


def _origin(frequency_hz: float, channel: str, dither_hz: Sequence[float], rate_hz: float) -> str:
    matches: list[tuple[float, str]] = []
    for name, dither in zip(GYRO, dither_hz, strict=True):
        if dither <= 0.0:
            continue
        for multiple in range(1, HARMONICS + 1):
            seen = folded_hz(multiple * dither, rate_hz)
            away = abs(seen - frequency_hz)
            if away > max(WITHIN_HZ, WITHIN * seen):
                continue
            whose = "its own dither" if name == channel else f"the dither of {name}"
            order = "" if multiple == 1 else f", {multiple} times its frequency"
            fold = "" if multiple * dither <= 0.5 * rate_hz else ", folded"
            # The own one first, then low multiples: what is likeliest of those that fit.
            matches.append((multiple + (0.0 if name == channel else 0.5), f"{whose} ({dither:g} Hz{order}{fold})"))
    return min(matches)[1] if matches else "no dither of the unit"
