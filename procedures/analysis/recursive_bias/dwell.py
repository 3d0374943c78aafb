"""Live estimate of a dwell: when it has been long enough, by the unit's own noise (textbook S 5.4.3, 6.2).

The calibration takes the plain mean of a dwell; its standard uncertainty after each check follows from the channel's
noise alone, and is known before the first sample. So when to stop does not depend on what was measured, and an optional
stop cannot bias the mean. What was measured enters in one way: the recursive estimate's innovations are white with
unit variance where the noise is as declared. Where they are not, the declared uncertainty is not to be believed, and
the dwell continues to its longest time. Innovations count by their squares, whatever their sign: no bias from there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from procedures.analysis.calibration.station_noise import mean_covariance
from procedures.analysis.recursive_bias.kalman import RecursiveBias
from procedures.analysis.recursive_bias.window_noise import contiguous_covariance
from procedures.core.errors import MissingChannel, UnfitRecording
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import Channel, NominalScale, RawArray, Recording
from procedures.core.stop_rule import StopRule

MOST_CHECKS = 300
"""Most checks of a dwell: the covariance of their means is a full matrix. Longer dwells are looked at less often."""


def checks_of(rule: StopRule, longest_s: float) -> tuple[float, int]:
    """Return the interval [s] and the number of the checks of a dwell."""
    count = max(1, int(longest_s / rule.check_s + 1e-9))
    if count > MOST_CHECKS:
        return longest_s / MOST_CHECKS, MOST_CHECKS
    return rule.check_s, count


def mean_sd(noise: NoiseCoefficients, duration_s: float) -> float:
    """Return the standard uncertainty of the plain mean over a dwell, slow noise within it included [rate]."""
    return float(np.sqrt(mean_covariance(noise, [[0.0, duration_s]])[0, 0]))


def expected_s(rule: StopRule, longest_s: float) -> float:
    """Duration of a dwell of declared noise under a rule [s]; the longest where a target is out of reach."""
    every, count = checks_of(rule, longest_s)
    for k in range(1, count + 1):
        if k * every >= rule.least_s - 1e-9 and all(mean_sd(t.noise, k * every) <= t.target_sd for t in rule.targets):
            return k * every
    return longest_s


class LiveDwell:
    """Follows the samples of a dwell, block by block, and decides how many of them are enough."""

    def __init__(self, rule: StopRule, channels: Sequence[Channel], rate_hz: float, longest_s: float) -> None:
        """Start before the first sample. Raises `MissingChannel`."""
        names = [c.name for c in channels]
        for target in rule.targets:
            if target.channel not in names:
                raise MissingChannel(target.channel, names)
        self._columns = [names.index(t.channel) for t in rule.targets]
        self._scale = NominalScale.of([channels[c] for c in self._columns], rate_hz)
        every, count = checks_of(rule, longest_s)
        self._size = max(1, round(every * rate_hz))
        self._rule, self._every = rule, self._size / rate_hz
        edges = self._every * np.arange(count + 1, dtype=np.float64)
        spans = np.stack([edges[:-1], edges[1:]], axis=1)
        self._estimates = [RecursiveBias(contiguous_covariance(t.noise, spans)) for t in rule.targets]
        self._enough = round(expected_s(rule, longest_s) / every)
        self._reachable = all(mean_sd(t.noise, self._enough * every) <= t.target_sd for t in rule.targets)
        self._rest = np.empty((0, len(self._columns)))
        self._taken = 0

    def add(self, block: RawArray) -> int | None:
        """Take the next samples (n, channels). Return how many of them belong to the dwell where it ends in them, None
        where it goes on.
        """
        before = self._taken
        self._taken += len(block)
        rates = self._scale.rates(np.asarray(block)[:, self._columns].astype(np.float64))
        rows = np.concatenate([self._rest, rates])
        whole = len(rows) // self._size
        for k in range(whole):
            means = rows[k * self._size : (k + 1) * self._size].mean(axis=0)
            for estimate, mean in zip(self._estimates, means.tolist(), strict=True):
                if estimate.count < len(estimate.variances):
                    estimate.update(mean)
            if self._is_enough():
                return self._estimates[0].count * self._size - before
        self._rest = rows[whole * self._size :]
        return None

    def _is_enough(self) -> bool:
        count = self._estimates[0].count
        long_enough = count >= self._enough and count * self._every >= self._rule.least_s - 1e-9
        return self._reachable and long_enough and self.p_value >= self._rule.level

    @property
    def p_value(self) -> float:
        """Probability of innovations as large under the declared noise, of the least likely channel (Bonferroni)."""
        least = 1.0
        for estimate in self._estimates:
            found = estimate.innovations
            if len(found):
                least = min(least, float(chdtrc(len(found), float(np.sum(found**2)))))
        return min(1.0, least * len(self._estimates))


@dataclass(frozen=True)
class DwellEnded:
    """Duration of one dwell under a stop rule."""

    label: str
    duration_s: float
    longest_s: float
    by_rule: bool
    """True if the rule ended it; False if it ran to its longest time."""


@dataclass(frozen=True)
class DwellsSaved:
    """Time that a stop rule saved in a job."""

    dwells: tuple[DwellEnded, ...]
    saved_s: float
    """Sum of what the dwells were shorter than their longest time."""
    share: float
    """Part of the longest time of all dwells together."""


def dwells_saved(recordings: Sequence[Recording]) -> DwellsSaved | None:
    """Durations of the stations' dwells beside their longest times; None where no station has a stop rule.

    Raises `UnfitRecording` where a dwell is longer than its station allows.
    """
    found: list[DwellEnded] = []
    for recording in recordings:
        info = recording.info
        station = info.station
        if station is None or station.until is None:
            continue
        if info.duration_s > station.record_s * (1.0 + 1e-6) + 1.0 / info.rate_hz:
            raise UnfitRecording(f"recording {info.id} is longer than its station's {station.record_s:g} s")
        ended = info.duration_s < station.record_s * (1.0 - 1e-9) - 0.5 / info.rate_hz
        found.append(DwellEnded(station.label, info.duration_s, station.record_s, ended))
    if not found:
        return None
    longest = sum(d.longest_s for d in found)
    saved = longest - sum(d.duration_s for d in found)
    return DwellsSaved(tuple(found), saved, saved / longest)
