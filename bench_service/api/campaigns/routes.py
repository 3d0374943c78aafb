"""Routes of campaigns and their runs: define, preview, start, watch, cancel, report."""

from typing import Annotated, Any, Literal

from fastapi import Path, Query, Response
from pydantic import Field

from bench_service.api.access.teams import TeamOfCampaign, TeamOfRun
from bench_service.api.campaigns.schemas import (
    CampaignMade,
    CampaignPage,
    CampaignPreview,
    CampaignReport,
    CampaignRunPage,
    CampaignRunView,
    CampaignView,
)
from bench_service.api.http.dependencies import After, IdempotencyKey, Limit, Me, Service
from bench_service.api.http.errors import made, problems
from bench_service.api.http.fields import NAME, Labels, Request
from bench_service.campaigns import junit
from bench_service.campaigns.campaign import NAME as CAMPAIGN_NAME
from bench_service.campaigns.campaign import Campaign
from bench_service.campaigns.lineage import lineage_of
from bench_service.campaigns.run import RunRequest
from bench_service.mapping import copied
from bench_service.model.job import JobState
from bench_service.routing import Routes
from procedures.core.errors import BadParameter

router = Routes(prefix="/api/v1", tags=["campaigns"])
CampaignName = Annotated[str, Path(pattern=CAMPAIGN_NAME)]
OF_A_RUN = ("read_campaign_run", "cancel_campaign_run", "report_campaign_run")


class CampaignOn(Request):
    """A unit, and a bench where there are several."""

    unit: str = NAME
    bench: Annotated[str, NAME] | None = None


class RunSubmission(CampaignOn):
    """Request to run a campaign."""

    seed: int | None = Field(None, ge=0, lt=2**47, description="Base of the steps' seeds on a simulated bench")
    labels: Labels = Field(default_factory=Labels, max_length=20)
    parameters: dict[str, dict[str, Any]] = Field(
        default_factory=dict[str, dict[str, Any]],
        max_length=100,
        description="Step -> parameters that replace the campaign's",
    )


@router.get("/campaigns", responses=problems())
def list_campaigns(service: Service, after: After = None, limit: Limit = 50) -> CampaignPage:
    """List the campaigns by name, including those that come with the service."""
    page = service.campaigns.campaigns(after, limit)
    return CampaignPage(items=[CampaignView.of(campaign) for campaign in page.items], next=page.next)


@router.post("/campaigns", status_code=201, responses=problems(404, 409, 413, 507))
def add_campaign(
    body: Campaign, service: Service, response: Response, me: Me, key: IdempotencyKey = None
) -> CampaignMade:
    """Store a new campaign, for the team of the account or token that asks.

    Every step is examined first: impossible steps are refused, doubtful ones give warnings.
    """
    campaign = service.campaigns.add(body, key, me.team)
    response.headers["Location"] = f"/api/v1/campaigns/{campaign.name}"
    return CampaignMade.of(campaign, service.campaigns.examine(campaign))


@router.get("/campaigns/{name}", responses=problems(404))
def read_campaign(name: CampaignName, service: Service) -> CampaignView:
    """Read one campaign by its name."""
    return CampaignView.of(service.campaigns.campaign(name))


@router.put("/campaigns/{name}", responses=problems(404, 409, 413, 507), dependencies=[TeamOfCampaign])
def replace_campaign(name: CampaignName, body: Campaign, service: Service) -> CampaignMade:
    """Replace a stored campaign; runs requested before keep the version that they have."""
    if body.name != name:
        raise BadParameter("name", body.name, f"the name in the address, {name}")
    campaign = service.campaigns.replace(body)
    return CampaignMade.of(campaign, service.campaigns.examine(campaign))


@router.post("/campaigns/{name}/preview", responses=problems(404, 413))
def preview_campaign(name: CampaignName, body: CampaignOn, service: Service) -> CampaignPreview:
    """Preview the campaign on a unit: steps left out, times, limits out of reach. Nothing moves."""
    campaign = service.campaigns.campaign(name)
    found = service.campaigns.examine(campaign, body.unit, body.bench)
    return copied(CampaignPreview, found, campaign=name, unit=body.unit)


@router.post(
    "/campaigns/{name}/runs",
    status_code=202,
    responses={**problems(404, 409, 413, 507), **made(202, "run_id", *OF_A_RUN)},
)
def start_campaign(
    name: CampaignName, body: RunSubmission, service: Service, response: Response, me: Me, key: IdempotencyKey = None
) -> CampaignRunView:
    """Queue a run of the campaign, for the team of the account or token that asks.

    A bench does one campaign run at a time, in the order of the requests.
    """
    request = copied(RunRequest, body, campaign=name)
    run = service.campaigns.start(request, key, me.team)
    response.headers["Location"] = f"/api/v1/campaign-runs/{run.id}"
    return CampaignRunView.of(run)


@router.get("/campaign-runs", responses=problems())
def list_campaign_runs(
    service: Service,
    campaign: Annotated[str | None, Query(max_length=100)] = None,
    unit: Annotated[str | None, Query(max_length=100)] = None,
    state: JobState | None = None,
    after: After = None,
    limit: Limit = 50,
) -> CampaignRunPage:
    """List the campaign runs, newest first."""
    page = service.stores.campaigns.runs(campaign=campaign, unit=unit, state=state, after=after, limit=limit)
    return CampaignRunPage(items=[CampaignRunView.of(run) for run in page.items], next=page.next)


@router.get("/campaign-runs/{run_id}", responses=problems(404))
def read_campaign_run(run_id: str, service: Service) -> CampaignRunView:
    """Read one campaign run: each step's state, job, checks, verdict and reasons."""
    return CampaignRunView.of(service.stores.campaigns.run(run_id))


@router.post(
    "/campaign-runs/{run_id}/cancel", status_code=202, responses=problems(404, 409, 507), dependencies=[TeamOfRun]
)
def cancel_campaign_run(run_id: str, service: Service) -> CampaignRunView:
    """Cancel a campaign run: its job ends as soon as the bench is safe; steps that did not begin are left out."""
    return CampaignRunView.of(service.campaigns.cancel_run(run_id))


@router.get(
    "/campaign-runs/{run_id}/report",
    responses={
        **problems(404),
        200: {"description": "The outcome", "content": {"application/xml": {"schema": {"type": "string"}}}},
    },
)
def report_campaign_run(
    run_id: str, service: Service, form: Annotated[Literal["json", "junit"], Query(alias="format")] = "json"
) -> CampaignReport:
    """The outcome for another machine to read.

    `json` with its lineage: for each step job, result, recordings' hashes, code version and seed. `junit` as JUnit XML:
    a suite a step, a case a check.
    """
    run = service.stores.campaigns.run(run_id)
    if form == "junit":
        return Response(junit.document(run), media_type="application/xml")  # pyright: ignore[reportReturnType]
    return CampaignReport.of(run, lineage_of(run, service.stores))
