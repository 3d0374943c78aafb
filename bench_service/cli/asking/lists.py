"""Lists of a service: every page of one, conditions as a query, and their printing."""

import json
from typing import TYPE_CHECKING, Any

from bench_service.cli.asking.client import call
from bench_service.cli.asking.moments import moment_of
from bench_service.cli.options import wide

if TYPE_CHECKING:
    import httpx

PAGE = 500
"""Largest number of items that the service gives in one page."""


def everything(client: "httpx.Client", path: str) -> list[dict[str, Any]]:
    """Return all items of a list of the service, read page by page. Raises `Refused`."""
    items: list[dict[str, Any]] = []
    query: dict[str, Any] = {"limit": PAGE}
    while True:
        page = call(client, "GET", path, ("items", "next"), params=query)
        items += page["items"]
        if page["next"] is None:
            return items
        query["after"] = page["next"]


def newest(client: "httpx.Client", path: str, most: int, conditions: dict[str, Any]) -> dict[str, Any]:
    """Return the newest items of a list that fulfil the conditions, as one page of any length; None is no condition.

    `since` and `until` are moments as people type them. Raises `Refused` for others.
    """
    moments = {name: moment_of(f"--{name}", conditions[name]) for name in ("since", "until") if name in conditions}
    query = {name: value for name, value in {**conditions, **moments}.items() if value not in (None, [], "")}
    items: list[dict[str, Any]] = []
    while True:
        page = call(client, "GET", path, ("items",), params={**query, "limit": min(PAGE, max(1, most - len(items)))})
        items += page["items"]
        cursor = page.get("next")
        if cursor is None or len(items) >= most:
            return {"items": items, "next": cursor}
        query["after"] = cursor


def show(items: Any, as_json: bool, table: Any) -> None:
    """Print a list as JSON, or as the table that `table` makes of it."""
    if as_json:
        print(json.dumps(items, indent=2))
    else:
        wide().print(table(items))
