"""Interface of the store of campaigns, their runs and schedules; each method is one transaction, as in
`bench_service.jobs.stores`.
"""

from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

from bench_service.campaigns.campaign import Campaign
from bench_service.campaigns.run import CampaignRun
from bench_service.campaigns.schedule import Schedule
from bench_service.jobs.stores import JobStores
from bench_service.model.job import JobState
from bench_service.model.records import Idempotency, Page


class CampaignStore(Protocol):
    """Store of campaigns, their runs and schedules. Interface; the SQL is in `persistence`."""

    def add(self, campaign: Campaign, at: datetime, idempotency: Idempotency | None = None, team: str = "") -> Campaign:
        """Store a new campaign, which the members of a team may change, and return it. Raises `NameTaken`,
        `IdempotencyConflict`.
        """
        ...

    def replace(self, campaign: Campaign, at: datetime) -> None:
        """Replace a stored campaign; runs keep the version that they began with. Raises `NotFound`."""
        ...

    def get(self, name: str) -> Campaign:
        """Return one campaign by its name. Raises `NotFound`."""
        ...

    def team_of(self, name: str) -> str:
        """Return the team whose members change a campaign; empty: every engineer. Raises `NotFound`."""
        ...

    def list(self, after: str | None = None, limit: int = 50) -> tuple[Campaign, ...]:
        """Return at most `limit` stored campaigns in order of their names, beginning after a given name."""
        ...

    def add_run(self, run: CampaignRun, idempotency: Idempotency | None = None) -> CampaignRun:
        """Store a new run and return it; where the key is known, return the run that it made. Raises
        `IdempotencyConflict`.
        """
        ...

    def run(self, run_id: str) -> CampaignRun:
        """Return one campaign run by its id. Raises `NotFound`."""
        ...

    def save_run(self, run: CampaignRun, revision: int) -> bool:
        """Replace a run, unless it was changed since that revision was read; return True where it was replaced."""
        ...

    def runs(
        self,
        *,
        campaign: str | None = None,
        unit: str | None = None,
        state: JobState | None = None,
        after: str | None = None,
        limit: int = 50,
    ) -> Page[CampaignRun]: ...

    def counts(self) -> dict[tuple[str, str, str], int]:
        """Return the number of runs by campaign, state and verdict ("" for no verdict)."""
        ...

    def open_runs(self) -> tuple[CampaignRun, ...]:
        """Return all runs that have not ended, oldest first."""
        ...

    def open_run_of(self, schedule_id: str) -> str | None:
        """Return the id of the oldest open run that a schedule started; None where there is none."""
        ...

    def add_schedule(self, schedule: Schedule, idempotency: Idempotency | None = None) -> Schedule:
        """Store a campaign's schedule and return it; where the key is known, the one that it made. Raises
        `IdempotencyConflict`.
        """
        ...

    def schedule(self, schedule_id: str) -> Schedule:
        """Return one schedule by its id. Raises `NotFound`."""
        ...

    def schedules(self, after: str | None = None, limit: int = 50) -> Page[Schedule]: ...

    def due_schedules(self, at: datetime) -> tuple[Schedule, ...]:
        """Return the enabled schedules whose next start is not after `at`."""
        ...

    def waiting_schedules(self, at: datetime) -> tuple[Schedule, ...]:
        """Return the enabled schedules whose next start is after `at`."""
        ...

    def save_schedule(self, schedule: Schedule, expected_next_at: datetime | None, run: CampaignRun | None) -> bool:
        """Replace a schedule and store the run that it starts, in one transaction; return True.

        False, and nothing changed, where its next start is not the expected one, or it is gone: another process was
        faster.
        """
        ...

    def remove_schedule(self, schedule_id: str) -> None:
        """Remove a schedule by its id; its runs stay. Raises `NotFound`."""
        ...


@dataclass(frozen=True)
class Stores(JobStores):
    """All stores of one service as one value; `persistence/stores.py` builds it."""

    campaigns: CampaignStore
