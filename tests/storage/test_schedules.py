"""Schedules on both databases: on time, missed, overlapping; switched off and on; two processes at once."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from threading import Thread
from typing import Any
from zoneinfo import ZoneInfo

import pytest

from bench_service.campaigns.run import CampaignRun, RunRequest
from bench_service.campaigns.schedule import Missed, Overlap, Schedule, brought_back
from bench_service.campaigns.scheduler import Scheduler, ScheduleRequest
from bench_service.campaigns.stores import Stores
from bench_service.model.errors import IllegalTransition, NotFound, NotMounted
from bench_service.model.job import JobState
from bench_service.wall_clock import now
from procedures.core.errors import BadParameter
from procedures.core.limits import Verdict
from tests.storage.campaigns import campaign, new_run

NIGHTLY = ScheduleRequest("trial", "U-1", "0 1 * * *", "Europe/Kyiv")
DUE = datetime(2031, 7, 1, 22, 0, tzinfo=UTC)  # 01:00 in Kyiv, in summer time
OF = campaign({})


def prepared(request: RunRequest) -> CampaignRun:
    if request.unit == "gone":
        raise NotMounted("bench 'sim' has no unit 'gone'")
    return new_run(OF, unit=request.unit, labels=request.labels)


@pytest.fixture
def scheduler(stores: Stores) -> Scheduler:
    return Scheduler(stores, lambda _: OF, prepared)


def due(stores: Stores, scheduler: Scheduler, **changes: object) -> Schedule:
    """A nightly schedule whose next start is `DUE`."""
    made = scheduler.add(NIGHTLY)
    schedule = replace(made, next_at=DUE, **changes)  # pyright: ignore[reportArgumentType]
    assert stores.campaigns.save_schedule(schedule, made.next_at, None)
    return schedule


def runs(stores: Stores) -> list[CampaignRun]:
    return list(stores.campaigns.runs(limit=100).items)


def test_a_new_schedule_says_when_it_starts(scheduler: Scheduler, stores: Stores) -> None:
    made = scheduler.add(NIGHTLY, key="k")
    assert made.next_at is not None
    assert made.next_at.astimezone(UTC).hour in (22, 23)
    assert scheduler.add(NIGHTLY, key="k") == made == scheduler.get(made.id)
    assert [s.id for s in scheduler.list().items] == [made.id]
    assert stores.campaigns.due_schedules(made.next_at - timedelta(seconds=1)) == ()
    assert [s.id for s in stores.campaigns.due_schedules(made.next_at)] == [made.id]


def test_a_start_on_time(scheduler: Scheduler, stores: Stores) -> None:
    schedule = due(stores, scheduler)
    assert scheduler.fire(schedule, DUE + timedelta(seconds=2))
    (run,) = runs(stores)
    assert (run.schedule_id, run.planned_at, run.state) == (schedule.id, DUE, JobState.QUEUED)
    after = scheduler.get(schedule.id)
    assert (after.next_at, after.last_at) == (DUE + timedelta(days=1), DUE)
    assert (after.last_run, after.last_outcome) == (run.id, "started")


@pytest.mark.parametrize("years", [0, 3])
def test_a_start_at_a_moment_is_the_only_one_however_far_ahead(
    scheduler: Scheduler, stores: Stores, years: int
) -> None:
    """As a cron line without a year it came in the first year, and again where the schedule was switched on again."""
    at = (now() + timedelta(days=366 * years + 2)).astimezone(ZoneInfo("Asia/Tokyo"))
    schedule = scheduler.add(ScheduleRequest("trial", "U-1", at=at))
    assert (schedule.next_at, schedule.at, schedule.cron) == (at.astimezone(UTC), at.astimezone(UTC), None)
    assert stores.campaigns.due_schedules(at - timedelta(seconds=1)) == ()
    assert scheduler.enable(schedule.id, False).next_at is None
    schedule = scheduler.enable(schedule.id, True)
    assert schedule.next_at == at
    assert scheduler.fire(schedule, at + timedelta(seconds=2))
    after = scheduler.get(schedule.id)
    assert (after.enabled, after.next_at, after.last_at, after.last_outcome) == (False, None, at, "started")
    with pytest.raises(IllegalTransition, match="one start alone"):
        scheduler.enable(schedule.id, True)
    assert stores.campaigns.due_schedules(at + timedelta(days=800)) == ()
    assert len(runs(stores)) == 1


def test_a_start_at_a_moment_that_passed_while_it_was_off_is_not_made_up(scheduler: Scheduler, stores: Stores) -> None:
    schedule = scheduler.add(ScheduleRequest("trial", "U-1", at=now() + timedelta(days=1), enabled=False))
    past = replace(schedule, at=now() - timedelta(minutes=1))
    assert stores.campaigns.save_schedule(past, None, None)
    with pytest.raises(IllegalTransition, match="add another schedule"):
        scheduler.enable(schedule.id, True)


@pytest.mark.parametrize("missed", list(Missed))
def test_a_missed_moment_is_made_up_or_left_out_and_the_schedule_is_over(
    scheduler: Scheduler, stores: Stores, missed: Missed
) -> None:
    at = now() + timedelta(days=1)
    schedule = scheduler.add(ScheduleRequest("trial", "U-1", at=at, missed=missed))
    assert scheduler.fire(schedule, at + timedelta(days=400))
    assert [run.planned_at for run in runs(stores)] == ([at] if missed is Missed.RUN_ONCE else [])
    assert (scheduler.get(schedule.id).enabled, scheduler.get(schedule.id).next_at) == (False, None)


@pytest.mark.parametrize(
    ("times", "field"),
    [
        ({}, "cron"),
        ({"time_zone": "UTC"}, "cron"),
        ({"cron": "0 1 * * *"}, "time_zone"),
        ({"cron": "0 1 * * *", "time_zone": "UTC", "at": DUE}, "at"),
        ({"time_zone": "UTC", "at": DUE}, "at"),
        ({"at": datetime(2020, 1, 1, tzinfo=UTC)}, "at"),
        ({"at": datetime(9999, 12, 31, 23, tzinfo=UTC)}, "at"),
    ],
)
def test_times_of_neither_kind_are_refused_by_the_field(
    scheduler: Scheduler, times: dict[str, Any], field: str
) -> None:
    with pytest.raises(BadParameter) as refused:
        scheduler.add(ScheduleRequest("trial", "U-1", **times))
    assert refused.value.field == field


@pytest.mark.parametrize("nights", [0, 3])
@pytest.mark.parametrize("missed", list(Missed))
def test_a_missed_start(scheduler: Scheduler, stores: Stores, missed: Missed, nights: int) -> None:
    schedule = due(stores, scheduler, missed=missed)
    back = DUE + timedelta(days=nights, hours=5)
    assert scheduler.fire(schedule, back)
    planned = [run.planned_at for run in runs(stores)]
    assert planned == ([DUE + timedelta(days=nights)] if missed is Missed.RUN_ONCE else [])
    after = scheduler.get(schedule.id)
    assert after.next_at == DUE + timedelta(days=nights + 1)
    assert "missed by 5:00:0" in after.last_outcome


def test_the_grace_is_inclusive(scheduler: Scheduler, stores: Stores) -> None:
    for late, expected in ((60.0, 1), (60.5, 1)):
        schedule = due(stores, scheduler, missed=Missed.SKIP, start_within_s=60.0)
        assert scheduler.fire(schedule, DUE + timedelta(seconds=late))
        assert len(runs(stores)) == expected


@pytest.mark.parametrize("overlap", list(Overlap))
def test_a_start_while_the_previous_run_is_open(scheduler: Scheduler, stores: Stores, overlap: Overlap) -> None:
    schedule = due(stores, scheduler, overlap=overlap)
    assert scheduler.fire(schedule, DUE)
    assert scheduler.fire(scheduler.get(schedule.id), DUE + timedelta(days=1))
    assert len(runs(stores)) == (2 if overlap is Overlap.QUEUE else 1)
    if overlap is Overlap.SKIP:
        assert runs(stores)[0].id in scheduler.get(schedule.id).last_outcome
    ended = replace(runs(stores)[-1], state=JobState.SUCCEEDED, revision=2)
    assert stores.campaigns.save_run(ended, 1)
    assert scheduler.fire(scheduler.get(schedule.id), DUE + timedelta(days=2))
    assert len(runs(stores)) == (3 if overlap is Overlap.QUEUE else 2)


def test_a_night_that_cannot_begin_is_seen(scheduler: Scheduler, stores: Stores) -> None:
    schedule = due(stores, scheduler, unit="gone")
    assert scheduler.fire(schedule, DUE)
    (run,) = runs(stores)
    assert (run.state, run.verdict, run.schedule_id) == (JobState.FAILED, Verdict.ERROR, schedule.id)
    assert "no unit 'gone'" in run.reason
    assert "no unit 'gone'" in scheduler.get(schedule.id).last_outcome


def test_of_several_processes_one_starts_it(scheduler: Scheduler, stores: Stores) -> None:
    schedule = due(stores, scheduler)
    threads = [Thread(target=scheduler.fire, args=(schedule, DUE)) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(runs(stores)) == 1


def test_off_and_on_again(scheduler: Scheduler, stores: Stores) -> None:
    schedule = due(stores, scheduler)
    off = scheduler.enable(schedule.id, enabled=False)
    assert (off.enabled, off.next_at) == (False, None)
    assert stores.campaigns.due_schedules(DUE + timedelta(days=9)) == ()
    assert not scheduler.fire(schedule, DUE)  # another process read it before
    assert runs(stores) == []
    on = scheduler.enable(schedule.id, enabled=True)
    assert on.next_at is not None
    scheduler.remove(schedule.id)
    with pytest.raises(NotFound):
        scheduler.get(schedule.id)
    assert not scheduler.fire(schedule, DUE)


@pytest.mark.parametrize(
    ("last", "expected"),
    [
        (None, DUE),  # made, or switched on, while the clock was ahead
        (DUE - timedelta(days=1), DUE),
        (DUE + timedelta(days=365), DUE),  # it started a year ahead
        (DUE, None),  # it started two hours ahead of this night: it is not repeated
    ],
)
def test_a_clock_that_was_ahead_and_is_right_again_takes_no_night_away(
    scheduler: Scheduler, stores: Stores, last: datetime | None, expected: datetime | None
) -> None:
    at = DUE - timedelta(hours=2)
    late = DUE + timedelta(days=1) if last == DUE else DUE + timedelta(days=366)
    schedule = due(stores, scheduler, last_at=last)
    assert stores.campaigns.save_schedule(replace(schedule, next_at=late), DUE, None)
    found = brought_back(scheduler.get(schedule.id), at)
    assert found == expected


def test_a_start_that_is_brought_back_says_why_and_a_right_one_stays(scheduler: Scheduler, stores: Stores) -> None:
    right = scheduler.add(NIGHTLY)
    assert right.next_at is not None
    wrong = scheduler.add(NIGHTLY)
    ahead = right.next_at + timedelta(days=366)
    assert stores.campaigns.save_schedule(replace(wrong, next_at=ahead), wrong.next_at, None)
    scheduler.fire_due()
    assert scheduler.get(right.id) == right
    found = scheduler.get(wrong.id)
    assert found.next_at == right.next_at
    assert found.last_outcome.startswith("the clock was ahead: the next start was ")
    assert runs(stores) == []


def test_a_clock_put_right_by_minutes_repeats_no_start() -> None:
    every_minute = Schedule("id", "trial", "U-1", DUE, "* * * * *", "UTC")
    shortly = replace(every_minute, last_at=DUE + timedelta(minutes=10), next_at=DUE + timedelta(minutes=11))
    assert brought_back(shortly, DUE) is None
    far = replace(every_minute, last_at=DUE + timedelta(days=1), next_at=DUE + timedelta(days=1, minutes=1))
    assert brought_back(far, DUE) == DUE + timedelta(minutes=1)
    assert brought_back(replace(every_minute, last_at=DUE, next_at=DUE + timedelta(minutes=1)), DUE) is None
