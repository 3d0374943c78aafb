"""Text of a clock or a calendar as nanoseconds: 14:03:59.25, 3:59.25, 2016-05-23 21:46:20, with T, Z or an offset."""

import re
from collections.abc import Sequence
from datetime import date
from typing import Any, Literal

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

Fraction = Literal["decimal", "ms", "us"]

LOOKS_LIKE_CLOCK = re.compile(r"^(\d{4}[-/]\d\d?[-/]\d\d?([T ].*)?|.*\d:\d\d.*)$")
_CLOCK = re.compile(
    r"^(?:(\d{4})[-/](\d\d?)[-/](\d\d?)[T ])?(?:(\d{1,4}):)?(\d{1,2}):(\d{1,2})(?:[.,](\d{1,9}))?"
    r"(?:Z|UTC|([+-])(\d\d):?(\d\d))?$"
)
_FRACTION_NS = {"ms": 1_000_000, "us": 1_000}
_EPOCH = date(1970, 1, 1).toordinal()
_SECOND = 1_000_000_000


class NoClock(Exception):
    """Raised for a text that is no clock time; `row` counts from 0 within the given texts."""

    def __init__(self, row: int, text: str) -> None:
        super().__init__(text)
        self.row = row
        self.text = text


def nanoseconds(texts: Any, fraction: Fraction) -> NDArray[np.int64]:
    """Return an Arrow array of texts as times [ns], since midnight or, with a date, since 1970. Raises `NoClock`."""
    if fraction == "decimal" and texts.null_count == 0:
        fast = _cast(texts)
        if fast is not None:
            return fast
    return np.array(_slowly(texts.to_pylist(), fraction), np.int64)


def _cast(texts: Any) -> NDArray[np.int64] | None:
    """Convert texts by Arrow's own parser, where it reads all of them."""
    for kind in (pa.timestamp("ns"), pa.time64("ns")):
        try:
            return texts.cast(kind).cast(pa.int64()).to_numpy(zero_copy_only=False)
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError):
            continue
    return None


def _slowly(texts: Sequence[str | None], fraction: Fraction) -> list[int]:
    found: list[int] = []
    for row, text in enumerate(texts):
        match = _CLOCK.match((text or "").strip().strip('"'))
        if match is None:
            raise NoClock(row, text or "")
        try:
            found.append(_one(match, fraction))
        except ValueError as error:
            raise NoClock(row, text or "") from error
    return found


def _one(match: re.Match[str], fraction: Fraction) -> int:
    """Convert one time text [ns]. Raises `ValueError` for a day that no calendar has."""
    year, month, day, hour, minute, second, digits, sign, offset_h, offset_min = match.groups()
    days = date(int(year), int(month), int(day)).toordinal() - _EPOCH if year else 0
    seconds = days * 86_400 + int(hour or 0) * 3600 + int(minute) * 60 + int(second)
    if sign:
        seconds -= (1 if sign == "+" else -1) * (int(offset_h) * 3600 + int(offset_min) * 60)
    if not digits:
        return seconds * _SECOND
    if fraction == "decimal":
        return seconds * _SECOND + int(digits.ljust(9, "0"))
    return seconds * _SECOND + int(digits) * _FRACTION_NS[fraction]
