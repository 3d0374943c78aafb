"""Proposed meaning of a column from its name: which axis of which triad, in which unit.

A name is a hint, never a proof: everything found here is shown to a person. Names of processed values (without
gravity, in the world's frame, filtered) are known too, so that they are not taken for the sensor's own.
"""

import re
from dataclasses import dataclass

from bench_service.formats.description import Accumulated
from bench_service.formats.input_units import allowed_units, spelled
from procedures.core.recording import Quantity

_UNIT_IN_NAME = re.compile(r"[\[(\]{]\s*([^\[\](){}]+?)\s*[\])}]\s*$")
_UNIT_AT_END = re.compile(r"_((?:rad|deg|m)_?(?:per|p)_?[sh]_?\^?2?|m_?s_?\^?2|rads|degs|dps|degc|mg)$")
"""Unit that ends a name without brackets, as in those of our own exports; its 2 is no index of an axis."""
_ENDS = {"radps": "rad/s", "rads": "rad/s", "degps": "deg/s", "degs": "deg/s", "dps": "deg/s"} | {
    "mps2": "m/s^2",
    "ms2": "m/s^2",
    "degc": "degC",
    "mg": "mg",
}
"""Such ends without underscores, `per` as p, by the spelling that is used here."""
_INDEX = re.compile(r"[\[(]?([0-2])[\])]?$")
_RATE_WORDS = r"gyro|gyr|gyroscope|angular_?(?:rate|velocity|vel)|ang_?vel|omega|omg|w_rs_s|rotation_?rate|rot_?rate"
_FORCE_WORDS = (
    r"accelerometer|accelero|acceleration|accel|acce|acc|specific_?force|a_rs_s|linear_?acceleration|lin_?acc|sf|gforce"
    r"|gf"
)
_GYRO = re.compile(rf"(?:^|[^a-z])(?:raw|uncomp|comp|imu)?_?(?:{_RATE_WORDS})(?:[^a-z]|[xyz](?:$|[^a-z])|$)")
_FORCE = re.compile(rf"(?:^|[^a-z])(?:raw|uncomp|comp|imu)?_?(?:{_FORCE_WORDS})(?:[^a-z]|[xyz](?:$|[^a-z])|$)")
_SHORT_RATE = re.compile(r"^(?:w|g|p_?q_?r|omega)_?([xyz])$")
_SHORT_FORCE = re.compile(r"^(?:a|f|g_?f)_?([xyz])$")
_BODY_RATE = re.compile(r"(?:^|_)w_?b(?:$|[\[(_])")
_BODY_FORCE = re.compile(r"(?:^|_)f_?b(?:$|[\[(_])")
"""Names of NaveGo and of textbooks for rates and forces in the body's frame, wb and fb."""
_ANGLE_STEP = re.compile(r"delta_?(?:theta|angle|q\b)|dtheta|angle_?increment|(?:^|_)d_?ang(?:le)?(?:_|[xyz]|[\[(]|$)")
_VELOCITY_STEP = re.compile(
    r"delta_?(?:v|vel|velocity)(?:[^a-z]|[xyz]|$)|dvel|(?:^|_)dv(?:[^a-z]|[xyz]|$)|velocity_?increment|vel_?inc(?:_|$)"
)
_TEMPERATURE = re.compile(r"(?:^|[^a-z])temp(?:erature)?(?:[^a-z]|$|\d)")
_AXIS = re.compile(r"(?:^|[^a-z])([xyz])(?:$|[^a-z])|([xyz])$")
_PROCESSED = (
    (re.compile(r"free_?acc"), "free acceleration: gravity is taken off, so it is no specific force"),
    (re.compile(r"user_?acc|without_?g|no_?grav"), "gravity is taken off, so it is no specific force"),
    (
        re.compile(r"linear_?accel(?:eration)?_?[xyz]?_?(?:\(|$|\[)"),
        "of a phone, linear acceleration is without gravity",
    ),
    (re.compile(r"(?:^|[^a-z])lin_?acce?(?:[^a-z]|$)"), "linear acceleration is without gravity"),
    (
        re.compile(
            r"(?:^|[^a-z])(?:mag|magn|magnetometer|gravity|grav|quat|euler|orientation|covariance|cov|bias|std)"
        ),
        "",
    ),
)
_TIME = re.compile(
    r"^(?:#?\s*)(?:time|timestamp|t|stamp|sec|seconds|tow|gps_?time|time_?s|elapsed|uptime)(?:[^a-z]|$)|sample_?time_?fine|seconds_elapsed|timestartup|time_?gps|_time$|timestamp"
)
_COUNTER = re.compile(
    r"count|^(?:index|idx|row|seq|sequence|sample|samples|packet|id|no|nr|n|i|k)$|(?:sample|packet|row)_?(?:no|nr|num|index)"
)
_TIME_UNITS = (
    (re.compile(r"(?:\bns\b|nano|_ns$|\[ns\])"), "ns"),
    (re.compile(r"(?:\bus\b|µs|micro|_us$|\[us\])"), "us"),
    (re.compile(r"(?:\bms\b|milli|_ms$|\[ms\])"), "ms"),
    (re.compile(r"(?:\bs\b|sec|_s$|\[s\])"), "s"),
)
_SPELLED = {
    "rad s^-1": "rad/s",
    "rad s-1": "rad/s",
    "rads": "rad/s",
    "rad/sec": "rad/s",
    "deg/sec": "deg/s",
    "degs": "deg/s",
    "degree/s": "deg/s",
    "degrees/s": "deg/s",
    "deg s^-1": "deg/s",
    "m s^-2": "m/s^2",
    "m s-2": "m/s^2",
    "m/s/s": "m/s^2",
    "m/s**2": "m/s^2",
    "m/s2": "m/s^2",
    "mps2": "m/s^2",
    "g": "g",
    "g-force": "g",
    "degrees per second": "deg/s",
    "meters/second^2": "m/s^2",
    "degc": "degC",
    "deg c": "degC",
    "celsius": "degC",
    "°c": "degC",
    "k": "K",
}


