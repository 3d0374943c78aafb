"""The likelihood fit of one channel with its regressors (temperature, shift of the level), and the warnings on it."""

from dataclasses import dataclass
from math import log

import numpy as np

from procedures.analysis.cells import Cells
from procedures.analysis.launch.context import ChannelContext, most_followed
from procedures.analysis.launch.density import Density, density_of
from procedures.analysis.launch.results import CorrelatedProcess, LevelShift, TemperatureSlope
from procedures.analysis.launch.settings import LaunchSettings
from procedures.analysis.launch.signal import CleanSignal
from procedures.analysis.noise_fit.estimate import NoiseFit
from procedures.analysis.noise_fit.followed import Candidate, likeliest_shift
from procedures.analysis.noise_fit.likelihood import fit_noise
from procedures.analysis.noise_fit.powers import Powers, slow_powers
from procedures.core.arrays import Array
from procedures.core.units import DEVIATION_DISPLAY

TEMPERATURE_LEVEL, TEMPERATURE_GAIN = 1e-3, 4.0
"""Probability that an irrelevant temperature is accepted, and the required gain over drifting noise."""
SHIFT_LEVEL, SHIFT_GAIN = 1e-3, 2.0
"""The same for a shift of the level: a probability over all cells where it may be, a gain in excess of ln(cells)."""
SHOWN_LINES = 5


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
        return (*found, *self._model(unit, size), *self.fit.remarks)

    def _model(self, unit: str, size: float) -> tuple[str, ...]:
        """Sentences on the extension of the five-coefficient model."""
        g, corner = self.fit.gauss_markov, self.fit.flicker_corner_s
        found: list[str] = []
        if g is not None:
            spread = "" if g.time_sd_s is None else f" ± {g.time_sd_s:.2g}"
            found.append(
                f"a Gauss–Markov process is in the noise: correlation time {g.time_s:.3g}{spread} s, driving noise "
                f"{g.driving / size:.3g} {unit}/√s"
            )
        if corner is not None:
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
        coarse=bool(context.coarse),
    )
    temperature, shift = None, None
    for f in fit.followed:
        if followed is not None and f.index == 0:
            temperature = TemperatureSlope(followed, f.slope, f.standard_uncertainty, f.p_value)
        elif at is not None:
            begin = cells.since_launch_s + (signal.first_cell + at) * cell_s
            shift = LevelShift(begin, f.slope, f.standard_uncertainty)
    return FoundNoise(fit, context.coarse, temperature, shift, density_of(slow, powers, settings.confidence))
