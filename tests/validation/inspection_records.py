"""Recordings for the inspection: sound ones of many kinds, and faults with their place and size. numpy and scipy alone.

Nothing here is taken from the product but the words for channels: noise, counters, motion and faults are made anew.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import butter, sosfilt

Array = np.ndarray[Any, Any]
Rng = np.random.Generator


@dataclass(frozen=True)
class Record:
    """Six channels, three gyros and three accelerometers, as a recording has them."""

    samples: Array
    rate_hz: float
    increments: bool = False
    scale: tuple[float, float] | None = None
    """SI per count of gyros and accelerometers; None: in counts."""
    still: bool = True


def size(rng: Rng) -> tuple[int, float]:
    """Samples and rate: 3 000 … 200 000 at 20 … 2000 Hz."""
    return int(10 ** rng.uniform(3.5, 5.3)), float(np.round(10 ** rng.uniform(1.3, 3.3), 1))


def means(rng: Rng, spread: float = 3000.0) -> Array:
    return np.round(rng.normal(0.0, spread, 6), 1)


def white(rng: Rng, n: int) -> Array:
    return rng.normal(0.0, 1.0, (n, 6))


def low_passed(rng: Rng, n: int) -> Array:
    """Order 1 … 4, corner 0.05 … 0.4 of the rate."""
    x = sosfilt(
        butter(int(rng.integers(1, 5)), float(rng.uniform(0.1, 0.8)), output="sos"), white(rng, n + 500), axis=0
    )
    return x[500:] / x[500:].std(axis=0)


def flicker(rng: Rng, n: int) -> Array:
    """White noise and 1/f noise by spectral shaping, with a corner between 10 and n/10 samples."""
    f = np.fft.rfftfreq(2 * n)
    corner = 1.0 / 10 ** rng.uniform(1.0, np.log10(n) - 1.0)
    shape = np.sqrt(1.0 + corner / np.maximum(f, f[1]))
    spectrum = np.fft.rfft(rng.normal(0.0, 1.0, (2 * n, 6)), axis=0) * shape[:, None]
    return np.fft.irfft(spectrum, axis=0)[:n]


def walking(rng: Rng, n: int) -> Array:
    """White noise and a random walk that is as large after 10 … n samples."""
    return white(rng, n) + np.cumsum(white(rng, n), axis=0) / 10 ** rng.uniform(0.5, 0.5 * np.log10(n))


def lines(rng: Rng, n: int) -> Array:
    """White noise and a line of a period between 2.1 samples and a third of the record."""
    period = 10 ** rng.uniform(np.log10(2.1), np.log10(n / 3.0))
    phase = rng.uniform(0.0, 6.28, 6)
    return white(rng, n) + rng.uniform(0.1, 10.0) * np.sin(2.0 * np.pi * np.arange(n)[:, None] / period + phase)


def drifting(rng: Rng, n: int) -> Array:
    """White noise, a warm-up or a chamber's ramp between two soaks, through lags."""
    t = np.linspace(0.0, 1.0, n)[:, None]
    height = rng.normal(0.0, 1.0, 6) * 10 ** rng.uniform(0.0, 2.5)
    if rng.random() < 0.5:
        shape = np.exp(-t / rng.uniform(0.02, 0.5))
    else:
        begin, end = np.sort(rng.uniform(0.05, 0.95, 2))
        end = max(end, begin + 0.05)
        shape = np.clip((t - begin) / (end - begin), 0.0, 1.0)
    return white(rng, n) + height * shape


NOISES: dict[str, Callable[[Rng, int], Array]] = {
    "white": white,
    "low-passed": low_passed,
    "flicker": flicker,
    "random walk": walking,
    "line": lines,
    "thermal drift": drifting,
}


def counts(rng: Rng, noise: str, least_sd: float = 2.0) -> Record:
    """Whole counts with noise of 2 … 300 counts."""
    n, rate = size(rng)
    sd = 10 ** rng.uniform(np.log10(least_sd), 2.5, 6)
    return Record(np.rint(means(rng) + sd * NOISES[noise](rng, n)).astype(np.int32), rate)


