"""ACUTROL dialect of a rate table's controller as text statements; from openly published drivers, not from a manual.

Port, prefix of the answers and line endings are settings, for the sources disagree or are single.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Literal

from bench_service.drivers.answers import BadAnswer, Refusal, shown

Mode = Literal["position", "rate", "synthesis", "off"]
Quantity = Literal["rate", "acc"]
DECIMALS = 5
"""Decimals of a demand: the controller's command resolution is 0.00001 deg and deg/s."""
MODES: dict[str, str] = {"position": "pos", "rate": "rate", "synthesis": "synt"}
"""Name of a mode in the statement of its limits."""
MODE_STATEMENTS: dict[str, str] = {"synthesis": "synt"}
"""Name of a mode in its own statement, where that was seen in another form."""
SERVICE_REQUEST, INTERLOCK_FAULT = 64, 1
STATUS_BITS = {0: "interlock fault", 6: "service request"}
"""Bits of `*stb?`: 65 was seen at an interlock fault; the split into two bits is inferred."""


@dataclass(frozen=True)
class Dialect:
    """Settings of one ACUTROL controller's dialect: prefix of the answers, line endings, acknowledgement."""

    reply_prefix_bytes: int = 8
    """Bytes before the text of each answer, of any value."""
    ending: bytes = b"\r\n"
    """Ending of each statement."""
    reply_ending: bytes = b"\r\n"
    acknowledgement: str = "OK"
    """Answer to a statement that is no query; empty: the controller sends none."""


@dataclass(frozen=True)
class AxisState:
    """Position [deg] and rate [deg/s] of one axis by its encoder."""

    position_deg: float
    rate_deg_s: float


@dataclass(frozen=True)
class AbsoluteLimits:
    """Limits of one axis as the factory set them; order of the fields as a published driver prints them."""

    rate_deg_s: float
    acceleration_deg_s2: float
    jerk_deg_s3: float
    minimum_deg: float
    maximum_deg: float
    rate_trip_deg_s: float


def line(dialect: Dialect, statement: str) -> bytes:
    """Return the bytes of a statement with its ending. Raises `ValueError` for what cannot be one."""
    if not statement.isascii() or not statement.isprintable():
        raise ValueError(f"statement {statement!r} has characters that are not printable ASCII")
    return statement.encode("ascii") + dialect.ending


def number(value: float) -> str:
    """Return the text of a number in a demand. Raises `ValueError` where it is not finite."""
    if not isfinite(value):
        raise ValueError(f"{value!r} is not a number that can be commanded")
    return f"{value:.{DECIMALS}f}"


def position_demand(axis: int, angle_deg: float) -> str:
    """Return the statement that loads a position; it acts once the axis is in position mode."""
    return f":demand:position {axis},{number(angle_deg)}"


def rate_demand(axis: int, rate_deg_s: float) -> str:
    """Return the statement that loads a rate [deg/s]; it acts once the axis is in rate mode."""
    return f":demand:rate {axis},{number(rate_deg_s)}"


def oscillator_demand(axis: int, amplitude_deg: float, frequency_hz: float, phase_deg: float) -> str:
    """Return the statement that loads a sinusoid; it acts once the axis is in the synthesizer's mode."""
    return f":demand:oscillator {axis},{number(amplitude_deg)},{number(frequency_hz)},{number(phase_deg)}"


def demand_query(kind: Literal["position", "rate"], axis: int) -> str:
    """Return the query of a loaded demand: by the grammar of queries, not seen in a driver."""
    return f":demand:{kind}? {axis}"


def mode_statement(axis: int, mode: Mode) -> str:
    """Return the statement that sets the mode of an axis."""
    return f":mode:{MODE_STATEMENTS.get(mode, mode)} {axis}"


def mode_query(axis: int) -> str:
    """Return the query of an axis' mode."""
    return f":mode? {axis}"


def limit_statement(quantity: Quantity, mode: Mode, axis: int, value: float) -> str:
    """Return the statement that sets a limit (rate or acceleration) of one mode of an axis."""
    return f":limit:{quantity} {MODES[mode]},{axis},{number(value)}"


def limit_query(quantity: Quantity, mode: Mode, axis: int) -> str:
    """Return the query of a limit of one mode of an axis."""
    return f":limit:{quantity}? {MODES[mode]},{axis}"


def absolute_limits_query(axis: int) -> str:
    """Return the query of an axis' factory limits."""
    return f":limit:absolute? {axis}"