@dataclass(frozen=True)
class Hint:
    """Proposed meaning of a column by its name."""

    quantity: Quantity | Accumulated | None = None
    channel: str = ""
    unit: str | None = None
    """Unit that the name gives; None: none."""
    doubt: str = ""
    """Sentence on values that are processed, by their name; empty: none."""


def unit_of(text: str, quantity: Quantity | Accumulated | None) -> str | None:
    """Return the spelling that is used here of a unit found in a file; None: it is no unit of the quantity."""
    bare = " ".join(text.split())
    unit = spelled(_SPELLED.get(bare.lower(), bare))
    if isinstance(quantity, Quantity) and unit in allowed_units(quantity):
        return unit
    return None


def hint(name: str) -> Hint:
    """Return the likely meaning of a column by its name, or by the last part of its path."""
    found = _hint(name)
    last = _last(name)
    return found if found.quantity is not None or found.doubt or last == name else _hint(last)


def _last(name: str) -> str:
    return re.split(r"[./]", name.rstrip("./"))[-1] if not _UNIT_IN_NAME.search(name) else name


def _hint(name: str) -> Hint:
    lower = _plain(name)
    doubt = next((words for pattern, words in _PROCESSED if pattern.search(lower)), None)
    if doubt == "":
        return Hint()
    axis = _axis(lower)
    short = _plain(_UNIT_IN_NAME.sub(lambda m: m[0] if m[1].isdecimal() else "", name)).rstrip("_")
    found: tuple[Quantity, str] | None = None
    if _ANGLE_STEP.search(lower):
        found = Quantity.ANGLE_INCREMENT, "gyro"
    elif _VELOCITY_STEP.search(lower):
        found = Quantity.VELOCITY_INCREMENT, "accelerometer"
    elif _GYRO.search(lower) or _SHORT_RATE.match(short) or _BODY_RATE.search(lower):
        found = Quantity.ANGULAR_RATE, "gyro"
    elif _FORCE.search(lower) or _SHORT_FORCE.match(short) or _BODY_FORCE.search(lower):
        found = Quantity.SPECIFIC_FORCE, "accelerometer"
    if found is not None and axis:
        quantity, kind = found
        return Hint(quantity, f"{kind}_{axis}", _named_unit(name, quantity), doubt or "")
    if _TEMPERATURE.search(lower) and found is None:
        return Hint(Quantity.TEMPERATURE, "temperature", _named_unit(name, Quantity.TEMPERATURE))
    return Hint()


def is_counter(name: str) -> bool:
    """Return whether a name is that of a count of samples or packets, which is no time."""
    return _COUNTER.search(_plain(name)) is not None


def is_time(name: str) -> bool:
    """Return whether a name is that of a time column."""
    return any(_TIME.search(_plain(part)) for part in (name, _last(name)))


def time_unit(name: str) -> str | None:
    """Return the unit of a time column that its name gives: s, ms, us, ns; None: it gives none."""
    lower = name.lower()
    return next((unit for pattern, unit in _TIME_UNITS if pattern.search(lower)), None)


def _plain(name: str) -> str:
    """Split camel case, lower the case, and take the last part of a path with what is before it."""
    split = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name.strip())
    return re.sub(r"[\s.\-/]+", "_", split.lower().lstrip("#% "))


def _axis(lower: str) -> str:
    lower = _UNIT_AT_END.sub("", lower)
    bare = re.sub(r"[\[(][^\[\](){}]*[a-z/][^\[\](){}]*[\])]\s*$", "", lower).rstrip("_ ")
    index = _INDEX.search(bare)
    if index is not None and not re.search(r"[xyz]_?\d?$", bare):
        return "xyz"[int(index[1])]
    matches = list(_AXIS.finditer(bare))
    return (matches[-1][1] or matches[-1][2]) if matches else ""


def _named_unit(name: str, quantity: Quantity) -> str | None:
    match = _UNIT_IN_NAME.search(name)
    if match is not None:
        return unit_of(match[1], quantity)
    if (end := _UNIT_AT_END.search(name.lower())) is None:
        return None
    return unit_of(_ENDS.get(re.sub(r"[_^]", "", end[1]).replace("per", "p"), ""), quantity)
