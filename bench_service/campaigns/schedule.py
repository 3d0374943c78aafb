"""Schedules of campaigns: a cron expression in a time zone, or one moment, and the rules for missed starts.

Where clocks are set forward, a start in the hour that is left out is made up at its end; a day that a zone leaves out
has none. Where clocks are set back, a start at a fixed hour happens once, in the first of the two hours, and one of
every hour (minute or hour begin with a star) in both. That is the rule of Debian's cron.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from typing import Protocol
from zoneinfo import ZoneInfo

from procedures.core.errors import BadParameter

FIELDS = 5
"""Number of fields: minute, hour, day of month, month, day of week."""
LOOK_BACK = timedelta(days=2)
"""Time back over which the latest missed start is searched first: of many missed starts the latest counts."""

FARTHEST = timedelta(days=50 * 366)
"""Longest time ahead of a single start."""
AHEAD = timedelta(hours=1)
"""Longest step back of the clock that counts as a correction: starts already made are not repeated. After a longer one
the earlier time counts as wrong."""


class Missed(StrEnum):
    """Rule for a start that was missed because no service was running: run it late, or leave it out."""

    RUN_ONCE = "run_once"
    """One run makes up for all missed starts."""
    SKIP = "skip"
    """The schedule waits for its next start."""


class Overlap(StrEnum):
    """The rule for a start while the schedule's previous run is open."""

    SKIP = "skip"
    QUEUE = "queue"
    """The new run waits for the older one."""


@dataclass(frozen=True)
class Schedule:
    """A campaign that is run on a unit repeatedly, by a cron expression in a time zone, with its next and last
    start; or exactly once, at a moment with its date.
    """

    id: str
    campaign: str
    unit: str
    created_at: datetime
    cron: str | None = None
    time_zone: str | None = None
    """IANA name of the time zone of the expression, such as Europe/Kyiv."""
    at: datetime | None = None
    """The only start, in place of cron and time zone: after it the schedule is off, and stays off."""
    bench: str | None = None
    enabled: bool = True
    missed: Missed = Missed.RUN_ONCE
    start_within_s: float = 300.0
    """Delay beyond which a start counts as missed [s]."""
    overlap: Overlap = Overlap.SKIP
    labels: dict[str, str] = field(default_factory=dict[str, str])
    team: str = ""
    """Team whose members change it, and act on its runs; empty: every engineer, and every operator on the runs."""
    next_at: datetime | None = None
    """Next planned start (UTC); None while disabled."""
    last_at: datetime | None = None
    """The last planned start that was handled, with whatever outcome."""
    last_run: str | None = None
    last_outcome: str = ""
    """Outcome of that start, as text."""


def zone_of(name: str) -> ZoneInfo:
    """Return the time zone of a name. Raises `BadParameter` for a name that is no time zone."""
    try:
        return ZoneInfo(name)
    except (KeyError, ValueError, OSError):  # OSError: the name of a folder of zones
        raise BadParameter("time_zone", name, "the IANA name of a time zone, such as Europe/Kyiv or UTC") from None


class Times(Protocol):
    """The times of a schedule, or of a request for one: cron expression and time zone, or one moment. Interface."""

    @property
    def cron(self) -> str | None: ...

    @property
    def time_zone(self) -> str | None: ...

    @property
    def at(self) -> datetime | None: ...


def first_start(times: Times, moment: datetime) -> datetime:
    """Return the first start of a schedule after a moment, in UTC. Raises `BadParameter` where its times are not of one
    of the two kinds, never come, or are over.
    """
    if times.at is None:
        if times.cron is None:
            raise BadParameter("cron", None, "a cron expression for repeated starts, or `at` for a single one")
        return next_start(times.cron, _zone_name(times), moment)
    if times.cron is not None or times.time_zone is not None:
        raise BadParameter("at", times.at.isoformat(), "alone: cron and time_zone belong to repeated starts")
    at = times.at.astimezone(UTC)
    if not moment < at <= moment + FARTHEST:
        allowed = f"a moment after {moment.isoformat(timespec='seconds')}, at most 50 years ahead"
        raise BadParameter("at", times.at.isoformat(), allowed)
    return at


def start_after(schedule: Schedule, moment: datetime) -> datetime | None:
    """The start of a stored schedule that follows a moment, in UTC; None after the only one. Raises `BadParameter`."""
    return next(iter(_starts(schedule, moment)), None)