def states_query(axes: Sequence[int]) -> str:
    """Return one query of position and rate of several axes; its answer joins them by semicolons."""
    parts = [f"pos? {axis}" for axis in axes] + [f"rate? {axis}" for axis in axes]
    return ":read:" + ";".join(parts)


def interlock_query(axis: int) -> str:
    """Return the query of an axis' interlock. There is no statement here that closes or resets one: a person does."""
    return f":interlock? {axis}"


IDENTITY_QUERY = "*idn?"
STATUS_QUERY = "*stb?"


def text(dialect: Dialect, answer: bytes) -> str:
    """Return the text of an answer after its prefix. Raises `BadAnswer` where it is shorter or not printable ASCII."""
    rest = answer[dialect.reply_prefix_bytes :]
    if len(answer) < dialect.reply_prefix_bytes:
        raise BadAnswer(f"{shown(answer)} is shorter than reply_prefix_bytes = {dialect.reply_prefix_bytes}")
    try:
        found = rest.decode("ascii").strip()
    except UnicodeDecodeError:
        raise BadAnswer(
            f"{shown(answer)} is not text after reply_prefix_bytes = {dialect.reply_prefix_bytes}"
        ) from None
    if not found or not found.isprintable():
        raise BadAnswer(
            f"{shown(answer)} has no printable text after reply_prefix_bytes = {dialect.reply_prefix_bytes}"
        )
    return found


def acknowledged(dialect: Dialect, answer: bytes) -> None:
    """Check the answer to a statement that is no query. Raises `Refusal` with the controller's words, `BadAnswer`."""
    if not dialect.acknowledgement:
        return
    found = text(dialect, answer)
    if found.casefold() != dialect.acknowledgement.casefold():
        if _is_number(found.split(";")[0]):
            raise BadAnswer(f"{found!r} answers a query, but none was sent")
        raise Refusal(found)


def identity(dialect: Dialect, answer: bytes) -> tuple[str, str, str, str]:
    """Return maker, model, serial and firmware from an answer. Raises `BadAnswer`, as where the prefix has another
    length.
    """
    parts = [part.strip() for part in text(dialect, answer).split(",")]
    if len(parts) != 4 or not parts[0]:
        raise BadAnswer(
            f"{shown(answer)} is not an identity of four fields after {dialect.reply_prefix_bytes} bytes: "
            "look at reply_prefix_bytes"
        )
    return parts[0], parts[1], parts[2], parts[3]


def numbers(dialect: Dialect, answer: bytes, count: int, separator: str = ";") -> tuple[float, ...]:
    """Return the numbers of an answer. Raises `BadAnswer` where they are not `count`, or not finite."""
    found = text(dialect, answer)
    parts = found.split(separator)
    if len(parts) != count:
        raise BadAnswer(f"{found!r} holds {len(parts)} values where {count} were requested")
    if not all(_is_number(part) for part in parts):
        raise BadAnswer(f"{found!r} holds a value that is not a finite number")
    return tuple(float(part) for part in parts)


def states(dialect: Dialect, answer: bytes, axes: int) -> tuple[AxisState, ...]:
    """Return the states of the axes in the order of `states_query`. Raises `BadAnswer`."""
    values = numbers(dialect, answer, 2 * axes)
    return tuple(AxisState(values[k], values[axes + k]) for k in range(axes))


def absolute_limits(dialect: Dialect, answer: bytes) -> AbsoluteLimits:
    """Return the factory limits of an axis from the answer to `absolute_limits_query`. Raises `BadAnswer`."""
    return AbsoluteLimits(*numbers(dialect, answer, 6, ","))


def word(dialect: Dialect, answer: bytes) -> str:
    """Return one word of an answer in lower case, as a mode or an interlock. Raises `BadAnswer`."""
    found = text(dialect, answer)
    if not found.replace(" ", "").isalpha():
        raise BadAnswer(f"{found!r} is not a word")
    return found.casefold()


def status_byte(dialect: Dialect, answer: bytes) -> int:
    """Return the status byte of an answer, 0 … 255. Raises `BadAnswer`."""
    found = text(dialect, answer)
    if not (found.isascii() and found.isdigit() and len(found) <= 3 and int(found) <= 255):
        raise BadAnswer(f"{found!r} is not a status byte")
    return int(found)


def _is_number(part: str) -> bool:
    try:
        return isfinite(float(part)) and "_" not in part
    except ValueError:
        return False
