"""One table from errors to status codes, and problem+json (RFC 9457) for all of them."""

import math
from collections.abc import Sequence
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, Field, ValidationError
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse, Response

from bench_service.jobs.errors import (
    BenchBusy,
    IdempotencyConflict,
    IllegalTransition,
    NotDriving,
    NotFound,
    NotMounted,
    ServiceError,
    StorageFailure,
    StorageFull,
)
from procedures.bench.errors import BenchError
from procedures.core.errors import BadParameter, DomainError, Undetermined

STATUS: dict[type[Exception], int] = {
    NotFound: 404,
    IllegalTransition: 409,
    IdempotencyConflict: 409,
    BenchBusy: 409,
    NotDriving: 503,
    NotMounted: 422,
    DomainError: 422,
    BenchError: 502,
    StorageFull: 507,
    StorageFailure: 503,
    ServiceError: 500,
}
"""An error's status is that of its nearest ancestor here."""


class FieldError(BaseModel):
    """One field that is not as it must be."""

    field: str = Field(description="Path of the field, for example parameters.dwell_s")
    message: str = Field(description="What is wrong, with the allowed range")
    value: Any = Field(None, description="What was given; text where JSON has no such number")


class Problem(BaseModel):
    """An error as RFC 9457 has it, with the fields that caused it."""

    type: str = Field("about:blank", description="Kind of error, a relative reference")
    title: str
    status: int
    detail: str
    instance: str = ""
    errors: list[FieldError] = Field(default_factory=list[FieldError])
    lost: list[str] = Field(default_factory=list[str], description="Combinations that a plan cannot determine")


def problems(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """The `responses` of a route: these statuses answer with a problem document; 400, 422 and 503 always can."""
    wanted = sorted({*statuses, 400, 422, 503})
    return {
        status: {
            "description": HTTPStatus(status).phrase,
            "content": {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}},
        }
        for status in wanted
    }


def made(status: int, parameter: str, *operations: str) -> dict[int | str, dict[str, Any]]:
    """The good answer of a create, with OpenAPI links from the new thing's id to the operations that take it."""
    link = {
        operation: {"operationId": operation, "parameters": {parameter: "$response.body#/id"}}
        for operation in operations
    }
    return {status: {"description": HTTPStatus(status).phrase, "links": link}}


def install(app: FastAPI) -> None:
    """Answer every error of the table, of validation and of routing with a problem document."""
    app.add_exception_handler(RequestValidationError, _on_request_validation)
    app.add_exception_handler(ValidationError, _on_parameter_validation)
    app.add_exception_handler(HTTPException, _on_http)
    for error in (DomainError, ServiceError, BenchError):
        app.add_exception_handler(error, _on_known)
    app.add_exception_handler(Exception, _on_unknown)


def status_of(error: Exception) -> int:
    """The status code of a known error."""
    return next(STATUS[cls] for cls in type(error).__mro__ if cls in STATUS)


def _on_known(request: Request, error: Exception) -> Response:
    fields: list[FieldError] = []
    if isinstance(error, BadParameter):
        fields = [FieldError(field=error.field, message=error.allowed, value=_jsonable(error.value))]
    lost = list(error.lost) if isinstance(error, Undetermined) else []
    return respond(request, status_of(error), str(error), type(error).__name__, fields, lost)


def _on_request_validation(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    return _invalid(request, error.errors(), prefix="")


def _on_parameter_validation(request: Request, error: Exception) -> Response:
    assert isinstance(error, ValidationError)
    return _invalid(request, error.errors(include_url=False), prefix="parameters")


def _invalid(request: Request, errors: Sequence[Any], prefix: str) -> Response:
    fields = [
        FieldError(field=_path(e["loc"], prefix), message=str(e["msg"]), value=_jsonable(e.get("input")))
        for e in errors
    ]
    detail = "; ".join(f"{f.field}: {f.message}" for f in fields[:5])
    return respond(request, 422, detail, "Invalid", fields)


def _on_http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    response = respond(request, error.status_code, str(error.detail), HTTPStatus(error.status_code).phrase)
    response.headers.update(error.headers or {})
    return response


def _on_unknown(request: Request, error: Exception) -> Response:
    return respond(request, 500, "a defect of the service; its log has the details", type(error).__name__)


def respond(
    request: Request, status: int, detail: str, kind: str, errors: Sequence[FieldError] = (), lost: Sequence[str] = ()
) -> JSONResponse:
    """A problem document as a response."""
    problem = Problem(
        type=f"/problems/{kind}" if kind else "about:blank",
        title=HTTPStatus(status).phrase,
        status=status,
        detail=detail,
        instance=request.url.path,
        errors=list(errors),
        lost=list(lost),
    )
    return JSONResponse(problem.model_dump(), status, media_type="application/problem+json")


def _path(location: Sequence[str | int], prefix: str) -> str:
    parts = [str(part) for part in location if part not in ("body", "query", "path", "header")]
    return ".".join(([prefix] if prefix else []) + parts) or "body"


def _jsonable(value: Any) -> Any:
    """The offending value where JSON can say it, else its text, cut to a readable length."""
    if isinstance(value, float) and not math.isfinite(value):
        return repr(value)
    if value is None or isinstance(value, bool | int | float):
        return value
    text = value if isinstance(value, str) else repr(value)
    return text if len(text) <= 200 else text[:200] + "…"
