"""Figures of a thermal cycle: 3.15 to 3.17 and 4.11 to 4.16 of the thesis, in the words of this page."""

from collections.abc import Sequence

from procedures.analysis.thermal.cycle.results import AllanFound, RunFound, ThermalCycle, Trace
from procedures.core import units
from procedures.core.recording import AXES
from procedures.core.report import Figure, Series

SENSOR_NAMES = ("case", "converter", "gyro x", "gyro y", "gyro z")
DYNAMIC = "dynamic regime"


def figures(cycle: ThermalCycle) -> tuple[Figure, ...]:
    """Return all figures: temperatures, indicator, outputs, |ĝ| of each run; Allan deviations of each axis; the last
    soaks side by side.
    """
    of_runs = [f for run in cycle.runs for f in (temperatures(run), indicator(run), *outputs(run), magnitudes(run))]
    of_axes = [allan([curve for curve in cycle.allan if curve.axis == axis], axis) for axis in AXES]
    return (*of_runs, *of_axes, soak_figure(cycle))


def temperatures(run: RunFound) -> Figure:
    """Return the figure of chamber and sensors over a run [°C] (fig. 3.15)."""
    t, trace = _hours(run.trace), run.trace
    lines = [Series(n, t, v, style="line") for n, v in zip(SENSOR_NAMES, trace.sensors_c, strict=True)]
    chamber = [
        Series("chamber, air", t, trace.air_c, style="line"),
        Series("chamber, set point", t, trace.set_point_c, style="reference"),
    ]
    band = _regime(trace, [*trace.sensors_c, trace.air_c])
    return Figure(f"Temperatures, {run.name}", "t, h", "°C", (band, *lines, *chamber))


def indicator(run: RunFound) -> Figure:
    """Return the figure of the second derivative of the case temperature, with the regime (fig. 3.16)."""
    t, scaled = _hours(run.trace), tuple(1e6 * a for a in run.trace.acceleration_c_s2)
    band = _regime(run.trace, [scaled])
    note = "The regime is dynamic from where the size passes its threshold until rate and second derivative are quiet."
    series = (band, Series("second derivative", t, scaled, style="line"))
    return Figure(f"Regime indicator, {run.name}", "t, h", "d²T/dt², µ°C/s²", series, note=note)


def outputs(run: RunFound) -> tuple[Figure, Figure]:
    """Return the figures of the accelerometers before and after correction (figs. 4.11 to 4.14)."""
    found: list[Figure] = []
    for what, lists, size, unit in (
        ("before correction", run.trace.before_m_s2, 1.0, "m/s²"),
        ("after correction", run.trace.after_m_s2, units.MICRO_G, "µg"),
    ):
        shown = [tuple(v / size for v in values) for values in lists]
        lines = [Series(axis, _hours(run.trace), v, style="line") for axis, v in zip(AXES, shown, strict=True)]
        title = f"Accelerometers {what}, {run.name}"
        label = f"departure from the reference soak, {unit}"
        found.append(Figure(title, "t, h", label, (_regime(run.trace, shown), *lines)))
    return found[0], found[1]


def magnitudes(run: RunFound) -> Figure:
    """Return the figure of |ĝ| over a run, before and after correction (fig. 4.16)."""
    t, trace = _hours(run.trace), run.trace
    before, after = (
        tuple((v - sum(values) / len(values)) / units.MICRO_G for v in values)
        for values in (trace.magnitude_before_m_s2, trace.magnitude_after_m_s2)
    )
    series = (Series("before", t, before, style="line"), Series("after", t, after, style="line"))
    return Figure(f"|ĝ| less its mean, {run.name}", "t, h", "µg", (_regime(trace, [before, after]), *series))


def allan(curves: Sequence[AllanFound], axis: str) -> Figure:
    """Return the figure of an accelerometer's Allan deviation over the whole cycle, before and after correction (fig.
    4.15).
    """
    series: list[Series] = []
    for curve in curves:
        before, after, lower, upper = (
            tuple(v / units.MICRO_G for v in values) for values in (curve.before, curve.after, curve.lower, curve.upper)
        )
        series.append(Series(f"{curve.run}, interval", curve.tau_s, lower, style="band", upper=upper))
        series.append(Series(f"{curve.run}, before", curve.tau_s, before, style="reference"))
        series.append(Series(f"{curve.run}, after", curve.tau_s, after, style="line"))
    note = "Of second means over the whole run; dashed: before correction. Intervals are those of 99.7 %."
    title = f"Allan deviation of accelerometer {axis} in the cycle"
    return Figure(title, "τ, s", "σ, µg", tuple(series), True, True, note)


def soak_figure(cycle: ThermalCycle) -> Figure:
    """Return the figure of 3σ before and after correction over the temperature of the case."""
    x = tuple(s.case_c for s in cycle.soaks)
    series = [
        Series(f"{axis} {what}", x, tuple(values[i] for values in lists))
        for i, axis in enumerate(AXES)
        for what, lists in (
            ("before", [s.before_m_s2 for s in cycle.soaks]),
            ("after", [s.after_m_s2 for s in cycle.soaks]),
        )
    ]
    return Figure("3σ at each soak", "case, °C", "3σ, m/s²", tuple(series), y_log=True)


def _hours(trace: Trace) -> tuple[float, ...]:
    return tuple(t / units.HOUR for t in trace.t_s)


def _regime(trace: Trace, shown: Sequence[Sequence[float]]) -> Series:
    """Dynamic stretches as a band from the least to the greatest shown value; of no height in between."""
    low, high = min(min(values) for values in shown), max(max(values) for values in shown)
    t = _hours(trace)
    half = 0.5 * (t[1] - t[0]) if len(t) > 1 else 0.0
    x: list[float] = []
    upper: list[float] = []
    for i, dynamic in enumerate(trace.dynamic):
        if i == 0 or dynamic is not trace.dynamic[i - 1] or i == len(t) - 1:
            edge = t[i] - half if i < len(t) - 1 else t[i] + half
            x += [edge, edge]
            upper += [upper[-1] if upper else low, high if dynamic else low]
    return Series(DYNAMIC, tuple(x), (low,) * len(x), style="band", upper=tuple(upper))
