"""PORT of memory for campaigns, their runs and schedules; as in `bench_service.jobs.stores` each method is one
transaction.
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
    """The stored campaigns, runs and schedules."""

    def add(self, campaign: Campaign, at: datetime, idempotency: Idempotency | None = None, team: str = "") -> Campaign:
        """Store a new campaign, for the members of a team to change. Raises `NameTaken`, `IdempotencyConflict`."""
        ...

    def replace(self, campaign: Campaign, at: datetime) -> None:
        """Change a stored campaign; runs keep the version that they began with. Raises `NotFound`."""
        ...

    def get(self, name: str) -> Campaign:
        """Return one campaign by its name. Raises `NotFound`."""
        ...

    def team_of(self, name: str) -> str:
        """The team whose members change a campaign; empty: every engineer. Raises `NotFound`."""
        ...

    def list(self, after: str | None = None, limit: int = 50) -> tuple[Campaign, ...]:
        """List campaigns by name, beginning after a given name."""
        ...

    def add_run(self, run: CampaignRun, idempotency: Idempotency | None = None) -> CampaignRun:
        """Store a new run; where the key is known, give the run that it made. Raises `IdempotencyConflict`."""
        ...

    def run(self, run_id: str) -> CampaignRun:
        """Return one campaign run. Raises `NotFound`."""
        ...

    def save_run(self, run: CampaignRun, revision: int) -> bool:
        """Replace a run, unless it was changed since that revision was read; True where it was replaced."""
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
        """Number of runs by campaign, state and verdict ("" for no verdict)."""
        ...

    def open_runs(self) -> tuple[CampaignRun, ...]:
        """Runs that have not ended, oldest first."""
        ...

    def open_run_of(self, schedule_id: str) -> str | None:
        """Id of the oldest open run that a schedule started."""
        ...

    def add_schedule(self, schedule: Schedule, idempotency: Idempotency | None = None) -> Schedule:
        """Add a campaign's schedule. Raises `IdempotencyConflict`."""
        ...

    def schedule(self, schedule_id: str) -> Schedule:
        """Return one schedule by its id. Raises `NotFound`."""
        ...

    def schedules(self, after: str | None = None, limit: int = 50) -> Page[Schedule]: ...

    def due_schedules(self, at: datetime) -> tuple[Schedule, ...]:
        """Enabled schedules whose next start is not after `at`."""
        ...

    def waiting_schedules(self, at: datetime) -> tuple[Schedule, ...]:
        """Enabled schedules whose next start is after `at`."""
        ...

    def save_schedule(self, schedule: Schedule, expected_next_at: datetime | None, run: CampaignRun | None) -> bool:
        """Replace a schedule and add the run that it starts, in one transaction.

        False, and nothing changed, where its next start is not the expected one, or it is gone: another process was
        faster.
        """
        ...

    def remove_schedule(self, schedule_id: str) -> None:
        """Remove a schedule by its id; its runs stay. Raises `NotFound`."""
        ...


@dataclass(frozen=True)
class Stores(JobStores):
    """All stores of one service."""

    campaigns: CampaignStore
