"""Moments as people type them in conditions: a time, a date, or how long ago."""

import re
from datetime import UTC, datetime, timedelta

from bench_service.cli.refusal import Refused
from bench_service.wall_clock import now

AGO = re.compile(r"(\d+(?:\.\d+)?)(m|h|d|w)")
UNITS = {"m": "minutes", "h": "hours", "d": "days", "w": "weeks"}
FORMS = "2026-11-30T08:00:00Z, 2026-11-30 (midnight UTC), or how long ago: 90m, 12h, 7d, 2w"


def moment_of(option: str, text: str | None) -> str | None:
    """Convert a moment that a person typed to ISO 8601 with its zone; None stays None. Without a zone it is UTC, as
    commands print it.

    Raises `Refused` with the forms that are understood.
    """
    if not text:
        return text
    try:
        if (ago := AGO.fullmatch(text.strip())) is not None:
            return (now() - timedelta(**{UNITS[ago[2]]: float(ago[1])})).isoformat()
        found = datetime.fromisoformat(text.strip())
    except (ValueError, OverflowError):
        raise Refused(f"{option} {text}: expected {FORMS}") from None
    return (found if found.tzinfo else found.replace(tzinfo=UTC)).isoformat()
