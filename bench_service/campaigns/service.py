"""Campaigns, runs, schedules and trends for clients. Every verb is complete when it returns."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from random import SystemRandom
from typing import Any

from bench_service.campaigns.campaign import Campaign
from bench_service.campaigns.conductor import Conductor, Submit
from bench_service.campaigns.examination import Examination, Examiner, step_field
from bench_service.campaigns.faults import require_sources
from bench_service.campaigns.run import CampaignRun, RunRequest, StepRun, StepState
from bench_service.campaigns.scheduler import Scheduler
from bench_service.campaigns.shipped import shipped
from bench_service.campaigns.stores import Stores
from bench_service.evidence.analyses import AnalysisService
from bench_service.evidence.trend import Trend, trend_of
from bench_service.jobs.planning import Planner
from bench_service.model.errors import IllegalTransition, NameTaken, NotFound
from bench_service.model.job import Job, JobState
from bench_service.model.quantities import quantity
from bench_service.model.records import Idempotency, Page
from bench_service.wall_clock import new_id, now
from procedures.core.errors import BadParameter

SEEDS = SystemRandom()


class CampaignService:
    """Operations of clients on campaigns, their runs, schedules and trends."""

    def __init__(
        self,
        stores: Stores,
        planner: Planner,
        analyses: AnalysisService,
        submit: Submit,
        cancel: Callable[[str], Job],
    ) -> None:
        self._stores = stores
        self._planner = planner
        self._analyses = analyses
        self.schedules = Scheduler(stores, self.campaign, self.prepared)
        self.conductor = Conductor(stores, submit, cancel, analyses, self.schedules.fire_due)

    @cached_property
    def _examiner(self) -> Examiner:
        return Examiner(self._planner)

    def campaign(self, name: str) -> Campaign:
        """Return a stored or a shipped campaign by its name. Raises `NotFound`."""
        return shipped()[name] if name in shipped() else self._stores.campaigns.get(name)

    def campaigns(self, after: str | None = None, limit: int = 50) -> Page[Campaign]:
        """Return one page of stored and shipped campaigns, in order of their names."""
        found = {c.name: c for c in self._stores.campaigns.list(after, limit + 1)}
        found |= {name: c for name, c in shipped().items() if after is None or name > after}
        names = sorted(found)
        shown = tuple(found[name] for name in names[:limit])
        return Page(shown, shown[-1].name if len(names) > limit else None)

    def add(self, campaign: Campaign, key: str | None = None, team: str = "") -> Campaign:
        """Examine a campaign, store it for a team, and return it. Raises `NameTaken`, and the errors of `examine`."""
        idempotency = Idempotency.of("campaigns", key, campaign.model_dump())
        if self._stores.keys.made(idempotency, "campaign") is not None:
            return self._stores.campaigns.get(campaign.name)
        if campaign.name in shipped():
            raise NameTaken(f"campaign {campaign.name!r} comes with the service: choose another name")
        require_sources(campaign)
        self.examine(campaign)
        return self._stores.campaigns.add(campaign, now(), idempotency, team)

    def team_of(self, name: str) -> str:
        """Return the team whose members change a campaign; empty: every engineer. Raises `NotFound`."""
        return "" if name in shipped() else self._stores.campaigns.team_of(name)

    def replace(self, campaign: Campaign) -> Campaign:
        """Examine and replace a stored campaign, and return it; runs that have begun keep theirs. Raises `NotFound`,
        `NameTaken` for a shipped one.
        """
        if campaign.name in shipped():
            raise NameTaken(f"campaign {campaign.name!r} comes with the service and cannot be changed")
        self._stores.campaigns.get(campaign.name)
        require_sources(campaign)
        self.examine(campaign)
        self._stores.campaigns.replace(campaign, now())
        return campaign

    def examine(self, campaign: Campaign, unit: str | None = None, bench: str | None = None) -> Examination:
        """Return the plan of a campaign on a unit and bench; see `Examiner.examine`.

        `unit` None: the first that the bench can test. `bench` None: that of jobs which name none.
        """
        if unit is not None:
            return self._examiner.examine(campaign, unit, bench, strict=True)
        at = self._planner.benches.one() if bench is None else bench
        first = self._planner.benches.mounted(at)[0].serial
        return self._examiner.examine(campaign, first, at, strict=False)

    def start(self, request: RunRequest, key: str | None = None, team: str = "") -> CampaignRun:
        """Store a campaign run of a team, which the conductor begins, and return it. Raises `NotFound`, `NotMounted`,
        `BadParameter`, `IdempotencyConflict`.
        """
        idempotency = Idempotency.of("campaign_runs", key, request)
        known = self._stores.keys.made(idempotency, "campaign_run")
        if known is not None:
            return self._stores.campaigns.run(known)
        stored = self._stores.campaigns.add_run(replace(self.prepared(request), team=team), idempotency)
        self.conductor.nudge()
        return stored

    def prepared(self, request: RunRequest) -> CampaignRun:
        """Return a new run, not stored yet: the campaign with the request's parameters, examined on its unit and bench.
        Raises `BadParameter`, `NotFound`, `NotMounted`.
        """
        campaign = overridden(self.campaign(request.campaign), request.parameters)
        try:
            examination = self.examine(campaign, request.unit, request.bench)
        except BadParameter as error:
            raise _as_asked(error, campaign, request.parameters) from error
        bench = self._planner.context(request.unit, request.bench).bench
        if request.seed is not None and not bench.simulated:
            raise BadParameter("seed", request.seed, "null: only a simulated bench has a seed")
        steps = tuple(
            StepRun(
                plan.name, plan.does, StepState.SKIPPED if plan.left_out else StepState.QUEUED, reason=plan.left_out
            )
            for plan in examination.steps
        )
        return CampaignRun(
            id=new_id(),
            campaign=campaign,
            unit=request.unit,
            bench=bench.id,
            state=JobState.QUEUED,
            created_at=now(),
            steps=steps,
            simulated=bench.simulated,
            seed=_base(campaign, request.seed) if bench.simulated else None,
            labels=request.labels,
            warnings=examination.warnings,
            duration_s=examination.duration_s,
        )

    def cancel_run(self, run_id: str) -> CampaignRun:
        """End a run, and return it: its job ends as soon as the bench is safe; steps that did not begin are skipped.

        Raises `NotFound`, `IllegalTransition` where it has ended.
        """
        campaigns = self._stores.campaigns
        while True:
            run = campaigns.run(run_id)
            if not run.open:
                raise IllegalTransition(f"campaign run {run_id} has ended: it is {run.state.value}")
            wanted = replace(run, cancel_requested=True, revision=run.revision + 1)
            if run.cancel_requested or campaigns.save_run(wanted, run.revision):
                self.conductor.nudge()
                return campaigns.run(run_id)

    def trend(
        self, unit: str, procedure: str, name: str, simulated: bool | None, last: int, same_parameters: bool = False
    ) -> Trend:
        """Return the trend of a quantity over a unit's results by a procedure, on request only of those with the newest
        result's parameters. Raises `NotFound`. `simulated` None: results of the kind that this bench gives. `last`: the
        number of latest results.
        """
        self._stores.units.unit(unit)
        self._planner.catalogue.procedure(procedure)
        if simulated is None:
            simulated = self._planner.benches.description(self._planner.benches.default()).simulated
        newest = self._stores.results.newest_verdict(unit, procedure, simulated=simulated)
        plan = newest.parameters if newest is not None and same_parameters else None
        found = self._stores.results.values(unit, procedure, name, simulated=simulated, limit=last, parameters=plan)
        trend = trend_of(found[::-1], unit, procedure, name)
        if newest is not None and not trend.points:
            quantity(newest.document, name)  # raises: it names the known quantities
        return trend


def overridden(campaign: Campaign, parameters: Mapping[str, Mapping[str, Any]]) -> Campaign:
    """Return the campaign with other parameters for some steps. Raises `BadParameter` for an unknown step."""
    steps = list(campaign.steps)
    for name, changed in parameters.items():
        try:
            index = step_field(campaign, name)
        except NotFound as error:
            raise BadParameter(f"parameters.{name}", name, str(error)) from error
        merged = {**steps[index].parameters, **changed}
        steps[index] = steps[index].model_copy(update={"parameters": merged})
    return campaign.model_copy(update={"steps": tuple(steps)})


def _as_asked(error: BadParameter, campaign: Campaign, changed: Mapping[str, Mapping[str, Any]]) -> BadParameter:
    """Rename a parameter's refusal to the place where the client gave it: with the run, or in the campaign."""
    for index, step in enumerate(campaign.steps):
        inner = error.field.removeprefix(f"steps.{index}.parameters.")
        if inner != error.field and inner.split(".")[0] in changed.get(step.name, {}):
            return BadParameter(f"parameters.{step.name}.{inner}", error.value, error.allowed)
    return error


def _base(campaign: Campaign, asked: int | None) -> int:
    if asked is not None:
        return asked
    return campaign.seeds.base if campaign.seeds.rule == "repeat" else SEEDS.getrandbits(46)
