"""One channel of one launch: curves, band, coefficients by three methods, wavelet split, averaging time."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from procedures.analysis.allan.band import BandStream
from procedures.analysis.allan.deviation import Deviation, deviation
from procedures.analysis.allan.read_off import Line, ReadOff, read_off
from procedures.analysis.allan.statistic import ALLAN, OVERLAPPING_ALLAN, Sizes, decade_sizes
from procedures.analysis.averaging_time import averaging_time
from procedures.analysis.cells import Cells
from procedures.analysis.launch.context import ChannelContext
from procedures.analysis.launch.lines import SpectralLine
from procedures.analysis.launch.model import found_noise
from procedures.analysis.launch.results import (
    PROCESSES,
    Averaging,
    BandCurve,
    ChannelNoise,
    Coefficient,
    Curve,
    Reading,
    Stage,
)
from procedures.analysis.launch.settings import LaunchSettings
from procedures.analysis.launch.signal import CleanSignal, Step
from procedures.analysis.launch.surroundings import correlations, vibration
from procedures.analysis.noise_fit.comparison import compare
from procedures.analysis.noise_fit.estimate import Estimate, NoiseFit
from procedures.analysis.noise_fit.least_squares import fit_allan
from procedures.analysis.noise_fit.powers import Powers
from procedures.analysis.wavelet_split import most_levels, wavelet_split
from procedures.core.arrays import Array
from procedures.core.units import DEVIATION_DISPLAY

BAND_TERMS = 8
"""The band ends at the cluster time where every start still has about twice this number of terms."""


_ROUNDING = 1e-12
"""Relative difference within a part of a series that rounding alone may cause."""


def channel_noise(
    name: str,
    rate_unit: str,
    cells: Cells,
    signal: CleanSignal,
    fast: Deviation | None,
    powers: Powers | None,
    context: ChannelContext,
    settings: LaunchSettings,
) -> ChannelNoise:
    """Return the complete noise of one channel; `fast` and `powers` come from every sample, None where the fast part is
    off.
    """
    cell_s, series = cells.cell_s, signal.cells
    slow = _deviation(series, cell_s, settings)
    whole = slow if fast is None else joined(fast, slow)
    graphical = read_off(whole)
    # from one cell on: at shorter times the residual dither behind the notch filter exceeds the model
    least_squares = fit_allan(whole, from_s=cell_s, level=settings.level, confidence=settings.confidence)
    found = found_noise(signal, cells, powers, context, settings)
    likelihood, warnings = found.fit, found.warnings(rate_unit)
    last = Stage(signal.steps[-1].name, _curve(whole), _values(graphical), signal.steps[-1].note)
    stages = [*_stages(signal.steps[:-1], cell_s, settings), last, *_split(series, cell_s, rate_unit, settings)]
    lines = tuple(SpectralLine(line.frequency_hz, line.amplitude) for line in likelihood.lines)
    return ChannelNoise(
        channel=name,
        rate_unit=rate_unit,
        mean=float(np.mean(signal.steps[0].cells[signal.first_cell :])),
        used_from_s=cells.since_launch_s + signal.first_cell * cell_s,
        used_s=len(series) * cell_s,
        findings=(*context.findings, *signal.findings),
        warm_up=signal.warm_up,
        self_heating=signal.self_heating,
        trend=signal.trend,
        stages=tuple(stages),
        band=_band(series, cell_s, settings),
        coefficients=tuple(
            Coefficient(p, _of_line(getattr(graphical, p)), _of(least_squares.of(p)), _of(likelihood.of(p)))
            for p in PROCESSES
        ),
        disagreements=compare(graphical, least_squares, likelihood),
        model=(*warnings, *likelihood.notes),
        warnings=warnings,
        averaging=_averaging(likelihood),
        bandwidth_hz=0.5 * whole.rate_hz,
        band_hz=likelihood.band_hz,
        lines=lines,
        correlated=found.correlated,
        flicker_corner_s=likelihood.flicker_corner_s,
        temperature=found.temperature,
        shift=found.shift,
        density=found.density,
        temperatures=correlations(
            signal.steps[0].cells[signal.first_cell :],  # with the self-heating: that is what follows a temperature
            {n: t[signal.first_cell :] for n, t in context.temperatures.items()},
            cell_s,
        ),
        vibration=vibration(found.density, lines, likelihood.coefficients(), 0.5 * whole.rate_hz),
    )


def joined(fast: Deviation, slow: Deviation) -> Deviation:
    """Return one Allan deviation at the full rate: short cluster times from every sample, longer ones from the
    cells.
    """
    later = slow.tau_s > fast.tau_s[-1] * (1.0 + 1e-9)
    factor = round(fast.rate_hz / slow.rate_hz)

    def both(one: Array, two: Array) -> Array:
        return np.concatenate([one, two[later]])

    return replace(
        fast,
        sizes=np.concatenate([fast.sizes, slow.sizes[later] * factor]),
        tau_s=both(fast.tau_s, slow.tau_s),
        deviation=both(fast.deviation, slow.deviation),
        terms=np.concatenate([fast.terms, slow.terms[later]]),
        left_out=np.concatenate([fast.left_out, slow.left_out[later]]),
        strides=np.concatenate([fast.strides, slow.strides[later] * factor]),
        alpha=both(fast.alpha, slow.alpha),
        edf=both(fast.edf, slow.edf),
        lower=both(fast.lower, slow.lower),
        upper=both(fast.upper, slow.upper),
    )


def _deviation(series: Array, cell_s: float, settings: LaunchSettings) -> Deviation:
    return deviation(series, 1.0 / cell_s, sizes=_sizes(len(series), settings), confidence=settings.confidence)


def _sizes(count: int, settings: LaunchSettings) -> Sizes:
    return decade_sizes(OVERLAPPING_ALLAN.largest(count), 1.0 / settings.points_per_decade)


def _stages(steps: Sequence[Step], cell_s: float, settings: LaunchSettings) -> list[Stage]:
    """The Allan curve of each step from one cell on, and the coefficients read off it."""
    found: list[Stage] = []
    for step in steps:
        curve = _deviation(step.cells, cell_s, settings)
        found.append(Stage(step.name, _curve(curve), _values(read_off(curve)), step.note))
    return found


def _split(series: Array, cell_s: float, rate_unit: str, settings: LaunchSettings) -> list[Stage]:
    """The part that the wavelet split keeps, to read N and B from, and the removed part, for Q (thesis 3.1.2)."""
    if settings.wavelet_rule is None:
        return []
    unit, size = DEVIATION_DISPLAY[rate_unit]
    levels = min(settings.wavelet_levels, most_levels(len(series)))
    if levels == 0:
        return []
    split = wavelet_split(
        series,
        cell_s,
        rule=settings.wavelet_rule,
        unit_size=size if settings.wavelet_rule == "thesis" else None,
        levels=levels,
    )
    scale = 2**levels * cell_s
    note = f"{settings.wavelet_rule} rule, scales up to {scale:g} s"
    if settings.wavelet_rule == "thesis":
        note += f", unit variance in {unit}"
    if levels < settings.wavelet_levels:
        note += f"; {levels} levels, not {settings.wavelet_levels}: {len(series)} cells allow no more"
    found: list[Stage] = []
    for name, part in (("kept", split.kept), ("removed", split.removed)):
        title = f"{name} by the wavelet split"
        if np.ptp(part) <= _ROUNDING * np.ptp(series):
            found.append(Stage(title, Curve((), (), (), (), ()), (None,) * len(PROCESSES), f"{note}: nothing"))
            continue
        curve = _deviation(part, cell_s, settings)
        found.append(Stage(title, _curve(curve), _values(read_off(curve)), note))
    return found


def _band(series: Array, cell_s: float, settings: LaunchSettings) -> BandCurve:
    """The band over all starts, from the cells: it vanishes below one cell; with few terms its minimum is near zero."""
    step = settings.band_step_decades or 1.0 / settings.points_per_decade
    sizes = decade_sizes(ALLAN.largest(len(series)) // BAND_TERMS, step)
    stream = BandStream(1.0 / cell_s, len(series), sizes=sizes)
    stream.add(series)
    band = stream.finish()
    lists = (band.tau_s, band.least, band.mean, band.greatest)
    return BandCurve(*(tuple(values.tolist()) for values in lists))


def _curve(d: Deviation) -> Curve:
    return Curve(*(tuple(values.tolist()) for values in (d.tau_s, d.deviation, d.lower, d.upper, d.edf)))


def _values(found: ReadOff) -> tuple[float | None, ...]:
    lines: list[Line | None] = [getattr(found, process) for process in PROCESSES]
    return tuple(None if line is None else line.coefficient for line in lines)


def _of_line(line: Line | None) -> Reading:
    if line is None:
        return Reading(None)
    return Reading(line.coefficient, line.coefficient_sd, from_s=line.from_s, to_s=line.to_s)


def _of(estimate: Estimate) -> Reading:
    e = estimate
    upper = None if e.upper is None or not np.isfinite(e.upper) else e.upper
    unbounded = not np.isfinite(e.upper_limit)
    limit = None if unbounded else e.upper_limit
    of_limits = {"described": e.described, "unbounded": unbounded}
    return Reading(e.value, e.standard_uncertainty, e.lower, upper, limit, e.p_value, **of_limits)


def _averaging(fit: NoiseFit) -> Averaging:
    """The averaging time from the efficient estimates and their covariance."""
    if not (fit.quantization.described and fit.random_walk.described):
        return Averaging(None, None, "the noise model does not describe the fast part of the noise")
    covariance = np.zeros((len(PROCESSES), len(PROCESSES)))
    at = [PROCESSES.index(process) for process in fit.correlated]
    sds = np.array([fit.of(process).standard_uncertainty or 0.0 for process in fit.correlated])
    covariance[np.ix_(at, at)] = fit.correlation * np.outer(sds, sds)
    found = averaging_time(fit.coefficients(), covariance)
    if found.tau_s is None:
        return Averaging(None, None, "only quantization was observed: it dominates over the whole record")
    if found.tau_s == 0.0:
        return Averaging(None, None, "no quantization was observed")
    return Averaging(found.tau_s, found.sd_s)
