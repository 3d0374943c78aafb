"""Text exports of well-known makers: recognised by their names and first lines, with the units that makers document.

EuRoC, Xsens MT Manager and DOT, columns of sensor_msgs/Imu, phone apps (Sensor Logger, SensorLog, phyphox, Physics
Toolbox) and KITTI's oxts without names. A text of no known dialect has what its names say and nothing else.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from bench_service.formats.logs.names import hint, is_counter, is_time, time_unit
from bench_service.formats.logs.oxts import OXTS, SOURCE
from bench_service.formats.logs.table import LogClock, LogColumn, LogTable, triad
from bench_service.formats.text_look import TextLook
from procedures.core.recording import Quantity

_SAMPLE_RATE = re.compile(r"(?:sample|update|output)\s*rate\D{0,12}([0-9]+(?:[.,][0-9]+)?)\s*hz", re.IGNORECASE)
_CLOCK_TEXT = re.compile(r"^(\d{4}[-/]\d\d?[-/]\d\d?|\d{1,2}:\d\d)")
_SI_UNITS = {Quantity.ANGULAR_RATE: "rad/s", Quantity.SPECIFIC_FORCE: "m/s^2"}
CLOCK = "clock"
"""Unit of a column of time that holds the text of a clock."""


@dataclass(frozen=True)
class Understood:
    """A text as a table, and the name of its dialect."""

    format: str
    title: str
    table: LogTable
    time_units: dict[str, str] = field(default_factory=dict[str, str])
    """Unit of a time column where the dialect or the name says it; empty: it is not said."""


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

    def has(self, *parts: str) -> bool:
        """Return whether each part is in one of the names."""
        return all(any(part in name for name in self.names) for part in parts)

    def first_clock(self, *names: str) -> None:
        """Put clocks before the others, in this order."""
        self.units = {n: self.units[n] for n in names if n in self.units} | self.units


def guessed(name: str, file: str = "") -> LogColumn:
    """Return a column with the likely meaning of its name; of a column x, y or z of the file's name too."""
    guess = hint(name)
    if guess.quantity is None and name.lower() in ("x", "y", "z") and file:
        guess = hint(f"{file}_{name}")
    source = "the names of file and column" if file else "the name of the column"
    return LogColumn(name, guess.quantity, guess.unit, channel=guess.channel, source=source, doubt=guess.doubt)


def in_dialect(found: TextLook, name: str) -> Understood:
    """Return the table of a text with the meaning that its dialect gives."""
    stem = name.rpartition("/")[2].rpartition(".")[0]
    if found.names is None:
        return _without_names(found)
    if found.units is not None:
        return _units_apart(found, found.names, found.units)
    names = [n for n in found.names if n]
    units = {n: time_unit(n) or "" for n in names if is_time(n)}
    units |= {column: CLOCK for column in names if is_clock_text(found, column)}
    text = _Text(found, names, stem, [guessed(n, stem) for n in names], units, _rate(found.preamble))
    form, title = "text", "delimited text"
    for dialect, words, is_it, understand in DIALECTS:
        if is_it(text):
            form, title = dialect, words
            understand(text)
            break
    if not text.units and text.rate_hz is None and _may_be_time(text.columns):
        text.units[names[0]] = ""
        text.asks.append(f"the first column, {names[0]!r}, is taken as the time by its place alone")
    return Understood(form, title, _table(text.columns, text.units, text.rate_hz, text.asks), text.units)


def is_clock_text(found: TextLook, column: str) -> bool:
    """Return whether a column holds the text of a clock or calendar, by its first cell; `column`: name or number."""
    names = found.names or ()
    place = names.index(column) if column in names else int(column) if column.isdecimal() else len(found.first)
    return place < len(found.first) and _CLOCK_TEXT.match(found.first[place].strip('"')) is not None


def _may_be_time(columns: list[LogColumn]) -> bool:
    return bool(columns) and columns[0].quantity is None and not is_counter(columns[0].name)


