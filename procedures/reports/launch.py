"""Tables and figures of launches at rest: Tables 4.1 and 4.2, figures 4.1-4.7 of the thesis, laid out again."""

from collections.abc import Sequence
from math import sqrt

from procedures.analysis.allan.read_off import LINES
from procedures.analysis.launch.results import PROCESSES, ChannelNoise, Coefficient, LaunchNoise, Reading, Stage
from procedures.analysis.launch.summary import ChannelSummary
from procedures.core.report import Cell, Figure, Report, Series, Table
from procedures.core.units import DEVIATION_DISPLAY, HOUR, NOISE_DISPLAY
from procedures.reports.density import density_figure
from procedures.reports.surroundings import surroundings_tables

TITLES = {
    "quantization": "quantization Q",
    "random_walk": "random walk N",
    "bias_instability": "bias instability B",
    "rate_random_walk": "rate random walk K",
    "rate_ramp": "rate ramp R",
}


def noise_report(
    launches: Sequence[LaunchNoise],
    channels: Sequence[ChannelSummary],
    averaging_time_s: float | None,
    drawn_launch: int = 1,
) -> Report:
    """Return the report: Tables 4.1 and 4.2, the three ways, every step's effect, and the plots of every channel."""
    doubts = disagreements(launches)
    tables = [
        side_by_side(channels, launches),
        *((doubts,) if doubts else ()),
        averaging_table(channels, launches),
        steps_table(launches),
        launch_means_table(channels, launches),
        *surroundings_tables(launches),
        *(three_ways(launch) for launch in launches),
    ]
    drawn = (launches[drawn_launch - 1], *(x for i, x in enumerate(launches, start=1) if i != drawn_launch))
    figures = [figure for s in channels for figure in channel_figures(s.channel, drawn)]
    return Report(_summary(launches, averaging_time_s), (*tables, *figures))


def _summary(launches: Sequence[LaunchNoise], averaging_time_s: float | None) -> str:
    hours = sum(launch.duration_s for launch in launches) / HOUR
    dwell = (
        "Quantization dominates at no averaging time."
        if averaging_time_s is None
        else f"Quantization falls below the rest of the noise after {averaging_time_s:.0f} s at the latest."
    )
    return f"{len(launches)} launches at rest, {hours:.3g} h in all. {dwell}"


def side_by_side(summaries: Sequence[ChannelSummary], launches: Sequence[LaunchNoise]) -> Table:
    """Return the table that compares the launches, by the likelihood fit (Tables 4.1 and 4.2)."""
    rows = [
        (
            s.channel,
            TITLES[m.process],
            unit,
            *(_shown(v, size) for v in m.values),
            _of(m.mean, size),
            _of(m.sd, size),
            _channel_of(s.channel, launches)[0].bandwidth_hz if m.process == "random_walk" else None,
        )
        for s in summaries
        for m in s.means
        for unit, size in (NOISE_DISPLAY[s.rate_unit][m.process],)
    ]
    columns = (
        "channel",
        "process",
        "unit",
        *(launch.label for launch in launches),
        "mean",
        "± standard uncertainty",
        "bandwidth, Hz",
    )
    note = (
        "Efficient estimates. A dash: not observed; “<” is what it stays below (95 %). The mean counts a process that "
        "was not observed as zero; its uncertainty is the greater of what fits claim and launches scatter. "
        "Bandwidth: half of the sample rate. Samples picked out of faster ones, not averaged, have a random walk that "
        "is too large by the root of how many were passed over."
    )
    return Table("Noise coefficients, launch by launch", columns, tuple(rows), note)


def three_ways(launch: LaunchNoise) -> Table:
    """Return the table of every coefficient of one launch by all three ways: graphical, least squares, likelihood."""
    rows = [
        (channel.channel, TITLES[c.process], unit, *_ways(c, size))
        for channel in launch.channels
        for c in channel.coefficients
        for unit, size in (NOISE_DISPLAY[channel.rate_unit][c.process],)
    ]
    columns = (
        *("channel", "process", "unit", "graphical", "least squares", "± standard uncertainty"),
        *("efficient", "± standard uncertainty", "interval", "p-value without it"),
    )
    note = (
        "Graphical: read on a straight stretch of the plot, with what neighbouring processes add to it. Least squares: "
        "non-negative fit of σ²(τ). Efficient: likelihood of the spectrum. A dash: not observed."
    )
    return Table(f"Noise coefficients three ways, {launch.label}", columns, tuple(rows), note)


