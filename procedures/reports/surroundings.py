"""Tables of the surroundings of launches: readiness, temperatures, base vibration, spectral lines."""

from collections.abc import Sequence

from procedures.analysis.launch.results import LaunchNoise
from procedures.core.report import Cell, Table
from procedures.core.units import DEVIATION_DISPLAY

MOST_LINES = 12
"""Strongest lines of a channel that are shown."""


def surroundings_tables(launches: Sequence[LaunchNoise]) -> tuple[Table, ...]:
    """Return the tables of readiness, temperatures, vibration and lines that have rows."""
    made = (_readiness(launches), _temperatures(launches), _vibration(launches), _lines(launches))
    return tuple(table for table in made if table.rows)


def _readiness(launches: Sequence[LaunchNoise]) -> Table:
    rows: list[tuple[Cell, ...]] = [
        (launch.label, c.channel, c.warm_up.shape, c.warm_up.end_s, c.warm_up.end_sd_s, c.warm_up.has_ended)
        for launch in launches
        for c in launch.channels
        if c.warm_up is not None
    ]
    columns = ("launch", "channel", "shape", "ended, s after the launch", "±", "within the record")
    return Table("Warm-up", columns, tuple((*r[:5], "yes" if r[5] else "no") for r in rows))


def _temperatures(launches: Sequence[LaunchNoise]) -> Table:
    rows: list[tuple[Cell, ...]] = [
        (
            launch.label,
            c.channel,
            t.sensor,
            unit,
            t.r,
            t.slope / size,
            t.slope_sd / size,
            t.effective_samples,
            t.p_value,
        )
        for launch in launches
        for c in launch.channels
        for unit, size in (DEVIATION_DISPLAY[c.rate_unit],)
        for t in c.temperatures
    ]
    columns = ("launch", "channel", "sensor", "unit", "r", "slope, a °C", "±", "effective samples", "p-value")
    note = (
        "Of the launch after its warm-up. Slope, its uncertainty and the p-value are those under the channel's slow "
        "noise: a few effective samples, not one a cell."
    )
    return Table("Outputs at rest against temperature", columns, tuple(rows), note)


def _vibration(launches: Sequence[LaunchNoise]) -> Table:
    rows: list[tuple[Cell, ...]] = [
        (launch.label, c.channel, unit, *(x / size for x in (v.total, v.own_noise, v.vibration, v.lines)), v.to_hz)
        for launch in launches
        for c in launch.channels
        for unit, size in (DEVIATION_DISPLAY[c.rate_unit],)
        for v in (c.vibration,)
        if v is not None
    ]
    columns = ("launch", "channel", "unit", "rms above 1 Hz", "own noise", "base vibration", "lines", "up to, Hz")
    note = (
        "Root mean square from the spectral density; the base vibration is what the noise of the unit's record, else "
        "the fitted one, does not explain."
    )
    return Table("Base vibration", columns, tuple(rows), note)


def _lines(launches: Sequence[LaunchNoise]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for launch in launches:
        for c in launch.channels:
            unit, size = DEVIATION_DISPLAY[c.rate_unit]
            strongest = sorted(c.lines, key=lambda line: -line.amplitude)[:MOST_LINES]
            rows += [
                (launch.label, c.channel, x.frequency_hz, x.amplitude / size, unit, x.origin or None) for x in strongest
            ]
    columns = ("launch", "channel", "f, Hz", "amplitude", "unit", "origin")
    note = "Taken out of the record before its noise was fitted. Origins by the unit's declared dithers, folded."
    return Table("Spectral lines", columns, tuple(rows), note)
