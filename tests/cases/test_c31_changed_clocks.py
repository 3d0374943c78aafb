"""Nightly starts where clocks change: one start for each local date that exists, against the tables of IANA."""

from dataclasses import replace
from datetime import UTC, date, datetime, time, timedelta
from itertools import takewhile
from pathlib import Path
from zoneinfo import ZoneInfo

import numpy as np
import pytest

from bench_service.campaigns.schedule import next_start, starts_after
from bench_service.campaigns.scheduler import Scheduler, ScheduleRequest
from bench_service.model.job import JobState
from bench_service.persistence import open_stores
from tests.storage.campaigns import campaign, new_run

CHANGES = (  # zone, first local day, days, what the walk passes
    ("Europe/Kyiv", date(2027, 3, 26), 4),  # 03:00 … 04:00 left out
    ("Europe/Kyiv", date(2026, 10, 23), 4),  # 03:00 … 04:00 twice
    ("America/Santiago", date(2026, 9, 4), 4),  # midnight left out
    ("Australia/Lord_Howe", date(2026, 10, 2), 4),  # half an hour left out
    ("Australia/Lord_Howe", date(2027, 4, 2), 4),  # half an hour twice
    ("Pacific/Apia", date(2011, 12, 28), 5),  # the whole of 30 December left out
    ("America/St_Johns", date(2006, 10, 27), 4),  # one minute past midnight
)


def expected(zone: ZoneInfo, day: date, at: time) -> datetime | None:
    """The first minute of a local day's clock that shows `at` or more; None of a day that has no minute at all."""
    moment = datetime.combine(day, time(), tzinfo=UTC) - timedelta(hours=15)
    last_before = datetime.combine(day, at)
    for _ in range(60 * 54):
        shown = moment.astimezone(zone).replace(tzinfo=None)
        if shown.date() == day and shown >= last_before:
            return moment
        moment += timedelta(minutes=1)
    return None


@pytest.mark.parametrize(("zone", "first", "days"), CHANGES)
def test_every_local_day_that_exists_has_one_start(zone: str, first: date, days: int) -> None:
    rng, local = np.random.default_rng(31), ZoneInfo(zone)
    nights = [first + timedelta(days=k) for k in range(days)]
    for _ in range(3):
        at = time(int(rng.integers(0, 5)), int(rng.integers(0, 60)))
        wanted = [t for t in (expected(local, night, at) for night in nights) if t is not None]
        begin = wanted[0] - timedelta(seconds=1)
        assert (
            list(
                takewhile(lambda t, end=wanted[-1]: t <= end, starts_after(f"{at.minute} {at.hour} * * *", zone, begin))
            )
            == wanted
        )


@pytest.mark.parametrize(("zone", "first", "days"), CHANGES)
@pytest.mark.parametrize("cron", ["30 3 * * *", "15 2 * * *", "0 0 * * *", "0 * * * *", "*/20 3 * * *"])
def test_a_next_start_is_never_past(zone: str, first: date, days: int, cron: str) -> None:
    moment = datetime.combine(first, time(), tzinfo=UTC)
    for _ in range(days * 24 * 60 // 37):
        assert next_start(cron, zone, moment) > moment
        moment += timedelta(minutes=37)


def test_a_service_that_comes_back_in_the_second_of_two_equal_hours_starts_once(tmp_path: Path) -> None:
    stores, database = open_stores(f"sqlite:///{tmp_path}/b.sqlite")
    of = campaign({})
    scheduler = Scheduler(stores, lambda _: of, lambda request: new_run(of, unit=request.unit))
    made = scheduler.add(ScheduleRequest("trial", "U-1", "30 3 * * *", "Europe/Kyiv"))
    first = datetime(2026, 10, 25, 0, 30, tzinfo=UTC)
    assert stores.campaigns.save_schedule(replace(made, next_at=first), made.next_at, None)
    for minutes in range(35, 75, 5):  # the second 03:05 … 03:40
        at = first + timedelta(minutes=minutes)
        for due in stores.campaigns.due_schedules(at):
            scheduler.fire(due, at)
        for run in stores.campaigns.runs(limit=100).items:
            if run.open:
                ended = replace(run, state=JobState.SUCCEEDED, revision=run.revision + 1)
                stores.campaigns.save_run(ended, run.revision)
    runs = stores.campaigns.runs(limit=100).items
    next_at = scheduler.get(made.id).next_at
    database.dispose()
    assert [run.planned_at for run in runs] == [first]
    assert next_at == datetime(2026, 10, 26, 1, 30, tzinfo=UTC)


@pytest.mark.parametrize("minutes", ["*/30", "0,30"])
def test_minutes_that_repeat_within_an_hour_follow_the_wall_clock_too(minutes: str) -> None:
    """Kyiv leaves out 03:00 to 04:00 on 29 March 2026 and has it twice on 25 October: one night, one series."""
    zone = ZoneInfo("Europe/Kyiv")
    spring = starts_after(f"{minutes} 3 * * *", zone.key, datetime(2026, 3, 28, 12, tzinfo=UTC))
    made_up, after = (next(spring).astimezone(zone) for _ in range(2))
    assert (made_up.date(), made_up.hour, made_up.minute) == (date(2026, 3, 29), 4, 0)
    assert (after.date(), after.hour, after.minute) == (date(2026, 3, 30), 3, 0)
    autumn = starts_after(f"{minutes} 3 * * *", zone.key, datetime(2026, 10, 24, 12, tzinfo=UTC))
    nights = [next(autumn).astimezone(zone) for _ in range(3)]
    assert [(n.day, n.hour, n.minute, n.fold) for n in nights] == [(25, 3, 0, 0), (25, 3, 30, 0), (26, 3, 0, 0)]