def _table(columns: list[LogColumn], units: dict[str, str], rate_hz: float | None, asks: list[str]) -> LogTable:
    clocks = tuple(LogClock(n, 1e-4 if u == "100us" else None, f"column {n!r}") for n, u in units.items())
    return LogTable("", tuple(columns), clocks, rate_hz, None, (), tuple(asks))


def _without_names(found: TextLook) -> Understood:
    """Understand a text without names: KITTI's oxts by its width, nothing else."""
    columns = [LogColumn(str(i)) for i in range(found.width)]
    if found.width == len(OXTS) and found.delimiter == "whitespace":
        places = [OXTS.index(n) for n in ("wx", "wy", "wz", "ax", "ay", "az")]
        labels = [str(place) for place in places]
        for column in triad(labels[:3], "gyro", Quantity.ANGULAR_RATE, "rad/s", source=SOURCE) + triad(
            labels[3:], "accelerometer", Quantity.SPECIFIC_FORCE, "m/s^2", source=SOURCE
        ):
            columns[int(column.name)] = column
        note = "30 columns without names are taken as samples of KITTI's oxts; they have no time"
        return Understood("kitti", "KITTI oxts", LogTable("", tuple(columns), (), None, None, (note,)))
    ask = "the text has no names: which column is which channel, and in which unit, is not known"
    return Understood("text", "delimited text", LogTable("", tuple(columns), (), None, None, (), (ask,)))


def _units_apart(found: TextLook, names: tuple[str, ...], units: tuple[str, ...]) -> Understood:
    """Understand a text with a line of units below its names: columns go by number."""
    columns: list[LogColumn] = []
    clocks: dict[str, str] = {}
    for place, (name, unit) in enumerate(zip(names, units, strict=True)):
        guess = guessed(f"{name} [{unit}]") if unit else guessed(name)
        source = f"the name {name!r} and the unit {unit!r} below it"
        columns.append(replace(guess, name=str(place), source=source if guess.quantity is not None else ""))
        if guess.quantity is None and (is_time(name) or (place == 0 and time_unit(f"[{unit}]"))):
            clock = is_clock_text(found, str(place))
            clocks[str(place)] = CLOCK if clock else time_unit(f"[{unit}]") or time_unit(name) or ""
    table = _table(columns, clocks, _rate(found.preamble), [])
    note = f"columns are given by number: {', '.join(f'{i} {n}' for i, n in enumerate(names))}"
    return Understood("text", "delimited text", replace(table, notes=(note[:400],)), clocks)


def _as_named(text: _Text) -> None:
    """EuRoC, phyphox: units and axes stand in the names."""


def _xsens(text: _Text) -> None:
    """MT Manager: names without units, which are rad/s and m/s²; SampleTimeFine counts 0.1 ms."""
    text.units = {n: "100us" if n == "SampleTimeFine" else u for n, u in text.units.items()}
    text.columns = [_in_si(column, "Xsens' manual of the export: rad/s and m/s²") for column in text.columns]
    text.columns = [
        replace(c, unit="m/s", source="Xsens' manual of the export: m/s a sample")
        if c.quantity is Quantity.VELOCITY_INCREMENT
        else c
        for c in text.columns
    ]
    if any(n.startswith("OriInc") for n in text.names):
        text.asks.append(
            "OriInc is a quaternion, not three angles: gyros come in by Gyr_X, Gyr_Y, Gyr_Z (export those)"
        )
    if text.rate_hz is None and not text.units:
        text.asks.append("the header has no sample rate (MT Manager 2019.2 leaves it out): give rate_hz")


def _xsens_dot(text: _Text) -> None:
    """Xsens DOT: SampleTimeFine counts microseconds, gyros are deg/s, accelerometers m/s²."""
    text.units = {n: "us" if n == "SampleTimeFine" else u for n, u in text.units.items()}
    source = "Movella's manual of the DOT: deg/s and m/s²"
    text.columns = [
        replace(c, unit="deg/s", source=source) if c.quantity is Quantity.ANGULAR_RATE else _in_si(c, source)
        for c in text.columns
    ]