def _starts(schedule: Schedule, moment: datetime) -> Iterator[datetime]:
    """All starts of a stored schedule after a moment."""
    if schedule.at is None:
        return starts_after(schedule.cron or "", _zone_name(schedule), moment)
    return iter((schedule.at,) if schedule.at > moment else ())


def _zone_name(times: Times) -> str:
    if times.time_zone is None:
        raise BadParameter("time_zone", None, "the IANA name of the cron expression's time zone, such as Europe/Kyiv")
    return times.time_zone


def starts_after(cron: str, time_zone: str, moment: datetime) -> Iterator[datetime]:
    """Yield every start after a moment, in UTC, without end. Raises `BadParameter` for an invalid expression or
    zone.
    """
    from cronsim import CronSim, CronSimError

    zone = zone_of(time_zone)
    if len(cron.split()) != FIELDS:
        raise BadParameter("cron", cron, "five fields: minute, hour, day of month, month, day of week")
    local = moment.astimezone(zone)
    try:
        found = CronSim(cron, local.replace(tzinfo=None, fold=0) if _at_fixed_times(cron) else local)
    except CronSimError as error:
        raise BadParameter("cron", cron, f"a valid cron expression, which this is not: {error}") from None
    shown = (_moment_shown(start, zone) if start.tzinfo is None else start.astimezone(UTC) for start in found)
    return _rising(shown, moment)


def _at_fixed_times(cron: str) -> bool:
    """Return whether an expression means hours on the wall clock, not every hour or every so many hours.

    "*/30 3 * * *" does: its minutes repeat, yet only within an hour that a clock change may leave out or double.
    """
    return not cron.split()[1].startswith("*")


def _moment_shown(local: datetime, zone: ZoneInfo) -> datetime | None:
    """The first moment [UTC] at which the clock of a zone shows a time, or has jumped over it.

    None where the zone leaves out the whole day.
    """
    day, before, skipped = local.date(), local.replace(tzinfo=zone, fold=1).astimezone(UTC), False
    while not _exists(local, zone):
        local, skipped = local + timedelta(minutes=1), True
    if skipped and local.date() > day > before.astimezone(zone).date():
        return None
    return local.replace(tzinfo=zone).astimezone(UTC)


def _exists(local: datetime, zone: ZoneInfo) -> bool:
    shown = local.replace(tzinfo=zone).astimezone(UTC).astimezone(zone)
    return shown.replace(tzinfo=None, fold=0) == local


def _rising(moments: Iterator[datetime | None], after: datetime) -> Iterator[datetime]:
    """The moments that are later than `after` and than each other: the second of two equal hours repeats nothing."""
    for moment in moments:
        if moment is not None and moment > after:
            after = moment
            yield moment


def next_start(cron: str, time_zone: str, moment: datetime) -> datetime:
    """Return the first start after a moment, in UTC. Raises `BadParameter` for an expression not due within 50
    years.
    """
    start = next(starts_after(cron, time_zone, moment), None)
    if start is None:
        raise BadParameter("cron", cron, "an expression that is due within 50 years")
    return start


def latest_due(schedule: Schedule, at: datetime) -> datetime:
    """Return the latest start up to `at` of a schedule that is due, that is, whose next start is not after `at`."""
    assert schedule.next_at is not None
    latest = schedule.next_at
    for begin in (max(schedule.next_at, at - LOOK_BACK), schedule.next_at):
        for start in _starts(schedule, begin):
            if start > at:
                break
            latest = start
        if latest > schedule.next_at or begin == schedule.next_at:
            break
    return latest


def brought_back(schedule: Schedule, at: datetime) -> datetime | None:
    """The next start of a schedule whose clock was ahead when its present one was worked out; None where it was not.

    While the clock runs on, the next start is always the first one after now. A later one was worked out by a clock
    that was ahead. A start that was handled meanwhile is not repeated, and a clock that was set back by less than
    `AHEAD` repeats nothing: then the schedule waits until the clock is there again.
    """
    if schedule.next_at is None or (schedule.last_at is not None and at < schedule.last_at <= at + AHEAD):
        return None
    first = next((start for start in _starts(schedule, at) if start != schedule.last_at), None)
    return first if first is not None and first < schedule.next_at else None
