"""Error handlers: every error answers with a problem document (RFC 9457); status codes: `api/http/status.py`."""

from collections.abc import Sequence
from http import HTTPStatus
from math import ceil
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from pydantic import ValidationError
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse, Response

from bench_service.api.http.headers import SECURITY_HEADERS
from bench_service.api.http.problem import FieldError, Problem
from bench_service.api.http.status import status_of
from bench_service.formats.plain_json import A_NUMBER, NOT_SO_DEEP, is_finite, shown
from bench_service.model.errors import (
    LockedOut,
    NotReady,
    Overloaded,
    ServiceError,
    SeveralStops,
)
from procedures.bench.errors import BenchError
from procedures.core.errors import BadParameter, DomainError, Undetermined


class AccessRefused(HTTPException):
    """Raised where a request is refused for its sender; as it is raised while a body is read, it is an HTTP error."""

    def __init__(self, status: int, kind: str, text: str, headers: dict[str, str] | None = None) -> None:
        super().__init__(status, text, headers)
        self.kind = kind


RETRY_AFTER_S = "2"
"""Time after which a client may repeat a request that was refused for overload [s]."""
MOST_FIELDS = 100
"""Most wrong fields that an answer lists, of a body of up to a megabyte."""
_NO_BODY = FieldError(field="body", message="UTF-8 text of one JSON document is expected")
_UNREAD: dict[type, str] = {RecursionError: NOT_SO_DEEP, ValueError: A_NUMBER}
"""Allowed values, by the error of `json.loads` itself: at a thousand brackets or at an integer of 4300 digits."""


def problems(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """The `responses` of a route: these statuses answer with a problem document. Those of the door (401, 403, 421), of
    a body or an address that is not understood, and of a service that is not ready are possible everywhere.
    """
    wanted = sorted({*statuses, 400, 401, 403, 421, 422, 503})
    return {
        status: {
            "description": HTTPStatus(status).phrase,
            "content": {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}},
        }
        for status in wanted
    }


def binary(media_type: str) -> dict[str, Any]:
    """Return the OpenAPI `content` of an answer of bytes: under its `media_type`, and under octet-stream, which every
    generator of clients knows.
    """
    schema = {"schema": {"type": "string", "format": "binary"}}
    return {media_type: schema, "application/octet-stream": schema}


def made(status: int, parameter: str, *operations: str) -> dict[int | str, dict[str, Any]]:
    """Return the OpenAPI description of a create's good answer, with links from the new thing's id to the operations
    that take it.
    """
    link = {
        operation: {"operationId": operation, "parameters": {parameter: "$response.body#/id"}}
        for operation in operations
    }
    return {status: {"description": HTTPStatus(status).phrase, "links": link}}


def install(app: FastAPI) -> None:
    """Add to an application the handlers that answer every known error, of validation and routing too, with a problem
    document.

    Every handler is asynchronous: another one would wait for a thread of the pool, and a stop's refusal with it.
    """
    app.add_exception_handler(RequestValidationError, _on_request_validation)
    app.add_exception_handler(ValidationError, _on_parameter_validation)
    app.add_exception_handler(HTTPException, _on_http)
    for error in (DomainError, ServiceError, BenchError):
        app.add_exception_handler(error, _on_known)
    app.add_exception_handler(Exception, _on_unknown)


def problem_of(request: Request, error: DomainError | ServiceError | ValidationError) -> Problem:
    """Return the problem document of a known error, for an answer that holds several."""
    if isinstance(error, ValidationError):
        return _invalid_problem(request, error.errors(include_url=False), "parameters")
    return _problem(request, status_of(error), str(error), type(error).__name__, *_details(error))


async def _on_known(request: Request, error: Exception) -> Response:
    response = respond(request, status_of(error), str(error), type(error).__name__, *_details(error))
    if isinstance(error, Overloaded):
        response.headers["Retry-After"] = RETRY_AFTER_S
    if isinstance(error, LockedOut):
        response.headers["Retry-After"] = str(ceil(error.wait_s))
    return response