def _ros(text: _Text) -> None:
    """Columns of sensor_msgs/Imu: rad/s and m/s², gravity in; the sender's stamp before the recorder's."""
    text.columns = [
        _in_si(replace(c, doubt="") if "linear_acceleration" in c.name else c, "sensor_msgs/Imu: rad/s and m/s²")
        for c in text.columns
    ]
    text.first_clock(*(n for n in text.names if n.endswith(("header.stamp", "header/stamp"))))


def _sensor_logger(text: _Text) -> None:
    """Sensor Logger: one file a sensor, columns z, y, x; `time` is nanoseconds since 1970."""
    text.units = {n: "ns" if n == "time" else "s" for n in text.names if n in ("time", "seconds_elapsed")}
    text.columns = [_in_si(column, "Sensor Logger's documentation: rad/s and m/s²") for column in text.columns]
    if text.stem.lower() == "accelerometer":
        words = "Sensor Logger's Accelerometer is without gravity: TotalAcceleration has the specific force"
        text.asks.append(words)
        text.columns = [replace(c, doubt=words) if c.channel else c for c in text.columns]


def _sensor_log(text: _Text) -> None:
    """SensorLog on an iPhone: acceleration in g with the sign of Core Motion, −1 along an axis that points up."""
    source = "Core Motion: g, and minus the specific force (−1 along an axis that points up)"
    doubt = "its scale is negative, as Core Motion's sign demands: look that the axis that pointed up has +g"
    text.columns = [
        replace(c, unit="g", scale=-1.0, source=source, doubt=doubt)
        if c.quantity is Quantity.SPECIFIC_FORCE and not c.doubt
        else c
        for c in text.columns
    ]


def _toolbox(text: _Text) -> None:
    """Physics Toolbox: gFx, gFy, gFz in g; ax, ay, az beside them without gravity."""
    text.columns = [_toolbox_force(c) if c.quantity is Quantity.SPECIFIC_FORCE else c for c in text.columns]


def _toolbox_force(column: LogColumn) -> LogColumn:
    if column.name.lower().startswith("gf"):
        return replace(column, unit="g", source="Physics Toolbox: g force")
    return replace(column, doubt="Physics Toolbox's linear acceleration is without gravity")


def _is_xsens(text: _Text) -> bool:
    comments = any(line.startswith("//") for line in text.look.preamble)
    return "SampleTimeFine" in text.names or "PacketCounter" in text.names or comments


def _is_dot(text: _Text) -> bool:
    head = " ".join(text.look.preamble)
    return "SampleTimeFine" in text.names and any(word in head for word in ("DeviceTag", "OutputRate", "AppVersion"))


DIALECTS: tuple[tuple[str, str, Callable[[_Text], bool], Callable[[_Text], None]], ...] = (
    ("euroc", "EuRoC", lambda t: t.has("w_RS_S_x"), _as_named),
    ("xsens", "Xsens DOT", _is_dot, _xsens_dot),
    ("xsens", "Xsens MT Manager", _is_xsens, _xsens),
    ("ros", "columns of sensor_msgs/Imu", lambda t: t.has("angular_velocity", "linear_acceleration"), _ros),
    ("phone", "Sensor Logger (phone)", lambda t: "seconds_elapsed" in t.names, _sensor_logger),
    ("phone", "SensorLog (iPhone)", lambda t: t.has("accelerometerAccelerationX"), _sensor_log),
    ("phone", "Physics Toolbox (phone)", lambda t: any(n.lower() == "gfx" for n in t.names), _toolbox),
    ("phone", "phyphox (phone)", lambda t: t.has("Time (s)") and (t.has("(m/s^2)") or t.has("(rad/s)")), _as_named),
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
            return float(match[1].replace(",", "."))
    return None
