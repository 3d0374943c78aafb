"""Routes of procedures: the procedures of the bench, and previews of a plan before anything moves."""

from collections.abc import Iterable
from functools import cache
from typing import Annotated, Any

from fastapi import Request as HttpRequest
from fastapi import Response
from pydantic import BaseModel, Field, TypeAdapter, ValidationError

from bench_service.api.http.dependencies import Service
from bench_service.api.http.errors import Problem, problem_of, problems
from bench_service.api.http.fields import NAME, Request
from bench_service.api.http.status import status_of
from bench_service.evidence.admission import Turns
from bench_service.jobs.planning import Plan
from bench_service.mapping import copied
from bench_service.model.errors import ServiceError
from bench_service.routing import Routes
from bench_service.service import BenchService
from procedures.core.errors import DomainError
from procedures.core.recording import Station
from procedures.procedure import Context, Method, Outcome, Parameters, PredictedUncertainty, Procedure

router = Routes(prefix="/api/v1", tags=["procedures"])


PREVIEWS = Turns("previews", at_once=4, waiting=60)
"""Previews: a plan is worked out by this process's own interpreter, which also drives the bench."""


class ProcedureView(BaseModel):
    """A procedure with the JSON Schemas of its parameters and its result."""

    name: str
    title: str
    version: str
    parameters: dict[str, Any]
    result: dict[str, Any]


class PreviewRequest(Request):
    """A plan to be previewed: procedure parameters, unit and bench."""

    unit: str = NAME
    bench: Annotated[str, NAME] | None = None
    parameters: dict[str, Any] = Field(default_factory=dict[str, Any])


class Preview(BaseModel):
    """Preview of a plan before anything moves."""

    procedure: str
    unit: str
    bench: str
    parameters: dict[str, Any]
    stations: list[Station]
    duration_s: float
    data_bytes: int
    predicted_uncertainties: list[PredictedUncertainty]
    basis: str = Field(description="Basis of the prediction: a calibration, or nominal scale factors")
    warnings: list[str]
    violations: list[str]


class PlanRequest(PreviewRequest):
    """One plan of a batch: the procedure with what a preview of it takes."""

    procedure: str = NAME


class PreviewBatch(Request):
    """Plans to be previewed together."""

    plans: list[PlanRequest] = Field(min_length=1, max_length=500)


class PreviewOutcome(BaseModel):
    """The preview of one plan of a batch, or the reason why it cannot be run."""

    preview: Preview | None
    refusal: Problem | None


class PreviewOutcomes(BaseModel):
    """Outcomes of a batch, in the order of its plans."""

    items: list[PreviewOutcome]


AnyEntry = Procedure[Parameters, Outcome] | Method[Parameters, Outcome]
VIEWS = TypeAdapter(list[ProcedureView])


def _view(entry: AnyEntry) -> ProcedureView:
    parameters, result = _schemas(entry.params, entry.result)
    return copied(ProcedureView, entry, parameters=parameters, result=result)


@cache
def _schemas(params: type[Parameters], result: type[Outcome]) -> tuple[dict[str, Any], dict[str, Any]]:
    """JSON Schemas of parameters and result; making all of them takes longer than most answers, and none changes."""
    return params.model_json_schema(), result.model_json_schema(mode="serialization")


@cache
def _listed(*entries: tuple[str, str, str, type[Parameters], type[Outcome]]) -> bytes:
    """The catalogue as JSON, made once: every page with a choice of procedures asks for it."""
    views: list[ProcedureView] = []
    for name, title, version, params, result in entries:
        of_params, of_result = _schemas(params, result)
        views.append(ProcedureView(name=name, title=title, version=version, parameters=of_params, result=of_result))
    return VIEWS.dump_json(views)


def _answer(entries: Iterable[AnyEntry]) -> Response:
    listed = _listed(*((each.name, each.title, each.version, each.params, each.result) for each in entries))
    return Response(listed, media_type="application/json")


@router.get("/procedures", response_model=list[ProcedureView], responses=problems())
def list_procedures(service: Service) -> Response:
    """List every procedure, with the JSON Schemas of its parameters and its result."""
    return _answer(service.catalogue.procedures.values())


@router.get("/procedures/{name}", responses=problems(404))
def read_procedure(name: str, service: Service) -> ProcedureView:
    """Read one procedure by its name."""
    return _view(service.catalogue.procedure(name))


@router.post("/procedures/{name}/preview", responses=problems(404, 413))
async def preview(name: str, request: PreviewRequest, service: Service) -> Preview:
    """Preview stations, duration, predicted uncertainties and warnings of a plan; violations of axis limits."""
    return await PREVIEWS.run(_previewed, name, request, service)


def _previewed(name: str, request: PreviewRequest, service: BenchService) -> Preview:
    plan = service.planner.plan(name, request.unit, request.parameters, request.bench)
    return _preview(name, request.unit, plan)


@router.post("/previews", responses=problems(413))
async def preview_batch(body: PreviewBatch, service: Service, request: HttpRequest) -> PreviewOutcomes:
    """Preview up to 500 plans at once; a plan that cannot be run is refused by itself, the others are previewed."""
    return await PREVIEWS.run(_batch, body, service, request)


def _batch(body: PreviewBatch, service: BenchService, request: HttpRequest) -> PreviewOutcomes:
    contexts: dict[tuple[str, str | None], Context] = {}
    items: list[PreviewOutcome] = []
    for wanted in body.plans:
        place = wanted.unit, wanted.bench
        try:
            if place not in contexts:
                contexts[place] = service.planner.context(*place)
            plan = service.planner.plan_in(contexts[place], wanted.procedure, wanted.parameters)
            items.append(PreviewOutcome(preview=_preview(wanted.procedure, wanted.unit, plan), refusal=None))
        except (DomainError, ServiceError, ValidationError) as error:
            if not isinstance(error, ValidationError) and status_of(error) >= 500:
                raise  # not this plan's affair
            items.append(PreviewOutcome(preview=None, refusal=problem_of(request, error)))
    return PreviewOutcomes(items=items)


def _preview(procedure: str, unit: str, plan: Plan) -> Preview:
    return copied(
        Preview,
        plan,
        plan.prediction,
        procedure=procedure,
        unit=unit,
        bench=plan.context.bench.id,
        parameters=plan.parameters.model_dump(mode="json"),
        predicted_uncertainties=plan.prediction.uncertainties,
    )


@router.get("/methods", response_model=list[ProcedureView], tags=["analyses"], responses=problems())
def list_methods(service: Service) -> Response:
    """List every method that can be run on recordings or calibrations, with its JSON Schemas."""
    return _answer(service.catalogue.methods.values())
