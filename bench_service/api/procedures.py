"""Routes of procedures: the procedures of the bench, and previews of a plan before anything moves."""

from typing import Annotated, Any

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from bench_service.api.http.dependencies import Service
from bench_service.api.http.errors import problems
from bench_service.api.http.fields import NAME, Request
from bench_service.mapping import copied
from bench_service.model.errors import NotMounted
from bench_service.service import BenchService
from procedures.core.errors import DomainError
from procedures.core.recording import Station
from procedures.procedure import Method, Outcome, Parameters, PredictedUncertainty, Procedure

router = APIRouter(prefix="/api/v1", tags=["procedures"])


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
    basis: str = Field(description="What the prediction rests on: a calibration, or nominal scale factors")
    warnings: list[str]
    violations: list[str]


class PlanView(BaseModel):
    """A procedure's plan with default parameters, in brief."""

    procedure: str
    duration_s: float | None = Field(description="Bench time; null: there is no plan")
    stations: int | None
    refusal: str | None = Field(description="Why it cannot be done on this unit and bench")


def _view(entry: Procedure[Parameters, Outcome] | Method[Parameters, Outcome]) -> ProcedureView:
    return copied(
        ProcedureView,
        entry,
        parameters=entry.params.model_json_schema(),
        result=entry.result.model_json_schema(mode="serialization"),
    )


@router.get("/procedures", responses=problems())
def list_procedures(service: Service) -> list[ProcedureView]:
    """List every procedure, with the JSON Schemas of its parameters and its result."""
    return [_view(procedure) for procedure in service.catalogue.procedures.values()]


@router.get("/plans", responses=problems(404))
def list_plans(
    service: Service,
    unit: Annotated[str, Query(min_length=1, max_length=100)],
    bench: Annotated[str | None, Query(max_length=100)] = None,
) -> list[PlanView]:
    """List what each procedure would take on a unit with its default parameters, or why it cannot be done."""
    return [_brief(service, name, unit, bench) for name in service.catalogue.procedures]


def _brief(service: BenchService, name: str, unit: str, bench: str | None) -> PlanView:
    try:
        plan = service.planner.plan(name, unit, {}, bench)
    except (DomainError, NotMounted) as error:
        return PlanView(procedure=name, duration_s=None, stations=None, refusal=str(error))
    refusal = plan.violations[0] if plan.violations else None
    return PlanView(procedure=name, duration_s=plan.prediction.duration_s, stations=len(plan.stations), refusal=refusal)


@router.get("/procedures/{name}", responses=problems(404))
def read_procedure(name: str, service: Service) -> ProcedureView:
    """Read one procedure by its name."""
    return _view(service.catalogue.procedure(name))


@router.post("/procedures/{name}/preview", responses=problems(404, 413))
def preview(name: str, request: PreviewRequest, service: Service) -> Preview:
    """Preview stations, duration, predicted uncertainties and warnings of a plan; violations of axis limits."""
    plan = service.planner.plan(name, request.unit, request.parameters, request.bench)
    return copied(
        Preview,
        plan,
        plan.prediction,
        procedure=name,
        unit=request.unit,
        bench=plan.context.bench.id,
        parameters=plan.parameters.model_dump(mode="json"),
        predicted_uncertainties=plan.prediction.uncertainties,
    )


@router.get("/methods", tags=["analyses"], responses=problems())
def list_methods(service: Service) -> list[ProcedureView]:
    """List every method that can be run on recordings or calibrations, with its JSON Schemas."""
    return [_view(method) for method in service.catalogue.methods.values()]
