"""Routes of a noun or a page as they are declared. The application that takes them builds each of them, once.

FastAPI's own router builds a route where it is declared, and an application that includes the router builds it again
for the first request, with what belongs to every route: for these routes a tenth of a second twice, and two validators
for each parameter.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from fastapi import APIRouter
from fastapi.utils import get_value_or_default


class Declared(NamedTuple):
    """A route before it is built: its whole path, its function, and what its decorator was given."""

    path: str
    endpoint: Callable[..., Any]
    options: dict[str, Any]


class Routes(APIRouter):
    """A router that keeps what is declared with its decorators until `add_to`."""

    def __init__(self, **options: Any) -> None:
        """Set up with what an `APIRouter` takes: prefix, tags, dependencies, default class of responses."""
        super().__init__(**options)
        self.declared: list[Declared] = []

    def add_api_route(self, path: str, endpoint: Callable[..., Any], **options: Any) -> None:  # pyright: ignore[reportIncompatibleMethodOverride]  # the decorators give the same options by name
        """Keep a route; the decorators call this."""
        self.declared.append(Declared(self.prefix + path, endpoint, options))

    def add_to(self, router: APIRouter) -> None:
        """Build the routes in a router, in their order, with the router's dependencies before their own."""
        for path, endpoint, options in self.declared:
            given: dict[str, Any] = options | {
                "tags": [*self.tags, *(options.get("tags") or ())],
                "dependencies": [*self.dependencies, *(options.get("dependencies") or ())],
                "response_class": get_value_or_default(options["response_class"], self.default_response_class),
                "include_in_schema": self.include_in_schema and options["include_in_schema"],
            }
            router.add_api_route(path, endpoint, **given)
