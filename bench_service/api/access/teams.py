"""Dependencies of routes that act on what a team has reserved or started: members of the team may, and admins."""

from fastapi import Depends

from bench_service.access.service import require_team
from bench_service.api.http.dependencies import Me, Service
from bench_service.model.errors import NotUnderstood


def _of_job(job_id: str, service: Service, me: Me) -> None:
    if me.in_every_team:  # what is reserved need not be read
        return
    try:
        job = service.stores.jobs.get(job_id)
    except NotUnderstood:  # stored by another version: the route itself says so, or cancels it
        return
    require_team(me, job.team or service.queues.team_of(job.reservation), f"job {job_id}")


def _of_reservation(reservation_id: str, service: Service, me: Me) -> None:
    require_team(me, service.queues.team_of(reservation_id), f"reservation {reservation_id}")


def _of_bench(bench_id: str, service: Service, me: Me) -> None:
    if not me.in_every_team:
        require_team(me, service.queues.team_of_bench(bench_id), f"bench {bench_id}")


def _of_lease(bench_id: str, lease_id: str, service: Service, me: Me) -> None:
    if not me.in_every_team:
        lease = service.manual.lease(bench_id, lease_id)
        require_team(me, service.queues.team_of(lease.reservation), f"manual lease {lease_id}")


def _of_campaign(name: str, service: Service, me: Me) -> None:
    require_team(me, service.campaigns.team_of(name), f"campaign {name}")


def _of_run(run_id: str, service: Service, me: Me) -> None:
    require_team(me, service.stores.campaigns.run(run_id).team, f"campaign run {run_id}")


def _of_schedule(schedule_id: str, service: Service, me: Me) -> None:
    require_team(me, service.campaigns.schedules.get(schedule_id).team, f"schedule {schedule_id}")


TeamOfJob = Depends(_of_job)
"""Refuses a job whose reservation, or whose campaign run, is another team's."""
TeamOfReservation = Depends(_of_reservation)
"""Refuses another team's reservation."""
TeamOfBench = Depends(_of_bench)
"""Refuses a bench that another team has reserved."""
TeamOfLease = Depends(_of_lease)
"""Refuses a lease of manual mode whose reservation is another team's; reservations made later change nothing."""
TeamOfCampaign = Depends(_of_campaign)
"""Refuses to change another team's campaign."""
TeamOfRun = Depends(_of_run)
"""Refuses another team's campaign run."""
TeamOfSchedule = Depends(_of_schedule)
"""Refuses another team's schedule."""