def _details(error: Exception) -> tuple[list[FieldError], list[str]]:
    """The fields that caused an error, and the combinations that a plan cannot determine."""
    fields: list[FieldError] = []
    if isinstance(error, BadParameter):
        fields = [FieldError(field=error.field, message=error.allowed, value=_jsonable(error.value))]
    if isinstance(error, NotReady):
        fields = [FieldError(field="service", message=reason) for reason in error.reasons]
    if isinstance(error, SeveralStops):
        fields = [FieldError(field="stop_id", message=text, value=stop) for stop, text in error.stops]
    return fields, list(error.lost) if isinstance(error, Undetermined) else []


async def _on_request_validation(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    if first["type"] == "json_invalid" and first["loc"][0] == "body":
        message = f"no JSON: {first['ctx']['error']} at character {first['loc'][-1]}"
        return respond(request, 400, message, "BadRequest", [FieldError(field="body", message=message)])
    return _invalid(request, error.errors(), prefix="")


async def _on_parameter_validation(request: Request, error: Exception) -> Response:
    assert isinstance(error, ValidationError)
    return _invalid(request, error.errors(include_url=False), prefix="parameters")


def _invalid(request: Request, errors: Sequence[Any], prefix: str) -> Response:
    return _answer(_invalid_problem(request, errors, prefix))


def _invalid_problem(request: Request, errors: Sequence[Any], prefix: str) -> Problem:
    fields = [
        FieldError(field=_path(e["loc"], prefix), message=str(e["msg"]), value=_jsonable(e.get("input")))
        for e in errors[:MOST_FIELDS]
        if not _follows(e, errors)
    ]
    detail = "; ".join(f"{f.field}: {f.message}" for f in fields[:5])
    return _problem(request, 422, detail, "Invalid", fields)


def _follows(error: Any, errors: Sequence[Any]) -> bool:
    """Return whether an error only follows from another: a list without its bad element is also reported too short."""
    place = tuple(error["loc"])
    return error["type"] == "too_short" and any(
        len(other["loc"]) > len(place) and tuple(other["loc"][: len(place)]) == place for other in errors
    )


async def _on_http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    status = error.status_code
    if status == 400 and (allowed := _UNREAD.get(type(error.__cause__))) is not None:
        return respond(request, 422, f"body: {allowed}", "Invalid", [FieldError(field="body", message=allowed)])
    kind = error.kind if isinstance(error, AccessRefused) else HTTPStatus(status).phrase.replace(" ", "")
    allowed = str(error.detail).rpartition(": ")[2]
    fields = {400: [_NO_BODY], 413: [FieldError(field="body", message=allowed)]}.get(status, [])
    response = respond(request, status, str(error.detail), kind, fields)
    response.headers.update(error.headers or {})
    return response


async def _on_unknown(request: Request, error: Exception) -> Response:
    response = respond(request, 500, "a defect of the service; its log has the details", "InternalError")
    response.headers.update(SECURITY_HEADERS)  # this answer is made outside of all that adds to answers
    response.headers["Connection"] = "close"  # the server closes it: a client that asked on it would find it broken
    return response


def respond(
    request: Request, status: int, detail: str, kind: str, errors: Sequence[FieldError] = (), lost: Sequence[str] = ()
) -> JSONResponse:
    """Return the response that carries a problem document with this status."""
    return _answer(_problem(request, status, detail, kind, errors, lost))


def _answer(problem: Problem) -> JSONResponse:
    return JSONResponse(problem.model_dump(), problem.status, media_type="application/problem+json")


def _problem(
    request: Request, status: int, detail: str, kind: str, errors: Sequence[FieldError] = (), lost: Sequence[str] = ()
) -> Problem:
    return Problem(
        type=f"/problems/{kind}" if kind else "about:blank",
        title=HTTPStatus(status).phrase,
        status=status,
        detail=detail,
        instance=request.scope["path"],
        errors=list(errors),
        lost=list(lost),
    )


def _path(location: Sequence[str | int], prefix: str) -> str:
    inside = location[1:] if location and location[0] in ("body", "query", "path", "header") else location
    parts = [str(part) for part in inside]
    return ".".join(([prefix] if prefix else []) + parts) or "body"


def _jsonable(value: Any) -> Any:
    """The offending value where JSON can say it, else its text, cut to a readable length."""
    if value is None or isinstance(value, bool) or (isinstance(value, int | float) and is_finite(value)):
        return value
    text = shown(value if isinstance(value, str) else repr(value))
    return text if len(text) <= 200 else text[:200] + "…"
