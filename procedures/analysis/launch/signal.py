"""Preparation of one channel's cell means for noise analysis: warm-up trimmed, self-heating removed, steps logged."""

from dataclasses import dataclass, field
from math import ceil

import numpy as np

from procedures.analysis.launch.results import Exponential, SelfHeating, Transient, Trend
from procedures.analysis.launch.settings import LaunchSettings
from procedures.analysis.warm_up.end import find_warm_up
from procedures.analysis.warm_up.self_heating import SelfHeating as Fitted
from procedures.analysis.warm_up.self_heating import fit_self_heating
from procedures.core.arrays import Array
from procedures.core.recording import ACCELEROMETER

TREND_POINTS = 300
LEAST_LEFT = 0.25
"""Least share of the record that must remain after trimming."""


@dataclass(frozen=True)
class Step:
    """The series after a step, (n,) [rate], with the step's name and a note."""

    name: str
    cells: Array
    note: str = ""


@dataclass(frozen=True)
class CleanSignal:
    """The cleaned series of one channel, and the steps that produced it."""

    steps: tuple[Step, ...]
    """The series as recorded comes first; the last one is analysed."""
    first_cell: int
    """Number of cells that were trimmed."""
    warm_up: Transient | None
    self_heating: SelfHeating | None
    trend: Trend
    findings: tuple[str, ...] = field(default=())

    @property
    def cells(self) -> Array:
        """Cleaned series to analyse, (n,) [rate]."""
        return self.steps[-1].cells


def clean_signal(channel: str, cells: Array, cell_s: float, start_s: float, settings: LaunchSettings) -> CleanSignal:
    """Return the series with the warm-up trimmed as set, and F(t) − F(t₀) subtracted (thesis 3.1.3); `start_s` since
    the launch.
    """
    is_accelerometer = channel in ACCELEROMETER
    steps = [Step("as recorded", cells)]
    findings: list[str] = []
    warm_up, fitted, first = None, np.empty(0), 0
    if settings.trim_accelerometers if is_accelerometer else settings.trim_gyros:
        found = find_warm_up(cells, cell_s, start_s) if settings.trim_s is None else None
        if found is not None:
            warm_up = Transient(
                found.shape,
                found.amplitude,
                found.amplitude_sd,
                found.end_s,
                found.end_sd_s,
                found.has_ended,
                found.level,
                found.p_value,
            )
            fitted = found.curve(_middles(len(cells), cell_s, start_s))
        end_s = settings.trim_s if settings.trim_s is not None else (warm_up.end_s if warm_up else 0.0)
        first = max(0, ceil((end_s - start_s) / cell_s - 1e-9))
        if first > (1.0 - LEAST_LEFT) * len(cells):
            findings.append(
                f"the warm-up ends {end_s:.0f} s after the launch, too late to trim it: nothing was trimmed"
            )
            first = 0
        if first > 0:
            steps.append(Step("trimmed", cells[first:], f"the first {first * cell_s:.0f} s"))
    heating = None
    if settings.heating_accelerometers if is_accelerometer else settings.heating_gyros:
        fit = fit_self_heating(steps[-1].cells, cell_s, start_s + first * cell_s)
        if fit.exponentials:
            heating = _summary(fit)
            steps.append(Step("self-heating removed", fit.removed(steps[-1].cells, cell_s), _terms(heating)))
            curve = fit.curve(_middles(len(cells), cell_s, start_s)[first:])
            fitted = np.concatenate([np.full(first, np.nan), curve])
    trend = _trend(cells, fitted, cell_s, start_s)
    return CleanSignal(tuple(steps), first, warm_up, heating, trend, tuple(findings))


def _summary(fit: Fitted) -> SelfHeating:
    sds = fit.standard_uncertainties
    terms = tuple(
        Exponential(
            fit.parameters[i],
            float(sds[i]),
            -1.0 / fit.parameters[i + 1],
            float(sds[i + 1]) / fit.parameters[i + 1] ** 2,
        )
        for i in (0, 2)[: fit.exponentials]
    )
    return SelfHeating(terms, fit.parameters[4], float(sds[4]), fit.p_value)


def _terms(heating: SelfHeating) -> str:
    return "time constants " + " and ".join(f"{t.time_s:.0f} ± {t.time_sd:.0f} s" for t in heating.terms)


def _middles(count: int, cell_s: float, start_s: float) -> Array:
    return start_s + (np.arange(count, dtype=np.float64) + 0.5) * cell_s


def _trend(cells: Array, fitted: Array, cell_s: float, start_s: float) -> Trend:
    """Means over groups of cells, about `TREND_POINTS`; a transient is drawn at the level of the record's last half."""
    size = max(1, len(cells) // TREND_POINTS)
    count = len(cells) // size
    rate = cells[: count * size].reshape(count, size).mean(axis=1)
    t = start_s + (np.arange(count) + 0.5) * size * cell_s
    shown: tuple[float, ...] = ()
    if len(fitted):
        curve = fitted[: count * size].reshape(count, size).mean(axis=1)
        half = curve[count // 2 :], rate[count // 2 :]
        curve = curve + float(np.mean(half[1]) - np.mean(half[0]))
        kept = np.isfinite(curve)
        curve[~kept] = curve[kept][0]
        shown = tuple(curve.tolist())
    return Trend(tuple(t.tolist()), tuple(rate.tolist()), shown)
