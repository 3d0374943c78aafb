"""Warm-up and self-heating over many seeds: false alarms, ends, curves."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.allan.deviation import deviation
from procedures.analysis.warm_up.end import WarmUp, find_warm_up
from procedures.analysis.warm_up.self_heating import SelfHeating, fit_self_heating
from simulators.truth import Array
from tests.validation.conditioning_curves import Curve, level_of
from tests.validation.conditioning_noise import ACCELEROMETER, HOURS_6, Channel, noise_cells

PLATEAU_S = 300


@dataclass(frozen=True)
class Alarms:
    """False alarms of stationary records."""

    channel: Channel
    records: int
    warm_up: int
    self_heating: int


def alarms(channel: Channel, records: int) -> Alarms:
    """Records without a transient in which one was found."""
    warm, heated = 0, 0
    for seed in range(records):
        cells = noise_cells(channel.noise, np.random.default_rng([seed, 41]), HOURS_6)
        warm += find_warm_up(cells, 1.0) is not None
        heated += fit_self_heating(cells, 1.0).exponentials > 0
    return Alarms(channel, records, warm, heated)


@dataclass(frozen=True)
class Ends:
    """Ends of one curve in one channel's noise."""

    channel: Channel
    curve: Curve
    levels: float
    """Amplitude over the level."""
    found: tuple[WarmUp | None, ...]

    @property
    def ratios(self) -> Array:
        """Found end over the true one; not a number where none was found."""
        true = self.curve.end_s(1.0 / self.levels)
        return np.array([np.nan if w is None else w.end_s / true for w in self.found])

    @property
    def within(self) -> int:
        """Records whose end is found within 10 %."""
        return int(np.sum(np.abs(self.ratios - 1.0) <= 0.10))

    @property
    def shapes(self) -> str:
        """Curves that were chosen, and how often."""
        counted = Counter("none" if w is None else w.shape for w in self.found)
        return ", ".join(f"{count} {shape}" for shape, count in counted.most_common())


def ends(channel: Channel, curve: Curve, levels: float, records: int) -> Ends:
    """The ends found in so many records."""
    transient = levels * level_of(channel.noise) * curve.cells()
    made = (noise_cells(channel.noise, np.random.default_rng([seed, 42]), HOURS_6) for seed in range(records))
    return Ends(channel, curve, levels, tuple(find_warm_up(noise + transient, 1.0) for noise in made))


@dataclass(frozen=True)
class Heatings:
    """Fits of one injected curve [µg, 1/s] in an accelerometer's noise."""

    true: tuple[float, ...]
    fits: tuple[SelfHeating, ...]
    plateau: Array
    """Allan deviation at `PLATEAU_S` after removal over that of the same noise without heating, (records,)."""
    untouched: Array
    """The same before removal."""

    @property
    def exponentials(self) -> int:
        return sum(p != 0.0 for p in (self.true[0], self.true[2]))

    @property
    def right(self) -> int:
        """Records with as many exponentials as there are."""
        return sum(f.exponentials == self.exponentials for f in self.fits)

    @property
    def errors(self) -> Array:
        """Normalised errors of the parameters that there are, of the `right` records, (right, parameters)."""
        there = [i for i in range(5) if self.true[i] != 0.0]
        right = [f for f in self.fits if f.exponentials == self.exponentials]
        return np.array([(np.array(f.parameters) - self.true)[there] / f.standard_uncertainties[there] for f in right])


def heatings(true: Sequence[float], records: int) -> Heatings:
    """The curve fitted in so many records."""
    t = np.arange(HOURS_6) + 0.5
    heat = true[0] * np.exp(true[1] * t) + true[2] * np.exp(true[3] * t) + true[4]
    fits: list[SelfHeating] = []
    plateaus: list[list[float]] = []
    for seed in range(records):
        noise = noise_cells(ACCELEROMETER.noise, np.random.default_rng([seed, 43]), HOURS_6)
        fits.append(fit_self_heating(noise + heat, 1.0))
        series = (noise, fits[-1].removed(noise + heat, 1.0), noise + heat)
        plateaus.append([float(deviation(y, 1.0, sizes=[PLATEAU_S]).deviation[0]) for y in series])
    without, after, before = np.array(plateaus).T
    return Heatings(tuple(true), tuple(fits), after / without, before / without)
