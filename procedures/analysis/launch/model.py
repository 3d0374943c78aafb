"""The likelihood fit of one channel with its regressors (temperature, shift of the level), and the warnings on it."""

from dataclasses import dataclass
from math import log, pi, sqrt

import numpy as np

from procedures.analysis.cells import Cells
from procedures.analysis.launch.context import ChannelContext, most_followed
from procedures.analysis.launch.density import Density, density_of
from procedures.analysis.launch.resolution import Coarse
from procedures.analysis.launch.results import CorrelatedProcess, LevelShift, TemperatureSlope
from procedures.analysis.launch.settings import LaunchSettings
from procedures.analysis.launch.signal import CleanSignal
from procedures.analysis.noise_fit.columns import BIAS_INSTABILITY, QUANTIZATION, RANDOM_WALK, RATE_RANDOM_WALK
from procedures.analysis.noise_fit.estimate import PROCESSES, NoiseFit
from procedures.analysis.noise_fit.followed import Candidate, likeliest_shift
from procedures.analysis.noise_fit.likelihood import fit_noise
from procedures.analysis.noise_fit.powers import Powers, slow_powers
from procedures.analysis.noise_fit.undescribed import NOTHING, Hidden
from procedures.core.arrays import Array
from procedures.core.units import DEVIATION_DISPLAY, NOISE_DISPLAY

TEMPERATURE_LEVEL, TEMPERATURE_GAIN = 1e-3, 4.0
"""Probability that an irrelevant temperature is accepted, and the required gain over drifting noise."""
SHIFT_LEVEL, SHIFT_GAIN = 1e-3, 2.0
"""The same for a shift of the level: a probability over all cells where it may be, a gain in excess of ln(cells)."""
SHOWN_LINES = 5
_RAMP = len(PROCESSES) - 1
_WALKED = 0.81


@dataclass(frozen=True)
class FoundNoise:
    """Results of the likelihood fit of a channel."""

    fit: NoiseFit
    coarse: str
    temperature: TemperatureSlope | None
    shift: LevelShift | None
    density: Density

    @property
    def correlated(self) -> CorrelatedProcess | None:
        """The Gauss–Markov process of the fit; None where the fit has none."""
        g = self.fit.gauss_markov
        return None if g is None else CorrelatedProcess(g.time_s, g.time_sd_s, g.driving, g.driving_sd, g.sd)

    def warnings(self, rate_unit: str) -> tuple[str, ...]:
        """Return warnings to read before a coefficient is trusted."""
        unit, size = DEVIATION_DISPLAY[rate_unit]
        found = [self.coarse] if self.coarse else list[str]()
        lines = [] if self.coarse else sorted(self.fit.lines, key=lambda line: -line.amplitude)
        found += [
            f"a spectral line at {line.frequency_hz:.4g} Hz of {line.amplitude / size:.3g} {unit} was taken out"
            for line in sorted(lines[:SHOWN_LINES], key=lambda line: line.frequency_hz)
        ]
        if len(lines) > SHOWN_LINES:
            found.append(f"{len(lines) - SHOWN_LINES} weaker spectral lines were taken out")
        if self.temperature is not None:
            t = self.temperature
            found.append(
                f"the rate follows {t.channel} by {t.slope / size:.3g} ± {t.standard_uncertainty / size:.1g} {unit} a "
                "kelvin (or count): that drift is neither K nor R"
            )
        if self.shift is not None:
            s = self.shift
            found.append(
                f"the level shifts by {s.height / size:.3g} ± {s.standard_uncertainty / size:.1g} {unit} at "
                f"{s.at_s:.6g} s after the launch: no part of K"
            )
        return (*found, *self._model(rate_unit), *self.fit.remarks)

    def _model(self, rate_unit: str) -> tuple[str, ...]:
        """Sentences on the extension of the five-coefficient model."""
        unit, size = DEVIATION_DISPLAY[rate_unit]
        g, corner = self.fit.gauss_markov, self.fit.flicker_corner_s
        found: list[str] = []
        if g is not None:
            spread = "" if g.time_sd_s is None else f" ± {g.time_sd_s:.2g}"
            found.append(
                f"a Gauss–Markov process is in the noise: correlation time {g.time_s:.3g}{spread} s, driving noise "
                f"{g.driving / size:.3g} {unit}/√s"
            )
        if g is not None and g.white is not None:
            unit, size = NOISE_DISPLAY[rate_unit]["random_walk"]
            below, above = g.low_frequency_walk / size, g.white / size
            found.append(
                f"below about {0.5 / pi / g.time_s:.2g} Hz the random walk is {below:.3g} {unit}, above it {above:.3g} "
                f"{unit}: a low-pass filter followed by white reading noise looks the same"
            )
        if corner == 0.0:
            found.append("the flicker goes on up to half of the sampling rate")
        elif corner is not None:
            found.append(f"the flicker's shortest relaxation time is about {corner:.2g} s")
        return tuple(found)


