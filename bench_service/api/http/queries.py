"""Queries of lists: the conditions that several lists take, and the refusal of names that a route does not know."""

from typing import Annotated

from fastapi import Depends, Query, Request
from fastapi.dependencies.utils import get_flat_params
from fastapi.exceptions import RequestValidationError
from fastapi.params import ParamTypes
from fastapi.routing import APIRoute
from pydantic import AwareDatetime

from bench_service.model.search import LabelSought, Search
from procedures.core.limits import Verdict

OF_THE_API = "/api/"
LABEL = Annotated[str, Query(min_length=1, max_length=201, pattern=r"^[^=\x00-\x1f][^\x00-\x1f]*$")]


async def only_known_names(request: Request) -> None:
    """Dependency of every route of the API: a name that it does not know in the query would do nothing, unnoticed.

    Raises `RequestValidationError` with the unknown name and the known ones.
    """
    route = request.scope.get("route")
    if not request.query_params or not isinstance(route, APIRoute) or not request.scope["path"].startswith(OF_THE_API):
        return
    known = _query_names(route)
    unknown = [name for name in request.query_params if name not in known]
    if unknown:
        allowed = f"one of {', '.join(known)}" if known else "none: this address takes no query parameters"
        raise RequestValidationError(
            [{"type": "extra_forbidden", "loc": ("query", name), "msg": allowed, "input": name} for name in unknown]
        )


def _query_names(route: APIRoute) -> tuple[str, ...]:
    fields = get_flat_params(route.dependant)
    return tuple(field.alias for field in fields if getattr(field.field_info, "in_", None) is ParamTypes.query)


async def _search(
    verdict: Annotated[Verdict | None, Query(description="Verdict; of a recording, that of its job")] = None,
    since: Annotated[AwareDatetime | None, Query(description="Created at this time or later, with time zone")] = None,
    until: Annotated[AwareDatetime | None, Query(description="Created before this time, with time zone")] = None,
    label: Annotated[
        list[LABEL] | None,
        Query(max_length=20, description="`name` or `name=value` of the job; several must all hold"),
    ] = None,
    text: Annotated[
        str | None,
        Query(min_length=1, max_length=200, description="In an id, a name, a label or the name of an imported file"),
    ] = None,
) -> Search:
    labels = tuple(map(LabelSought.parse, label or ()))
    return Search(verdict=verdict, since=since, until=until, labels=labels, text=text)


Searched = Annotated[Search, Depends(_search)]
"""The conditions of a search, from the query."""
