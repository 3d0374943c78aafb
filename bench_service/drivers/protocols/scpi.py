"""SCPI of a power supply: statements and answers as text. Queries of protection and mode differ by maker: settings."""

import re
from dataclasses import dataclass
from math import isfinite

from bench_service.drivers.answers import BadAnswer, Refusal, shown

ENDING = b"\n"
ERROR_CODE = re.compile(r"[+-]?[0-9]{1,6}")
IDENTITY_QUERY = "*IDN?"
ERROR_QUERY = "SYST:ERR?"


@dataclass(frozen=True)
class Dialect:
    """Settings of one supply's SCPI dialect: channel, queries of trip and mode, line ending."""

    channel: int | None = None
    """Number of the output, as a suffix of the first header; None: a supply with one output and no suffix."""
    trip_query: str = "OUTP:PROT:TRIP?"
    """Query that answers 1 after a protection has tripped; empty: the supply does not say it."""
    mode_query: str = "OUTP:MODE?"
    """Query that answers CC while the current limit holds the output; empty: it follows from the measured values."""
    ending: bytes = ENDING


def line(dialect: Dialect, statement: str) -> bytes:
    """Return the bytes of a statement with its ending. Raises `ValueError` for what cannot be one."""
    if not statement.isascii() or not statement.isprintable():
        raise ValueError(f"statement {statement!r} has characters that are not printable ASCII")
    return statement.encode("ascii") + dialect.ending


def header(dialect: Dialect, words: str) -> str:
    """Return the header with the channel's number after its first word, as in OUTP2:STAT."""
    if dialect.channel is None:
        return words
    first, colon, rest = words.partition(":")
    query = "?" if not colon and first.endswith("?") else ""
    return f"{first.removesuffix('?')}{dialect.channel}{query}{colon}{rest}"


def set_voltage(dialect: Dialect, voltage_v: float) -> str:
    """Return the statement that sets the voltage [V]."""
    return f"{header(dialect, 'VOLT')} {number(voltage_v)}"


def set_current(dialect: Dialect, current_a: float) -> str:
    """Return the statement that sets the current limit [A]."""
    return f"{header(dialect, 'CURR')} {number(current_a)}"


def set_output(dialect: Dialect, on: bool) -> str:
    """Return the statement that switches the output on or off."""
    return f"{header(dialect, 'OUTP')} {'ON' if on else 'OFF'}"


def number(value: float) -> str:
    """Return the text of a number in a statement, four decimals. Raises `ValueError` where it is not finite."""
    if not isfinite(value):
        raise ValueError(f"{value!r} is not a number that can be commanded")
    return f"{value:.4f}"


def text(answer: bytes) -> str:
    """Return the text of an answer. Raises `BadAnswer` where it is empty or not printable ASCII."""
    try:
        found = answer.decode("ascii").strip()
    except UnicodeDecodeError:
        raise BadAnswer(f"{shown(answer)} is not text") from None
    if not found or not found.isprintable():
        raise BadAnswer(f"{shown(answer)} is not text")
    return found


def identity(answer: bytes) -> tuple[str, str, str, str]:
    """Return maker, model, serial and firmware from an answer. Raises `BadAnswer`."""
    parts = [part.strip() for part in text(answer).split(",")]
    if len(parts) != 4:
        raise BadAnswer(f"{shown(answer)} is not an identity of four fields")
    return parts[0], parts[1], parts[2], parts[3]


def value(answer: bytes) -> float:
    """Return the number of an answer. Raises `BadAnswer` where it is none, or SCPI's "not a number"."""
    found = text(answer)
    try:
        number_found = float(found)
    except ValueError:
        raise BadAnswer(f"{found!r} is not a number") from None
    if not isfinite(number_found) or abs(number_found) > 1e37 or "_" in found:
        raise BadAnswer(f"{found!r} is not a finite number")
    return number_found


def switch(answer: bytes) -> bool:
    """Return whether an answer says that a switch is on. Raises `BadAnswer` for neither on nor off."""
    found = text(answer).upper()
    if found not in ("0", "1", "ON", "OFF"):
        raise BadAnswer(f"{found!r} is not the state of a switch")
    return found in ("1", "ON")


def mode(answer: bytes) -> str:
    """Return the mode of the output from an answer: "CV", "CC" or "OFF". Raises `BadAnswer`."""
    found = text(answer).upper()
    if found not in ("CV", "CC", "OFF"):
        raise BadAnswer(f"{found!r} is not the mode of an output")
    return found


def error(answer: bytes) -> tuple[int, str]:
    """Return number and text of the oldest error of the queue, 0 where it is empty. Raises `BadAnswer`."""
    found = text(answer)
    code, comma, words = found.partition(",")
    if not comma or not ERROR_CODE.fullmatch(code.strip()):
        raise BadAnswer(f"{found!r} is not an entry of an error queue")
    return int(code), words.strip().strip('"')


def no_error(answer: bytes) -> None:
    """Check that the error queue is empty. Raises `Refusal` with the supply's words, `BadAnswer`."""
    code, words = error(answer)
    if code != 0:
        raise Refusal(f"{words} (error {code})")
