"""Thesis 3.1.2 over many seeds: is N nearer to the truth after the wavelet split, and when?"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from procedures.analysis.allan.deviation import deviation
from procedures.analysis.allan.read_off import read_off
from procedures.analysis.allan.statistic import decade_sizes
from procedures.analysis.averaging_time import allan_variance
from procedures.analysis.wavelet_split import Rule, wavelet_split
from simulators.truth import Array
from tests.validation.conditioning_noise import HOURS_6, SYNTHETIC, noise_cells

READ_AT_S = 36.0
"""Where the methods page reads N."""
TRUE = SYNTHETIC.noise.random_walk / 60.0
LONGEST_S = 1000.0


@dataclass(frozen=True)
class Split:
    """One way to split, or none."""

    name: str
    rule: Rule | None = None
    levels: int = 6


PLANS = (
    (1.0, 100, (Split("raw"), Split("thesis, 64 s", "thesis"), Split("rescaled, 64 s", "rescaled"),
                Split("rescaled, 8 s", "rescaled", 3))),
    (10.0, 20, (Split("raw"), Split("thesis, 6.4 s", "thesis"), Split("rescaled, 6.4 s", "rescaled"))),
    (100.0, 6, (Split("raw"), Split("thesis, 0.64 s", "thesis"), Split("rescaled, 0.64 s", "rescaled"),
                Split("rescaled, 5 s", "rescaled", 9))),
)  # fmt: skip


@dataclass(frozen=True)
class Reading:
    """N [deg/√h] of all seeds by one way."""

    rate_hz: float
    split: Split
    at: Array
    """Read on the line at `READ_AT_S`, (seeds,)."""
    lines: Array
    """By `read_off`, (found,): the seeds where there was a stretch of −1/2."""

    @property
    def error(self) -> float:
        """Mean distance from the truth [deg/√h] of the reading at `READ_AT_S`."""
        return float(np.mean(np.abs(self.at - TRUE)))


def readings(share: float) -> Iterator[Reading]:
    """Every plan with a share of its seeds, at least 6."""
    for rate_hz, seeds, splits in PLANS:
        sizes = decade_sizes(round(LONGEST_S * rate_hz), 0.05)
        sizes = np.unique(np.append(sizes, round(READ_AT_S * rate_hz)))
        at: list[list[float]] = [[] for _ in splits]
        lines: list[list[float]] = [[] for _ in splits]
        for seed in range(max(6, round(share * seeds))):
            cells = noise_cells(
                SYNTHETIC.noise, np.random.default_rng([seed, round(rate_hz)]), round(HOURS_6 * rate_hz), rate_hz
            )
            for i, split in enumerate(splits):
                result = deviation(_kept(cells, rate_hz, split), rate_hz, sizes=sizes)
                k = int(np.searchsorted(sizes, round(READ_AT_S * rate_hz)))
                at[i].append(float(result.deviation[k] * np.sqrt(result.tau_s[k])) / 60.0)
                line = read_off(result).random_walk
                lines[i] += [] if line is None else [line.coefficient / 60.0]
        for i, split in enumerate(splits):
            yield Reading(rate_hz, split, np.array(at[i]), np.array(lines[i]))


def _kept(cells: Array, rate_hz: float, split: Split) -> Array:
    if split.rule is None:
        return cells
    unit = 1.0 if split.rule == "thesis" else None
    return wavelet_split(cells, 1.0 / rate_hz, rule=split.rule, unit_size=unit, levels=split.levels).kept


def raw_theory() -> float:
    """Value of the raw line at `READ_AT_S` [deg/√h]: all of σ² taken for N²/τ."""
    return float(np.sqrt(allan_variance(SYNTHETIC.noise, READ_AT_S) * READ_AT_S)) / 60.0