def disagreements(launches: Sequence[LaunchNoise]) -> Table | None:
    """Return the table of contradictions among the three ways, and of effects outside the model; None without any."""
    rows = [
        (launch.label, channel.channel, sentence)
        for launch in launches
        for channel in launch.channels
        for sentence in (*channel.findings, *channel.disagreements, *channel.model)
    ]
    return (
        Table("What to know before believing a coefficient", ("launch", "channel", ""), tuple(rows)) if rows else None
    )


def steps_table(launches: Sequence[LaunchNoise]) -> Table:
    """Return the table of the effect of trimming, removal of self-heating and the wavelet split: graphical readings
    step by step.
    """
    rows: list[tuple[Cell, ...]] = []
    for launch in launches:
        for channel in launch.channels:
            shown = NOISE_DISPLAY[channel.rate_unit]
            for stage in channel.stages:
                values = tuple(_of(v, shown[p][1]) for p, v in zip(PROCESSES, stage.readings, strict=True))
                rows.append((launch.label, channel.channel, stage.name, *values, stage.note))
    columns = ("launch", "channel", "step", "Q", "N", "B", "K", "R", "")
    gyro, accelerometer = (", ".join(unit for unit, _ in NOISE_DISPLAY[rate].values()) for rate in ("rad/s", "m/s^2"))
    note = f"Read off the plot, in {gyro} for gyros and {accelerometer} for accelerometers."
    return Table("Step by step", columns, tuple(rows), note)


def averaging_table(summaries: Sequence[ChannelSummary], launches: Sequence[LaunchNoise]) -> Table:
    """Return the table of averaging times at which quantization falls below the rest of the noise, channel by
    channel.
    """
    rows = tuple(
        (s.channel, *(_of(c.averaging.time_s, 1.0) for c in _channel_of(s.channel, launches)), s.averaging_time_s)
        for s in summaries
    )
    columns = ("channel", *(launch.label for launch in launches), "of the mean noise")
    return Table(
        "Averaging time, s", columns, rows, "A dash: quantization is nowhere above the rest, or nowhere below."
    )


def launch_means_table(summaries: Sequence[ChannelSummary], launches: Sequence[LaunchNoise]) -> Table:
    """Return the table of the mean rate of each launch, and how much it changes from one to the next."""
    rows = [
        (s.channel, unit, *(c.mean / size for c in _channel_of(s.channel, launches)), _of(s.mean_change_sd, size))
        for s in summaries
        for unit, size in (DEVIATION_DISPLAY[s.rate_unit],)
    ]
    columns = ("channel", "unit", *(launch.label for launch in launches), "sd, n − 1")
    note = "Mean output in nominal units: bias and the input along the axis, which is the same in every launch."
    return Table("Mean output, launch by launch", columns, tuple(rows), note)


def channel_figures(name: str, launches: Sequence[LaunchNoise]) -> tuple[Figure, ...]:
    """Return the figures of one channel: the Allan plot, its parts, and the signal before removal of trends."""
    channels = _channel_of(name, launches)
    first = channels[0]
    labels = [launch.label for launch in launches]
    density = density_figure(channels, labels)
    figures = [allan_figure(channels, labels), *(() if density is None else (density,))]
    split = [s for s in first.stages if "wavelet" in s.name]
    if split:
        title = f"{name}: quantization and the rest apart, {launches[0].label}"
        figures.append(_stage_figure(first, split, title))
    before = [s for s in first.stages if "wavelet" not in s.name]
    if len(before) > 1:
        figures.append(_stage_figure(first, before, f"{name}: before and after, {launches[0].label}"))
    figures.append(trend_figure(first, launches[0].label))
    return tuple(figures)


