"""A time at which something starts, as a person types it at a terminal."""

from datetime import datetime, timedelta, tzinfo
from zoneinfo import ZoneInfo

from bench_service.cli.refusal import Refused
from bench_service.wall_clock import now

FORMS = "HH:MM (the next one), 'YYYY-MM-DD HH:MM', or with a zone 2026-12-01T22:30+02:00"
FARTHEST = timedelta(days=50 * 366)
"""Longest time ahead of a single start, as `campaigns.schedule` has it: a later one is a slip of the keyboard."""


def start_time(text: str, zone: str | None = None) -> datetime:
    """Read a time to come, on the clock of this host or of the zone named.

    Raises `Refused` for another form, a time that has passed and one too far ahead.
    """
    there = _zone(zone)
    try:
        at = datetime.combine(now().astimezone(there).date(), datetime.strptime(text, "%H:%M").time())
        at = _shown_in(at, there)
        if at <= now():
            at = _shown_in(at.replace(tzinfo=None) + timedelta(days=1), there)
        return at
    except ValueError:
        pass
    try:
        at = datetime.fromisoformat(text)
    except ValueError:
        raise Refused(f"--at {text!r}: {FORMS}") from None
    at = at if at.tzinfo else _shown_in(at, there)
    if at <= now():
        raise Refused(f"--at {text!r} has passed: it is {now().astimezone(at.tzinfo):%Y-%m-%d %H:%M %Z} now")
    if at > now() + FARTHEST:
        raise Refused(f"--at {text!r}: a time at most {FARTHEST.days} days ahead (50 years) is needed")
    return at


def _zone(name: str | None) -> tzinfo | None:
    try:
        return None if name is None else ZoneInfo(name)
    except (KeyError, ValueError, OSError):
        raise Refused(f"--time-zone {name!r}: the IANA name of a time zone, such as Europe/Kyiv or UTC") from None


def _shown_in(local: datetime, zone: tzinfo | None) -> datetime:
    """Return a time of the wall clock with its zone: this host's where none is named."""
    return local.astimezone() if zone is None else local.replace(tzinfo=zone)
