"""Sound recordings of two kinds, and one way to inspect them."""

from dataclasses import replace
from typing import Any

import numpy as np

from procedures.analysis.fitness.findings import ChannelFitness, Finding, FitnessSettings
from procedures.analysis.fitness.stream import FitnessStream
from procedures.core.recording import ACCELEROMETER, GYRO, Channel, Quantity

Samples = np.ndarray[Any, Any]
RATE_HZ = 100.0
COUNTS = (
    *(Channel(name, Quantity.ANGULAR_RATE, "count") for name in GYRO),
    *(Channel(name, Quantity.SPECIFIC_FORCE, "count") for name in ACCELEROMETER),
)
SI = tuple(replace(c, unit="rad/s" if c.name in GYRO else "m/s^2") for c in COUNTS)
COUNTERS = tuple(
    replace(c, quantity=Quantity.ANGLE_INCREMENT if c.name in GYRO else Quantity.VELOCITY_INCREMENT) for c in COUNTS
)


def generator(seed: int = 1) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(seed))


def wide(n: int = 50_000, sd: float = 20.0, seed: int = 1) -> Samples:
    """White noise of many levels about six different means."""
    means = np.array([-438.0, 143.0, -65.0, 2644.0, -643.0, 14_791.0])
    return generator(seed).normal(means, sd, (n, 6)).round().astype(np.int32)


def dithered(n: int = 50_000) -> Samples:
    """A counter at rest with triangular dither: −1, 0, 1, and an accelerometer of 64 or 65 counts a sample."""
    rng = generator(7)
    angle = np.arange(n + 1)[:, None] * [0.02, 0.0, -0.003, 64.7, 0.4, 0.1]
    return np.diff(np.floor(angle + rng.random((n + 1, 6)) + rng.random((n + 1, 6))), axis=0).astype(np.int32)


def look(
    samples: Samples, channels: tuple[Channel, ...] = COUNTS, cut: int = 4000, **settings: Any
) -> tuple[ChannelFitness, ...]:
    stream = FitnessStream(channels, RATE_HZ, len(samples), FitnessSettings(**settings))
    for at in range(0, len(samples), cut):
        stream.add(samples[at : at + cut])
    return stream.finish()


def found(fitness: tuple[ChannelFitness, ...]) -> dict[str, list[Finding]]:
    return {c.channel: list(c.findings) for c in fitness if c.findings}