def allan_figure(channels: Sequence[ChannelNoise], labels: Sequence[str]) -> Figure:
    """Return the figure of the deviation with intervals and band of the first launch, its slope lines and readings,
    with the other launches.
    """
    first = channels[0]
    unit, size = DEVIATION_DISPLAY[first.rate_unit]
    curve, band = first.analysed.curve, first.band
    series = [
        Series("interval", curve.tau_s, _in(curve.lower, size), style="band", upper=_in(curve.upper, size)),
        Series(
            "band over start offsets", band.tau_s, _in(band.least, size), style="band", upper=_in(band.greatest, size)
        ),
        *(
            Series(label, c.analysed.curve.tau_s, _in(c.analysed.curve.deviation, size), style="line")
            for c, label in zip(channels, labels, strict=True)
        ),
        *(s for c in first.coefficients for s in _line(first, c, size)),
    ]
    note = "Dashed: the line of each process that was observed, at its efficient estimate. Marks: graphical readings."
    return Figure(f"Allan deviation of {first.channel}", "τ, s", f"σ, {unit}", tuple(series), True, True, note)


def trend_figure(channel: ChannelNoise, label: str) -> Figure:
    """Return the figure of moving means since the launch, and the transient or self-heating fitted to them."""
    unit, size = DEVIATION_DISPLAY[channel.rate_unit]
    t = tuple(v / HOUR for v in channel.trend.t_s)
    series = [Series("moving mean", t, _in([v - channel.mean for v in channel.trend.rate], size), style="line")]
    if channel.trend.fitted:
        fitted = _in([v - channel.mean for v in channel.trend.fitted], size)
        series.append(Series("fitted", t, fitted, style="reference"))
    if channel.warm_up is not None:
        end = channel.warm_up.end_s / HOUR
        level = (min(series[0].y), max(series[0].y))
        series.append(Series("end of the warm-up", (end, end), level, style="reference"))
    return Figure(f"{channel.channel} since the launch, {label}", "t, h", f"rate − mean, {unit}", tuple(series))


def _stage_figure(channel: ChannelNoise, stages: Sequence[Stage], title: str) -> Figure:
    unit, size = DEVIATION_DISPLAY[channel.rate_unit]
    series = tuple(Series(s.name, s.curve.tau_s, _in(s.curve.deviation, size), style="line_points") for s in stages)
    return Figure(title, "τ, s", f"σ, {unit}", series, True, True)


def _line(channel: ChannelNoise, coefficient: Coefficient, size: float) -> tuple[Series, ...]:
    """The line of a process over the times where it matters, and the point where it was read off the plot."""
    slope, level = LINES[coefficient.process]
    curve = channel.analysed.curve
    found: list[Series] = []
    value = coefficient.likelihood.value
    if value:
        on = [
            (t, level * value * t**slope)
            for t, s in zip(curve.tau_s, curve.deviation, strict=True)
            if level * value * t**slope > 0.1 * s
        ]
        title = TITLES[coefficient.process]
        found.append(Series(title, tuple(t for t, _ in on), _in([s for _, s in on], size), style="reference"))
    read = coefficient.graphical
    if read.value is not None and read.from_s is not None and read.to_s is not None:
        t = sqrt(read.from_s * read.to_s)
        found.append(Series(f"{TITLES[coefficient.process]}, read", (t,), (level * read.value * t**slope / size,)))
    return tuple(found)


def _ways(c: Coefficient, size: float) -> tuple[Cell, ...]:
    fit = c.likelihood
    interval = None if fit.lower is None else f"≥ {fit.lower / size:.4g}, unbounded"
    if fit.lower is not None and fit.upper is not None:
        interval = f"{fit.lower / size:.4g} … {fit.upper / size:.4g}"
    return (
        _of(c.graphical.value, size),
        _shown(c.least_squares, size),
        _of(c.least_squares.standard_uncertainty, size),
        _shown(fit, size),
        _of(fit.standard_uncertainty, size),
        interval,
        fit.p_value,
    )


def _shown(reading: Reading, size: float) -> Cell:
    if reading.value is not None:
        return reading.value / size
    if reading.upper_limit is None and not reading.unbounded:
        return None
    limit = "unbounded" if reading.upper_limit is None else f"< {reading.upper_limit / size:.2g}"
    return f"{'–' if reading.described else 'not described'} ({limit})"


def _of(value: float | None, size: float) -> float | None:
    return None if value is None else value / size


def _in(values: Sequence[float], size: float) -> tuple[float, ...]:
    return tuple(v / size for v in values)


def _channel_of(name: str, launches: Sequence[LaunchNoise]) -> list[ChannelNoise]:
    return [c for launch in launches for c in launch.channels if c.channel == name]
