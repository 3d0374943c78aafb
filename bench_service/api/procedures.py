"""Routes of procedures: the procedures of the bench, and previews of a plan before anything moves."""

from typing import Annotated, Any

from fastapi import APIRouter
from pydantic import BaseModel, Field

from bench_service.api.http.dependencies import Service
from bench_service.api.http.errors import problems
from bench_service.api.http.fields import NAME, Request
from bench_service.evidence.admission import Turns
from bench_service.mapping import copied
from bench_service.service import BenchService
from procedures.core.recording import Station
from procedures.procedure import Method, Outcome, Parameters, PredictedUncertainty, Procedure

router = APIRouter(prefix="/api/v1", tags=["procedures"])


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
    basis: str = Field(description="What the prediction rests on: a calibration, or nominal scale factors")
    warnings: list[str]
    violations: list[str]


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


@router.get("/procedures/{name}", responses=problems(404))
def read_procedure(name: str, service: Service) -> ProcedureView:
    """Read one procedure by its name."""
    return _view(service.catalogue.procedure(name))


@router.post("/procedures/{name}/preview", responses=problems(404, 413))
async def preview(name: str, request: PreviewRequest, service: Service) -> Preview:
    """Preview stations, duration, predicted uncertainties and warnings of a plan; violations of axis limits."""
    return await PREVIEWS.run(_preview, name, request, service)


def _preview(name: str, request: PreviewRequest, service: BenchService) -> Preview:
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
