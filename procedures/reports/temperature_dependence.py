"""Tables and figures of the dependence of channels on temperature."""

from collections.abc import Sequence
from typing import Protocol

from procedures.analysis.thermal.dependence import Repeatability, SoakFit
from procedures.core.report import Cell, Figure, Report, Series, Table


class Dependence(Protocol):
    """Dependence of one channel on temperature, as a result has it. Interface."""

    @property
    def channel(self) -> str: ...
    @property
    def rate_unit(self) -> str: ...
    @property
    def sensor(self) -> str: ...
    @property
    def p_value(self) -> float: ...
    @property
    def order(self) -> int: ...
    @property
    def reason(self) -> str: ...
    @property
    def coefficients(self) -> tuple[float, ...]: ...
    @property
    def covariance(self) -> tuple[tuple[float, ...], ...]: ...
    @property
    def before_sd(self) -> float: ...
    @property
    def after_sd(self) -> float: ...
    @property
    def p_unseen(self) -> float | None: ...
    @property
    def soaks(self) -> tuple[SoakFit, ...]: ...
    @property
    def repeatability(self) -> tuple[Repeatability, ...]: ...


def dependence_report(
    found: Sequence[Dependence], reference_c: float, trace_c: Sequence[Sequence[float]], titles: Sequence[str]
) -> Report:
    """Return the report: coefficients and orders, soaks, repeatability, and the temperature of each recording.

    `titles`: of the recordings, in their order; without them they are counted.
    """
    names = titles or [f"recording {number}" for number in range(1, len(trace_c) + 1)]
    tables = [_fits(found), _coefficients(found, reference_c)]
    if any(c.soaks for c in found):
        tables += [_soaks(found), _repeated(found)]
    series = tuple(
        Series(name, tuple(float(i) for i in range(len(t))), tuple(t), style="line")
        for name, t in zip(names, trace_c, strict=True)
    )
    figures = [Figure("Temperature", "cell", "°C", series), *(_levels(c, names) for c in found if c.soaks)]
    return Report(sections=(*tables, *figures))


def _fits(found: Sequence[Dependence]) -> Table:
    rows = tuple(
        (c.channel, c.rate_unit, c.sensor, c.p_value, c.order, c.before_sd, c.after_sd, c.p_unseen, c.reason)
        for c in found
    )
    columns = ("channel", "unit", "sensor", "p-value", "order", "spread before", "after", "p unseen", "reason")
    note = (
        "p-value: chance of as much dependence from the channel's own slow noise; p unseen: of what a fit to the other "
        "recordings leaves."
    )
    return Table("Channels against temperature", columns, rows, note)


def _coefficients(found: Sequence[Dependence], reference_c: float) -> Table:
    rows: list[tuple[Cell, ...]] = [
        (c.channel, k + 1, f"{c.rate_unit}/°C^{k + 1}", value, max(c.covariance[k][k], 0.0) ** 0.5)
        for c in found
        for k, value in enumerate(c.coefficients)
    ]
    return Table(f"Coefficients about {reference_c:g} °C", ("channel", "power", "unit", "estimate", "±"), tuple(rows))


def _soaks(found: Sequence[Dependence]) -> Table:
    way = {True: "below", False: "above", None: None}
    rows: list[tuple[Cell, ...]] = [
        (
            *(c.channel, s.recording + 1, s.temperature_c, way[s.from_below], s.level, s.level_sd),
            *(s.slope, s.slope_sd, s.preferred_order),
        )
        for c in found
        for s in c.soaks
    ]
    columns = ("channel", "recording", "less reference, °C", "from", "level", "±", "slope, /°C", "±", "order preferred")
    note = "Levels are relative to the recording's soak nearest to the reference; slopes are those within a soak."
    return Table("Soak by soak", columns, tuple(rows), note)


def _repeated(found: Sequence[Dependence]) -> Table:
    rows: list[tuple[Cell, ...]] = [
        (
            *(c.channel, r.temperature_c, r.count, r.spread, r.expected, r.p_value),
            *(r.up_less_down, r.up_less_down_sd),
        )
        for c in found
        for r in c.repeatability
    ]
    columns = ("channel", "less reference, °C", "soaks", "spread", "expected", "p-value", "up less down", "±")
    note = "Spread of the levels over recordings and visits (n − 1), beside what their own uncertainties give."
    return Table("Repeatability of the soaks", columns, tuple(rows), note)


def _levels(found: Dependence, names: Sequence[str]) -> Figure:
    numbers = sorted({s.recording for s in found.soaks})
    series = tuple(
        Series(
            names[n],
            tuple(s.temperature_c for s in found.soaks if s.recording == n),
            tuple(s.level for s in found.soaks if s.recording == n),
            tuple(s.level_sd for s in found.soaks if s.recording == n),
        )
        for n in numbers
    )
    return Figure(f"{found.channel}, level of the soaks", "less reference, °C", found.rate_unit, series)
