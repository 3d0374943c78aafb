"""Times of a start as people type them: next on a clock, on a day, with a zone; what has passed is refused."""

from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

import pytest

from bench_service.campaigns import schedule
from bench_service.cli.asking.start_time import FARTHEST, start_time
from bench_service.cli.refusal import Refused
from bench_service.wall_clock import now


@pytest.mark.parametrize("zone", ["Europe/Kyiv", "America/St_Johns", "UTC"])
def test_a_time_alone_is_the_next_one_on_the_clock_of_its_zone(zone: str) -> None:
    for ahead in (timedelta(minutes=2), timedelta(hours=-2)):
        wanted = (now() + ahead).astimezone(ZoneInfo(zone)).strftime("%H:%M")
        at = start_time(wanted, zone)
        assert at.strftime("%H:%M") == wanted
        assert timedelta(0) < at.astimezone(UTC) - now() <= timedelta(hours=25)


def test_a_day_and_a_zone_of_its_own() -> None:
    day = (now() + timedelta(days=3)).date().isoformat()
    assert start_time(f"{day} 22:30", "Asia/Tokyo").astimezone(UTC) == datetime.fromisoformat(f"{day}T13:30+00:00")
    assert start_time(f"{day}T22:30+02:00", "Asia/Tokyo").astimezone(UTC).hour == 20


@pytest.mark.parametrize(
    ("text", "zone", "words"),
    [
        ("2020-01-01 22:30", "UTC", "has passed"),
        ("tonight", "UTC", "HH:MM"),
        ("25:00", None, "HH:MM"),
        ((now() + FARTHEST + timedelta(days=2)).strftime("%Y-%m-%d %H:%M"), "UTC", "days ahead"),
        ("22:30", "Europe/Nowhere", "IANA name"),
    ],
)
def test_another_time_is_refused_with_the_way_out(text: str, zone: str | None, words: str) -> None:
    with pytest.raises(Refused, match=words):
        start_time(text, zone)


def test_the_command_takes_times_as_far_ahead_as_the_service() -> None:
    """Two constants: the command imports no campaigns to say no."""
    assert FARTHEST == schedule.FARTHEST
