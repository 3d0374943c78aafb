"""When a schedule is due, against an independent walk through the local clock, minute by minute."""

from datetime import UTC, datetime, timedelta
from itertools import takewhile
from zoneinfo import ZoneInfo

import pytest

from bench_service.campaigns.schedule import Schedule, latest_due, next_start, starts_after
from procedures.core.errors import BadParameter


def walked(zone: str, begin: datetime, end: datetime, minute: int, hour: int) -> list[datetime]:
    """Every moment at which a clock on the wall of that zone shows hour:minute, by looking at it every minute."""
    found: list[datetime] = []
    moment = begin
    while moment <= end:
        local = moment.astimezone(ZoneInfo(zone))
        if (local.hour, local.minute) == (hour, minute):
            found.append(moment)
        moment += timedelta(minutes=1)
    return found


def starts(cron: str, zone: str, begin: datetime, end: datetime) -> list[datetime]:
    return list(takewhile(lambda t: t <= end, starts_after(cron, zone, begin - timedelta(minutes=1))))


WEEK = timedelta(days=7)


@pytest.mark.parametrize("zone", ["Europe/Kyiv", "America/New_York", "Australia/Lord_Howe", "Asia/Kolkata", "UTC"])
@pytest.mark.parametrize("begin", [datetime(2027, 6, 3, tzinfo=UTC), datetime(2027, 1, 5, tzinfo=UTC)])
def test_on_ordinary_days_the_wall_clock_decides(zone: str, begin: datetime) -> None:
    assert starts("30 1 * * *", zone, begin, begin + WEEK) == walked(zone, begin, begin + WEEK, 30, 1)


@pytest.mark.parametrize(
    ("zone", "day", "hour", "minute"),
    [
        ("Europe/Kyiv", datetime(2027, 3, 28, tzinfo=UTC), 3, 30),
        ("America/New_York", datetime(2027, 3, 14, tzinfo=UTC), 2, 30),
        ("Australia/Lord_Howe", datetime(2027, 10, 2, tzinfo=UTC), 2, 15),  # its clocks move by half an hour
    ],
)
def test_a_time_that_does_not_exist_is_made_up_when_the_clock_has_moved(
    zone: str, day: datetime, hour: int, minute: int
) -> None:
    begin, end = day - timedelta(hours=12), day + timedelta(hours=24)
    shown = walked(zone, begin, end, minute, hour)
    (made_up,) = [t for t in starts(f"{minute} {hour} * * *", zone, begin, end) if t not in shown]
    local = ZoneInfo(zone)
    before, after = (made_up + timedelta(minutes=k) for k in (-1, 0))
    assert after.astimezone(local).utcoffset() > before.astimezone(local).utcoffset()  # the first minute of summer time


@pytest.mark.parametrize(
    ("zone", "day", "hour", "minute"),
    [
        ("Europe/Kyiv", datetime(2027, 10, 31, tzinfo=UTC), 3, 30),
        ("America/New_York", datetime(2027, 11, 7, tzinfo=UTC), 1, 30),
    ],
)
def test_a_time_that_comes_twice_is_due_the_first_time(zone: str, day: datetime, hour: int, minute: int) -> None:
    begin, end = day - timedelta(hours=6), day + timedelta(hours=12)
    first, second = walked(zone, begin, end, minute, hour)
    assert second - first == timedelta(hours=1)
    assert starts(f"{minute} {hour} * * *", zone, begin, end) == [first]
    assert starts(f"{minute} * * * *", zone, first - timedelta(minutes=1), second) == [first, second]


@pytest.mark.parametrize("cron", ["0 0 30 2 *", "0 0 31 4,6 *", "61 0 * * *", "0 0 * *", "0 0 * * * *", "nightly", ""])
def test_a_time_that_never_comes_is_refused(cron: str) -> None:
    with pytest.raises(BadParameter) as refused:
        next_start(cron, "UTC", datetime(2027, 1, 1, tzinfo=UTC))
    assert refused.value.field == "cron"


@pytest.mark.parametrize("zone", ["Europe", "Mars/Olympus", "../etc/passwd", "", "UTC+2", "a" * 90])
def test_what_is_no_time_zone_is_refused(zone: str) -> None:
    with pytest.raises(BadParameter) as refused:
        next_start("0 0 * * *", zone, datetime(2027, 1, 1, tzinfo=UTC))
    assert refused.value.field == "time_zone"


@pytest.mark.parametrize(
    ("cron", "planned", "at", "latest"),
    [
        ("0 1 * * *", "2027-05-01T01:00", "2027-05-01T01:00:05", "2027-05-01T01:00"),
        ("0 1 * * *", "2027-05-01T01:00", "2027-05-09T13:00", "2027-05-09T01:00"),
        ("0 1 1 * *", "2027-05-01T01:00", "2027-07-20T00:00", "2027-07-01T01:00"),
        ("* * * * *", "2026-05-01T01:00", "2027-05-09T13:00:30", "2027-05-09T13:00"),
    ],
)
def test_of_many_missed_starts_the_latest_counts(cron: str, planned: str, at: str, latest: str) -> None:
    moments = [datetime.fromisoformat(text).replace(tzinfo=UTC) for text in (planned, at, latest)]
    schedule = Schedule("s", "c", "u", moments[0], cron, "UTC", next_at=moments[0])
    assert latest_due(schedule, moments[1]) == moments[2]
