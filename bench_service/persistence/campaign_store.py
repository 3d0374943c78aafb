"""Campaigns, their runs and schedules in SQL. A run or a schedule is a document; further columns serve searches.

A change is given with the version that was read; the row is locked while that is compared (`FOR UPDATE`; on SQLite the
writing transaction itself), so of two processes one wins and the other reads again.
"""

from datetime import datetime

from pydantic import TypeAdapter
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from bench_service.campaigns.campaign import Campaign
from bench_service.campaigns.run import CampaignRun
from bench_service.campaigns.schedule import Schedule
from bench_service.mapping import copied
from bench_service.model.errors import NameTaken, NotFound
from bench_service.model.job import FINAL, JobState
from bench_service.model.records import Idempotency, Page
from bench_service.persistence.database import Database
from bench_service.persistence.idempotency import again_after_conflict, made_before, remember
from bench_service.persistence.paging import page
from bench_service.persistence.tables.campaigns import CampaignRow, CampaignRunRow, ScheduleRow

RUN = TypeAdapter(CampaignRun)
SCHEDULE = TypeAdapter(Schedule)
OPEN = tuple(state.value for state in JobState if state not in FINAL)


class SqlCampaignStore:
    """SQL implementation of `bench_service.campaigns.stores.CampaignStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def add(self, campaign: Campaign, at: datetime, idempotency: Idempotency | None = None, team: str = "") -> Campaign:
        def once() -> Campaign:
            with self._database.write() as session:
                if made_before(session, idempotency, "campaign") is not None:
                    return _campaign(_campaign_row(session, campaign.name))
                if session.get(CampaignRow, campaign.name) is not None:
                    raise NameTaken(f"there is a campaign {campaign.name!r} already: choose another name, or change it")
                remember(session, idempotency, "campaign", campaign.name, at)
                document = campaign.model_dump(mode="json")
                moments = {"created_at": at, "updated_at": at}
                session.add(CampaignRow(name=campaign.name, team=team, document=document, **moments))
                return campaign

        return again_after_conflict(once)

    def replace(self, campaign: Campaign, at: datetime) -> None:
        with self._database.write() as session:
            row = _campaign_row(session, campaign.name)
            row.document = campaign.model_dump(mode="json")
            row.updated_at = at

    def get(self, name: str) -> Campaign:
        with self._database.read() as session:
            return _campaign(_campaign_row(session, name))

    def team_of(self, name: str) -> str:
        with self._database.read() as session:
            return _campaign_row(session, name).team

    def list(self, after: str | None = None, limit: int = 50) -> tuple[Campaign, ...]:
        query = select(CampaignRow).order_by(CampaignRow.name).limit(limit)
        if after is not None:
            query = query.where(CampaignRow.name > after)
        with self._database.read() as session:
            return tuple(_campaign(row) for row in session.scalars(query))

    def add_run(self, run: CampaignRun, idempotency: Idempotency | None = None) -> CampaignRun:
        def once() -> CampaignRun:
            with self._database.write() as session:
                known = made_before(session, idempotency, "campaign_run")
                if known is not None:
                    return _run(_run_row(session, known))
                remember(session, idempotency, "campaign_run", run.id, run.created_at)
                session.add(_row_of_run(run))
                return run

        return again_after_conflict(once)

    def run(self, run_id: str) -> CampaignRun:
        with self._database.read() as session:
            return _run(_run_row(session, run_id))

    def save_run(self, run: CampaignRun, revision: int) -> bool:
        with self._database.write() as session:
            row = _run_row(session, run.id, lock=True)
            if row.document["revision"] != revision:
                return False
            row.state = run.state.value
            row.verdict = None if run.verdict is None else run.verdict.value
            row.finished_at = run.finished_at
            row.document = RUN.dump_python(run, mode="json")
            return True

    def runs(
        self,
        *,
        campaign: str | None = None,
        unit: str | None = None,
        state: JobState | None = None,
        after: str | None = None,
        limit: int = 50,
    ) -> Page[CampaignRun]:
        query = select(CampaignRunRow)
        if campaign is not None:
            query = query.where(CampaignRunRow.campaign == campaign)
        if unit is not None:
            query = query.where(CampaignRunRow.unit == unit)
        if state is not None:
            query = query.where(CampaignRunRow.state == state.value)
        with self._database.read() as session:
            return page(session, query, CampaignRunRow.id, after, limit, _run)

    def counts(self) -> dict[tuple[str, str, str], int]:
        row = CampaignRunRow
        key = (row.campaign, row.state, func.coalesce(row.verdict, ""))
        with self._database.read() as session:
            found = session.execute(select(*key, func.count()).group_by(*key))
            return {(campaign, state, verdict): number for campaign, state, verdict, number in found}

    def open_runs(self) -> tuple[CampaignRun, ...]:
        query = select(CampaignRunRow).where(CampaignRunRow.state.in_(OPEN)).order_by(CampaignRunRow.id)
        with self._database.read() as session:
            return tuple(_run(row) for row in session.scalars(query))

    def open_run_of(self, schedule_id: str) -> str | None:
        query = select(CampaignRunRow.id).where(
            CampaignRunRow.state.in_(OPEN), CampaignRunRow.schedule_id == schedule_id
        )
        with self._database.read() as session:
            return session.scalar(query.order_by(CampaignRunRow.id).limit(1))

    def add_schedule(self, schedule: Schedule, idempotency: Idempotency | None = None) -> Schedule:
        def once() -> Schedule:
            with self._database.write() as session:
                known = made_before(session, idempotency, "schedule")
                if known is not None:
                    return _schedule(_schedule_row(session, known))
                remember(session, idempotency, "schedule", schedule.id, schedule.created_at)
                session.add(_row_of_schedule(schedule))
                return schedule

        return again_after_conflict(once)

    def schedule(self, schedule_id: str) -> Schedule:
        with self._database.read() as session:
            return _schedule(_schedule_row(session, schedule_id))

    def schedules(self, after: str | None = None, limit: int = 50) -> Page[Schedule]:
        with self._database.read() as session:
            return page(session, select(ScheduleRow), ScheduleRow.id, after, limit, _schedule)

    def due_schedules(self, at: datetime) -> tuple[Schedule, ...]:
        query = select(ScheduleRow).where(ScheduleRow.enabled, ScheduleRow.next_at <= at).order_by(ScheduleRow.id)
        with self._database.read() as session:
            return tuple(_schedule(row) for row in session.scalars(query))

    def waiting_schedules(self, at: datetime) -> tuple[Schedule, ...]:
        query = select(ScheduleRow).where(ScheduleRow.enabled, ScheduleRow.next_at > at).order_by(ScheduleRow.id)
        with self._database.read() as session:
            return tuple(_schedule(row) for row in session.scalars(query))

    def save_schedule(self, schedule: Schedule, expected_next_at: datetime | None, run: CampaignRun | None) -> bool:
        with self._database.write() as session:
            row = session.get(ScheduleRow, schedule.id, with_for_update=True)
            if row is None or row.next_at != expected_next_at:
                return False
            row.enabled = schedule.enabled
            row.next_at = schedule.next_at
            row.last_at = schedule.last_at
            row.document = SCHEDULE.dump_python(schedule, mode="json")
            if run is not None:
                session.add(_row_of_run(run))
            return True

    def remove_schedule(self, schedule_id: str) -> None:
        with self._database.write() as session:
            session.delete(_schedule_row(session, schedule_id))


def _campaign_row(session: Session, name: str) -> CampaignRow:
    row = session.get(CampaignRow, name)
    if row is None:
        raise NotFound("campaign", name)
    return row


def _campaign(row: CampaignRow) -> Campaign:
    return Campaign.model_validate(row.document)


def _run_row(session: Session, run_id: str, *, lock: bool = False) -> CampaignRunRow:
    row = session.get(CampaignRunRow, run_id, with_for_update=lock)
    if row is None:
        raise NotFound("campaign run", run_id)
    return row


def _run(row: CampaignRunRow) -> CampaignRun:
    return RUN.validate_python(row.document)


def _row_of_run(run: CampaignRun) -> CampaignRunRow:
    return copied(
        CampaignRunRow,
        run,
        campaign=run.campaign.name,
        state=run.state.value,
        verdict=None if run.verdict is None else run.verdict.value,
        document=RUN.dump_python(run, mode="json"),
    )


def _schedule_row(session: Session, schedule_id: str) -> ScheduleRow:
    row = session.get(ScheduleRow, schedule_id)
    if row is None:
        raise NotFound("schedule", schedule_id)
    return row


def _schedule(row: ScheduleRow) -> Schedule:
    return SCHEDULE.validate_python(row.document)


def _row_of_schedule(schedule: Schedule) -> ScheduleRow:
    return copied(ScheduleRow, schedule, document=SCHEDULE.dump_python(schedule, mode="json"))
