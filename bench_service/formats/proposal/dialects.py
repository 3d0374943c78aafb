"""Text exports of well-known makers: recognised by their names and first lines, with the units that makers document.

EuRoC, Xsens MT Manager, phone apps (Sensor Logger, phyphox, Physics Toolbox) and KITTI's oxts without names. A text of
no known dialect has what its names say and nothing else.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from bench_service.formats.logs.names import hint, is_time, time_unit
from bench_service.formats.logs.table import LogClock, LogColumn, LogTable, triad
from bench_service.formats.logs.zipped import OXTS
from bench_service.formats.text_look import TextLook
from procedures.core.recording import Quantity

_SAMPLE_RATE = re.compile(r"(?:sample|update|output)\s*rate\D{0,12}([0-9.]+)\s*hz", re.IGNORECASE)
_CLOCK_TEXT = re.compile(r"^(\d{4}[-/]\d\d?[-/]\d\d?|\d{1,2}:\d\d)")
_SI_UNITS = {Quantity.ANGULAR_RATE: "rad/s", Quantity.SPECIFIC_FORCE: "m/s^2"}


@dataclass(frozen=True)
class Table:
    """A table, the name of its dialect, and the fields that its description needs."""

    format: str
    title: str
    table: LogTable
    fields: dict[str, Any] = field(default_factory=dict[str, Any])
    time_units: dict[str, str] = field(default_factory=dict[str, str])
    """Unit of a time column where the dialect or the name says it."""


@dataclass
class _Text:
    """A text as it is understood so far."""

    look: TextLook
    names: list[str]
    stem: str
    columns: list[LogColumn]
    units: dict[str, str]
    """Time columns and their units."""
    rate_hz: float | None
    asks: list[str] = field(default_factory=list[str])


def guessed(name: str, file: str = "") -> LogColumn:
    """Return a column with the likely meaning of its name; of a column x, y or z of the file's name too."""
    guess = hint(name)
    if guess.quantity is None and name.lower() in ("x", "y", "z") and file:
        guess = hint(f"{file}_{name}")
    source = "the names of file and column" if file else "the name of the column"
    return LogColumn(name, guess.quantity, guess.unit, channel=guess.channel, source=source, doubt=guess.doubt)


def in_dialect(found: TextLook, name: str, fields: dict[str, Any]) -> Table:
    """Return the table of a text with the meaning that its dialect gives."""
    stem = name.rpartition("/")[2].rpartition(".")[0]
    if found.names is None:
        return _without_names(found, fields)
    names = [n for n in found.names if n]
    units = {n: time_unit(n) or "" for n in names if is_time(n)}
    for place, cell in enumerate(found.first[: len(names)]):
        if _CLOCK_TEXT.match(cell.strip('"')):
            units[names[place]] = "clock"
    text = _Text(found, names, stem, [guessed(n, stem) for n in names], units, _rate(found.preamble))
    form, title = "text", "delimited text"
    for dialect, words, is_it, understand in DIALECTS:
        if is_it(text):
            form, title = dialect, words
            understand(text)
            break
    if not text.units and names and text.columns[0].quantity is None:
        text.units[names[0]] = ""
        text.asks.append(f"the first column, {names[0]!r}, is taken as the time by its place alone")
    clocks = tuple(LogClock(n, 1e-4 if u == "100us" else None, f"column {n!r}") for n, u in text.units.items())
    table = LogTable("", tuple(text.columns), clocks, text.rate_hz, None, (), tuple(text.asks))
    return Table(form, title, table, fields, text.units)


def _without_names(found: TextLook, fields: dict[str, Any]) -> Table:
    """Understand a text without names: KITTI's oxts by its width, nothing else."""
    columns = [LogColumn(str(i)) for i in range(found.width)]
    if found.width == len(OXTS) and found.delimiter == "whitespace":
        places = [OXTS.index(n) for n in ("wx", "wy", "wz", "ax", "ay", "az")]
        source = "dataformat.txt of KITTI's raw data"
        labels = [str(place) for place in places]
        for column in triad(labels[:3], "gyro", Quantity.ANGULAR_RATE, "rad/s", source=source) + triad(
            labels[3:], "accelerometer", Quantity.SPECIFIC_FORCE, "m/s^2", source=source
        ):
            columns[int(column.name)] = column
        note = "30 columns without names are taken as samples of KITTI's oxts; they have no time"
        return Table("kitti", "KITTI oxts", LogTable("", tuple(columns), (), None, None, (note,)), fields)
    ask = "the text has no names: which column is which channel, and in which unit, is not known"
    return Table("text", "delimited text", LogTable("", tuple(columns), (), None, None, (), (ask,)), fields)


def _euroc(text: _Text) -> None:
    """EuRoC: units and axes stand in the names."""


def _xsens(text: _Text) -> None:
    """MT Manager: names without units, which are rad/s and m/s²; SampleTimeFine counts 0.1 ms."""
    text.units = {n: "100us" if n == "SampleTimeFine" else u for n, u in text.units.items()}
    text.columns = [_in_si(column, "Xsens' manual of the export: rad/s and m/s²") for column in text.columns]
    if text.rate_hz is None and not text.units:
        text.asks.append("the header has no sample rate (MT Manager 2019.2 leaves it out): give rate_hz")


def _sensor_logger(text: _Text) -> None:
    """Sensor Logger: one file a sensor, columns z, y, x; `time` is nanoseconds since 1970."""
    text.units = {n: "ns" if n == "time" else "s" for n in text.names if n in ("time", "seconds_elapsed")}
    text.columns = [_in_si(column, "Sensor Logger's documentation: rad/s and m/s²") for column in text.columns]
    if text.stem.lower().startswith("accelerometer"):
        text.asks.append("Sensor Logger's Accelerometer is without gravity: TotalAcceleration has the specific force")


def _phyphox(text: _Text) -> None:
    """phyphox: units stand in the names."""


def _toolbox(text: _Text) -> None:
    """Physics Toolbox: gFx, gFy, gFz in g."""
    text.columns = [
        replace(c, unit="g", source="Physics Toolbox: g force") if c.quantity is Quantity.SPECIFIC_FORCE else c
        for c in text.columns
    ]


DIALECTS: tuple[tuple[str, str, Callable[[_Text], bool], Callable[[_Text], None]], ...] = (
    ("euroc", "EuRoC", lambda t: any("w_RS_S_x" in n for n in t.names), _euroc),
    (
        "xsens",
        "Xsens MT Manager",
        lambda t: (
            "SampleTimeFine" in t.names
            or "PacketCounter" in t.names
            or any(line.startswith("//") for line in t.look.preamble)
        ),
        _xsens,
    ),
    ("phone", "Sensor Logger (phone)", lambda t: "seconds_elapsed" in t.names, _sensor_logger),
    ("phone", "phyphox (phone)", lambda t: any("(m/s^2)" in n or "(rad/s)" in n for n in t.names), _phyphox),
    ("phone", "Physics Toolbox (phone)", lambda t: any(n.lower() == "gfx" for n in t.names), _toolbox),
)
"""Name, words, how a text is recognised, and what is done with it."""


def _in_si(column: LogColumn, source: str) -> LogColumn:
    """Give a rate or a force without a unit its unit of the SI, which the dialect's maker documents."""
    unit = _SI_UNITS.get(column.quantity) if isinstance(column.quantity, Quantity) else None
    return column if unit is None or column.unit is not None else replace(column, unit=unit, source=source)


def _rate(preamble: tuple[str, ...]) -> float | None:
    for line in preamble:
        match = _SAMPLE_RATE.search(line)
        if match is not None:
            return float(match[1].rstrip("."))
    return None
