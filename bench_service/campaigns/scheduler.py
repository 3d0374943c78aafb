"""Schedules: the verbs for clients, and the starts that are due.

At most one run starts however many starts were due, for the latest of them. It is on time until `start_within_s` after
it was planned; later than that it was missed, and the schedule's rule decides if one run makes up for it. While the
schedule's previous run is open, its rule decides if the new one waits or is left out. The next start moves on in the
transaction that stores the run, so of several processes one starts it. A clock that is set back repeats no start:
a start that was handled is in the schedule's past. A clock that was far ahead, and is right again, has moved the next
start with it: that is seen within a minute, and the start brought back (`schedule.brought_back`).
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from math import inf

from bench_service.campaigns import transitions
from bench_service.campaigns.campaign import Campaign
from bench_service.campaigns.run import CampaignRun, RunRequest
from bench_service.campaigns.schedule import (
    Missed,
    Overlap,
    Schedule,
    brought_back,
    first_start,
    latest_due,
    start_after,
)
from bench_service.campaigns.stores import Stores
from bench_service.mapping import copied
from bench_service.model.errors import (
    IdempotencyConflict,
    IllegalTransition,
    NotFound,
    ServiceError,
    StorageFailure,
    StorageFull,
)
from bench_service.model.records import Idempotency, Page
from bench_service.wall_clock import monotonic_s, new_id, now
from procedures.core.errors import DomainError

LOOK_S = 60.0
"""Interval between two looks at the starts that are to come [s]."""
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ScheduleRequest:
    """A client's request for a schedule: cron expression and time zone, or one moment; campaign, unit, bench, rules for
    missed starts.
    """

    campaign: str
    unit: str
    cron: str | None = None
    time_zone: str | None = None
    at: datetime | None = None
    bench: str | None = None
    missed: Missed = Missed.RUN_ONCE
    start_within_s: float = 300.0
    overlap: Overlap = Overlap.SKIP
    enabled: bool = True
    labels: dict[str, str] = field(default_factory=dict[str, str])


class Scheduler:
    """Operations of clients on schedules, and the start of due ones, which the conductor calls. `prepared` makes a run
    of a request, examined but not stored.
    """

    def __init__(
        self,
        stores: Stores,
        campaign_of: Callable[[str], Campaign],
        prepared: Callable[[RunRequest], CampaignRun],
    ) -> None:
        self._stores = stores
        self._campaign_of = campaign_of
        self._prepared = prepared
        self._looked_s = -inf

    def add(self, request: ScheduleRequest, key: str | None = None, team: str = "") -> Schedule:
        """Store a campaign's schedule and return it; its runs belong to `team`. Raises `BadParameter` for a time that
        never comes, and its run's refusals.

        A key of a schedule that was removed since is used up: `IdempotencyConflict`.
        """
        idempotency = Idempotency.of("schedules", key, request)
        known = self._stores.keys.made(idempotency, "schedule")
        if known is not None:
            return self._kept(known)
        at = now()
        next_at = first_start(request, at)
        run = self._prepared(copied(RunRequest, request))
        schedule = copied(
            Schedule,
            request,
            id=new_id(),
            created_at=at,
            at=None if request.at is None else next_at,
            bench=run.bench,
            next_at=next_at if request.enabled else None,
            team=team,
        )
        return self._stores.campaigns.add_schedule(schedule, idempotency)

    def _kept(self, schedule_id: str) -> Schedule:
        try:
            return self.get(schedule_id)
        except NotFound as error:
            raise IdempotencyConflict(
                f"the idempotency key belongs to schedule {schedule_id}, which has been removed"
            ) from error

    def enable(self, schedule_id: str, enabled: bool) -> Schedule:
        """Switch a schedule on or off and return it; starts that passed while it was off are not made up. Raises
        `NotFound`; and `IllegalTransition` for switching on one whose only start was, or has passed.
        """
        campaigns = self._stores.campaigns
        while True:
            schedule = campaigns.schedule(schedule_id)
            if schedule.enabled == enabled:
                return schedule
            next_at = start_after(schedule, now()) if enabled else None
            if enabled and (next_at is None or (schedule.at is not None and schedule.last_at is not None)):
                raise IllegalTransition(
                    f"schedule {schedule_id} has one start alone, {schedule.at}, and that is over: add another schedule"
                )
            changed = replace(schedule, enabled=enabled, next_at=next_at)
            if campaigns.save_schedule(changed, schedule.next_at, None):
                return changed

    def get(self, schedule_id: str) -> Schedule:
        """Return one schedule by its id. Raises `NotFound`."""
        return self._stores.campaigns.schedule(schedule_id)

    def list(self, after: str | None = None, limit: int = 50) -> Page[Schedule]:
        """Return one page of schedules, newest first."""
        return self._stores.campaigns.schedules(after, limit)

    def remove(self, schedule_id: str) -> None:
        """Remove a schedule by its id; its runs stay. Raises `NotFound`."""
        self._stores.campaigns.remove_schedule(schedule_id)

    def fire_due(self) -> None:
        """Start a run for each due schedule. One that cannot be read does not keep the others from starting."""
        at = now()
        self._after_a_clock_that_was_ahead(at)
        for schedule in self._stores.campaigns.due_schedules(at):
            try:
                self.fire(schedule, at)
            except DomainError as error:
                log.error("schedule %s cannot be kept: %s", schedule.id, error)

    def _after_a_clock_that_was_ahead(self, at: datetime) -> None:
        """Bring back the next starts that a clock far ahead has moved into the future; looked at once a minute."""
        if monotonic_s() < self._looked_s + LOOK_S:
            return
        self._looked_s = monotonic_s()
        for schedule in self._stores.campaigns.waiting_schedules(at):
            try:
                earlier = brought_back(schedule, at)
            except DomainError:  # it cannot be read: said when it is due
                continue
            if earlier is None or schedule.next_at is None:
                continue
            why = (
                f"the clock was ahead: the next start was {schedule.next_at.isoformat()}, and is {earlier.isoformat()}"
            )
            log.warning("schedule %s: %s", schedule.id, why)
            changed = replace(schedule, next_at=earlier, last_outcome=f"{schedule.last_outcome}; {why}".lstrip("; "))
            self._stores.campaigns.save_schedule(changed, schedule.next_at, None)

    def fire(self, schedule: Schedule, at: datetime) -> bool:
        """Apply a due schedule's rules: start a run, or record why not. Return False where another process was faster.
        Raises `StorageFailure`.
        """
        planned = latest_due(schedule, at)
        run, outcome = self._started(schedule, planned, at)
        changed = replace(
            schedule,
            enabled=schedule.at is None,
            next_at=None if schedule.at is not None else start_after(schedule, at),
            last_at=planned,
            last_run=schedule.last_run if run is None else run.id,
            last_outcome=outcome,
        )
        log.info("schedule %s, planned for %s: %s", schedule.id, planned.isoformat(), outcome)
        return self._stores.campaigns.save_schedule(changed, schedule.next_at, run)

    def _started(self, schedule: Schedule, planned: datetime, at: datetime) -> tuple[CampaignRun | None, str]:
        """The run that begins, if any, and the outcome of the start as text."""
        missed = at - planned > timedelta(seconds=schedule.start_within_s)
        late = f"missed by {at - planned}" if missed else ""
        if missed and schedule.missed is Missed.SKIP:
            return None, f"skipped: {late}"
        open_run = self._stores.campaigns.open_run_of(schedule.id)
        if open_run is not None and schedule.overlap is Overlap.SKIP:
            return None, f"skipped: its run {open_run} is still open"
        request = copied(RunRequest, schedule)
        try:
            run = self._prepared(request)
        except (StorageFailure, StorageFull):
            raise
        except (DomainError, ServiceError) as error:
            campaign = self._campaign_of(schedule.campaign)
            run = transitions.not_begun(new_id(), request, campaign, schedule.bench or "", str(error), at)
        outcome = f"could not begin: {run.reason}" if not run.open else "made up: " + late if missed else "started"
        return replace(run, schedule_id=schedule.id, planned_at=planned, team=schedule.team), outcome
