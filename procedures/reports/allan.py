"""Plots and table of Allan deviations, each with its power spectral density."""

from collections.abc import Sequence

from procedures.analysis.launch.curves import Curve
from procedures.core import units
from procedures.core.report import Figure, Report, Series, Table


def deviation_report(statistic: str, confidence: float, curves: Sequence[Curve]) -> Report:
    """Return the report with a plot for each curve and its density, and a table with three of its points."""
    name = statistic.replace("_", " ")
    figures = tuple(
        figure for curve in curves for figure in (_figure(curve, name, confidence), *_density_figure(curve))
    )
    rows = tuple(
        (c.channel, c.recording, _shown(c)[0], c.tau_s[k], c.deviation[k] / size, c.lower[k] / size, c.upper[k] / size)
        for c in curves
        for size in (_shown(c)[1],)
        for k in (0, len(c.tau_s) // 2, len(c.tau_s) - 1)
    )
    columns = ("channel", "recording", "unit", "τ, s", "deviation", "lower", "upper")
    title = f"{name.capitalize()} deviation, first, middle and last point"
    return Report(sections=(Table(title, columns, rows), *figures))


def _shown(curve: Curve) -> tuple[str, float]:
    """Display unit of a curve, and its size in SI."""
    known = {"rad/s": ("deg/h", units.DEG_PER_HOUR), "rad/s·s": ("arcsec", units.ARCSEC)}
    return known.get(curve.unit, (curve.unit, 1.0))


def _density_figure(curve: Curve) -> tuple[Figure, ...]:
    d = curve.density
    if d is None:
        return ()
    rate = curve.unit.removesuffix("·s")
    label, size = {"rad/s": ("deg/h", units.DEG_PER_HOUR)}.get(rate, (rate, 1.0))
    s, low, high = (tuple(v / size**2 for v in values) for values in (d.density, d.lower, d.upper))
    series = (
        Series("interval", d.frequency_hz, low, style="band", upper=high),
        Series("density", d.frequency_hz, s, style="line"),
    )
    title = f"Power spectral density of {curve.channel}, {curve.recording}"
    return (Figure(title, "f, Hz", f"S, ({label})²/Hz", series, x_log=True, y_log=True, note="One-sided."),)


def _figure(curve: Curve, name: str, confidence: float) -> Figure:
    label, size = _shown(curve)
    x, y = curve.tau_s, tuple(d / size for d in curve.deviation)
    low, high = (tuple(v / size for v in side) for side in (curve.lower, curve.upper))
    series = (
        Series(name, x, y, style="line_points"),
        Series(f"{100 * confidence:.0f} % interval, lower", x, low, style="reference"),
        Series("upper", x, high, style="reference"),
        *_band_series(curve, size),
    )
    return Figure(f"{curve.channel}, {curve.recording}", "τ, s", f"σ, {label}", series, x_log=True, y_log=True)


def _band_series(curve: Curve, size: float) -> tuple[Series, ...]:
    b = curve.band
    if b is None:
        return ()
    least, mean, greatest = (tuple(v / size for v in values) for values in (b.least, b.mean, b.greatest))
    return (
        Series("band", b.tau_s, least, style="band", upper=greatest),
        Series("mean of the band", b.tau_s, mean, style="line"),
    )
