"""SIMSERV protocol of S!MPAC chambers: numbered commands, fields separated by the byte 0xB6; from published drivers."""

from collections.abc import Sequence
from enum import IntEnum, IntFlag
from math import isfinite

from bench_service.drivers.answers import BadAnswer, Refusal, shown

SEPARATOR = b"\xb6"
REQUEST_ENDING = b"\r"
REPLY_ENDING = b"\r\n"
CHAMBER = 1
MOST_ARGUMENTS = 4
ACCEPTED = 1
WORDS = {
    -5: "unknown command",
    -6: "too few or wrong parameters",
    -8: "the data could not be read",
}
BANNER = b"100 OK:"
"""Beginning of the banner on another port of such a controller."""


class Command(IntEnum):
    """Numbers of the commands that are used here."""

    STATUS = 10012
    SET_POINT = 11001
    GET_SET_POINT = 11002
    ACTUAL = 11004
    INPUT_MINIMUM = 11007
    INPUT_MAXIMUM = 11009
    GET_GRADIENT_UP = 11066
    SET_GRADIENT_UP = 11068
    GET_GRADIENT_DOWN = 11070
    SET_GRADIENT_DOWN = 11072
    SET_DIGITAL = 14001
    GET_DIGITAL = 14003
    DIGITAL_INPUT = 15002
    DIGITAL_INPUT_COUNT = 15004
    DIGITAL_INPUT_NAME = 15005
    MESSAGE_COUNT = 17002
    MESSAGE_TEXT = 17007
    INFORMATION = 99997


class Information(IntEnum):
    """Arguments of `Command.INFORMATION`."""

    TYPE = 1
    SERIAL = 3
    FIRMWARE = 8


class ChamberStatus(IntFlag):
    """Status: the lowest bit is always set."""

    PRESENT = 1
    RUNNING = 2
    WARNING = 4
    ALARM = 8


def request(command: int, arguments: Sequence[str] = ()) -> bytes:
    """Return the bytes of a request to the chamber. Raises `ValueError` for arguments that no request can carry."""
    if len(arguments) > MOST_ARGUMENTS or not 0 <= command <= 99999:
        raise ValueError(f"command {command} with {len(arguments)} arguments is none of SIMSERV")
    fields = [f"{command:05d}", str(CHAMBER), *arguments]
    if any(not part.isascii() or not part.isprintable() for part in fields):
        raise ValueError(f"arguments {arguments!r} are not printable ASCII")
    return SEPARATOR.join(part.encode("ascii") for part in fields) + REQUEST_ENDING


def number(value: float) -> str:
    """Return the text of a number in a request, at most three decimals. Raises `ValueError` where it is not finite."""
    if not isfinite(value):
        raise ValueError(f"{value!r} is not a number that can be sent")
    return f"{value:.3f}".rstrip("0").removesuffix(".")


def reply(answer: bytes, values: int) -> tuple[str, ...]:
    """Return the values of a reply after its code. Raises `Refusal` with the code in words, `BadAnswer` where they are
    not that many.
    """
    if answer.startswith(BANNER):
        raise BadAnswer(f"{shown(answer)} is the banner of another port of the controller: SIMSERV is on port 2049")
    code, *rest = answer.split(SEPARATOR)
    if not code.removeprefix(b"-").isdigit() or len(code) > 6:
        raise BadAnswer(f"{shown(answer)} does not begin with a code")
    if int(code) != ACCEPTED:
        raise Refusal(f"{WORDS.get(int(code), 'refused')} (code {int(code)})")
    if len(rest) != values:
        raise BadAnswer(f"{shown(answer)} holds {len(rest)} values where {values} were requested")
    return tuple(part.decode("latin-1").strip() for part in rest)


def number_of(answer: bytes) -> float:
    """Return the one number of a reply. Raises `Refusal` also where the controller could not read it, `BadAnswer`."""
    (text,) = reply(answer, 1)
    if text.casefold() == "read failed":
        raise Refusal("the controller could not read the value")
    try:
        value = float(text)
    except ValueError:
        raise BadAnswer(f"{text!r} is not a number") from None
    if not isfinite(value) or "_" in text:
        raise BadAnswer(f"{text!r} is not a finite number")
    return value


def whole_of(answer: bytes, least: int = 0, most: int = 65535) -> int:
    """Return the one whole number of a reply, within a range. Raises `Refusal`, `BadAnswer`."""
    value = number_of(answer)
    if value != int(value) or not least <= value <= most:
        raise BadAnswer(f"{value:g} is not a whole number within {least} … {most}")
    return int(value)


def text_of(answer: bytes) -> str:
    """Return the one text of a reply. Raises `Refusal`, `BadAnswer` where it is not printable."""
    (text,) = reply(answer, 1)
    if not text.isprintable():
        raise BadAnswer(f"{shown(answer)} holds characters that are not printable")
    return text


def accepted(answer: bytes) -> None:
    """Check that the chamber accepted a set command. Raises `Refusal` with its error code, `BadAnswer` for a malformed
    reply.
    """
    reply(answer, 0)


def status_of(answer: bytes) -> ChamberStatus:
    """Return the status of the chamber from a reply. Raises `Refusal`, `BadAnswer`."""
    value = whole_of(answer, 0, 15)
    if not value & ChamberStatus.PRESENT:
        raise BadAnswer(f"status {value} lacks the bit that is always set")
    return ChamberStatus(value)
