"""What the bench can do, and what a plan would be worth before anything moves."""

from fastapi import APIRouter

from bench_service.api.dependencies import Service
from bench_service.api.errors import problems
from bench_service.api.requests import PreviewRequest
from bench_service.api.schemas import Preview, ProcedureView
from procedures.procedure import Method, Outcome, Parameters, Procedure

router = APIRouter(prefix="/api/v1", tags=["procedures"])


def _view(entry: Procedure[Parameters, Outcome] | Method[Parameters, Outcome]) -> ProcedureView:
    return ProcedureView(
        name=entry.name,
        title=entry.title,
        version=entry.version,
        parameters=entry.params.model_json_schema(),
        result=entry.result.model_json_schema(mode="serialization"),
    )


@router.get("/procedures", responses=problems())
def list_procedures(service: Service) -> list[ProcedureView]:
    """Every procedure, with the JSON Schemas of its parameters and its result."""
    return [_view(procedure) for procedure in service.planner.catalog.values()]


@router.get("/procedures/{name}", responses=problems(404))
def read_procedure(name: str, service: Service) -> ProcedureView:
    """One procedure."""
    return _view(service.planner.procedure(name))


@router.post("/procedures/{name}/preview", responses=problems(404, 413))
def preview(name: str, request: PreviewRequest, service: Service) -> Preview:
    """Stations, duration, predicted uncertainties and warnings of a plan; axis limits that it passes as violations."""
    plan = service.planner.plan(name, request.unit, request.parameters, request.bench)
    return Preview(
        procedure=name,
        unit=request.unit,
        bench=plan.context.bench.id,
        parameters=plan.parameters.model_dump(mode="json"),
        stations=list(plan.stations),
        duration_s=plan.prediction.duration_s,
        data_bytes=plan.data_bytes,
        predicted_uncertainties=list(plan.prediction.uncertainties),
        basis=plan.prediction.basis,
        warnings=list(plan.prediction.warnings),
        violations=list(plan.violations),
    )


@router.get("/methods", tags=["analyses"], responses=problems())
def list_methods(service: Service) -> list[ProcedureView]:
    """Every method that can be run on recordings or calibrations, with its JSON Schemas."""
    return [_view(method) for method in service.analyses.methods.values()]