def decimals(rng: Rng, noise: str) -> Record:
    """SI values at rest, printed with a fixed number of decimals or not at all rounded."""
    n, rate = size(rng)
    up = rng.normal(0.0, 1.0, 3)
    rest = np.concatenate([rng.normal(0.0, 0.01, 3), 9.81 * up / np.linalg.norm(up)])
    sd = np.concatenate([10 ** rng.uniform(-4.5, -3.0, 3), 10 ** rng.uniform(-3.0, -2.0, 3)])
    x = rest + sd * NOISES[noise](rng, n) / (30.0 if noise == "thermal drift" else 1.0)
    return Record(np.round(x, 6) if rng.random() < 0.5 else x, rate, scale=(1.0, 1.0))


def coarse(rng: Rng) -> Record:
    """Noise of 0.1 … 1 count about a level that may drift by some counts."""
    n, rate = size(rng)
    drift = np.linspace(0.0, 1.0, n)[:, None] * rng.normal(0.0, 2.0, 6) * (rng.random() < 0.5)
    x = means(rng, 50.0) + drift + rng.uniform(0.1, 1.0, 6) * white(rng, n)
    return Record(np.rint(x).astype(np.int32), rate)


def counter(rng: Rng) -> Record:
    """Angle and velocity counters at rest: pulses of an integral, with a triangular dither or without."""
    n, rate = size(rng)
    angle = np.arange(n + 1)[:, None] * np.concatenate([rng.normal(0.0, 0.1, 3), rng.normal(0.0, 40.0, 3)])
    angle = angle + np.cumsum(rng.normal(0.0, 1.0, (n + 1, 6)), axis=0) * 10 ** rng.uniform(-2.0, -0.5)
    dither = rng.random((n + 1, 6)) + rng.random((n + 1, 6)) if rng.random() < 0.5 else 0.5
    return Record(np.diff(np.floor(angle + dither), axis=0).astype(np.int32), rate, increments=True)


def turning(rng: Rng) -> Record:
    """Whole turns forth at a steady rate, after a rest and before one; accelerometers feel gravity turn."""
    n, rate = size(rng)
    begin, end = int(0.1 * n), int(0.9 * n)
    ramp = max(3, int(rng.uniform(0.005, 0.05) * n))
    t = np.arange(n)
    share = np.clip((t - begin) / ramp, 0.0, 1.0) * np.clip((end - t) / ramp, 0.0, 1.0)
    x = 10 ** rng.uniform(0.5, 2.0, 6) * white(rng, n) + means(rng)
    x[:, int(rng.integers(3))] += rng.uniform(3000.0, 20_000.0) * share
    angle = 2.0 * np.pi * np.cumsum(share) / share.sum() * rng.integers(1, 9)
    x[:, 3] += 9000.0 * np.sin(angle)
    x[:, 4] += 9000.0 * np.cos(angle)
    return Record(np.rint(x).astype(np.int32), rate, still=False)


def by_hand(rng: Rng) -> Record:
    """A unit set down in pose after pose."""
    n, rate = size(rng)
    poses = int(rng.integers(6, 30))
    edges = np.sort(rng.integers(0, n, poses))
    which = np.searchsorted(edges, np.arange(n))
    place = rng.normal(0.0, 5000.0, (poses + 1, 3))
    moving = np.zeros(n)
    for edge in edges:
        moving[edge : edge + max(5, n // 400)] = 1.0
    x = 10 ** rng.uniform(0.5, 1.5) * white(rng, n) + means(rng, 100.0)
    x[:, 3:] += place[which]
    x += moving[:, None] * 800.0 * low_passed(rng, n)
    return Record(np.rint(x).astype(np.int32), rate, still=False)


SOUND: dict[str, Callable[[Rng], Record]] = {
    **{f"counts, {name}": (lambda rng, name=name: counts(rng, name)) for name in NOISES},
    **{f"decimals, {name}": (lambda rng, name=name: decimals(rng, name)) for name in NOISES},
    "coarse": coarse,
    "counter": counter,
    "turning": turning,
    "set down by hand": by_hand,
}