def found_noise(
    signal: CleanSignal, cells: Cells, powers: Powers | None, context: ChannelContext, settings: LaunchSettings
) -> FoundNoise:
    """Return the noise fitted to a channel's clean cells, with the likeliest temperature and shift of the level as
    regressors. `powers`: the spectrum of the samples at the full rate; None: the cells alone are fitted.
    """
    series, cell_s = signal.cells, cells.cell_s
    temperatures = {name: row[signal.first_cell :] for name, row in context.temperatures.items()}
    followed = most_followed(series, {n: row for n, row in temperatures.items() if np.ptp(row) > 0.0})
    rest = series
    rows: list[Array] = []
    candidates: list[Candidate] = []
    if followed is not None:
        own = temperatures[followed] - np.mean(temperatures[followed])
        rows.append(own)
        candidates.append(Candidate(TEMPERATURE_LEVEL, TEMPERATURE_GAIN))
        rest = series - own * (float(np.dot(own, series)) / float(np.dot(own, own)))
    at = likeliest_shift(rest)
    if at is not None:
        rows.append(np.where(np.arange(len(series)) >= at, 1.0, 0.0) - (len(series) - at) / len(series))
        candidates.append(Candidate(SHIFT_LEVEL / len(series), SHIFT_GAIN + log(len(series))))
    slow = slow_powers(series, cell_s, regressors=np.array(rows) if rows else None)
    fit = fit_noise(
        slow,
        powers,
        level=settings.level,
        confidence=settings.confidence,
        candidates=candidates,
        hidden=_hidden(context.coarse, len(series) * cell_s),
    )
    temperature, shift = None, None
    for f in fit.followed:
        if followed is not None and f.index == 0:
            temperature = TemperatureSlope(followed, f.slope, f.standard_uncertainty, f.p_value)
        elif at is not None:
            begin = cells.since_launch_s + (signal.first_cell + at) * cell_s
            shift = LevelShift(begin, f.slope, f.standard_uncertainty)
    sentence = "" if context.coarse is None else context.coarse.sentence
    return FoundNoise(fit, sentence, temperature, shift, density_of(slow, powers, settings.confidence))


def _hidden(coarse: Coarse | None, duration_s: float) -> Hidden:
    """Return the limits of what a channel's steps hide: white noise, and slow changes of less than a step.

    A flicker stays within half a step on either side; a random walk of duration T leaves a step q from its middle
    with 95 % probability if ``K√T > 0.81·q``, since it stays with ``(4/π)·exp(−π²K²T/2q²)``; a ramp does if R·T > q.
    """
    if coarse is None:
        return NOTHING
    if coarse.step is None:
        return Hidden({QUANTIZATION: 0.0, RANDOM_WALK: 0.0})
    least = {QUANTIZATION: 0.0, RANDOM_WALK: coarse.most_walk}
    if coarse.hides_slow:
        q = coarse.step
        least |= {BIAS_INSTABILITY: 0.5 * q, RATE_RANDOM_WALK: _WALKED * q / sqrt(duration_s), _RAMP: q / duration_s}
    return Hidden(least)
