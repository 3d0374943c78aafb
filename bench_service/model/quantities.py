"""Named numbers in a result's document: the subject of limits and trends."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any

from bench_service.model.errors import NotFound


@dataclass(frozen=True)
class Quantity:
    """A value of a result; the unit is empty where the document does not give it (a JSON pointer). One of infinity is
    the bound of what a record does not bound.
    """

    name: str
    value: float
    unit: str
    standard_uncertainty: float | None = None
    bound: bool = False
    """True where nothing was observed, and the value is an upper limit."""


def quantities(document: Mapping[str, Any]) -> dict[str, Quantity]:
    """Return every check and every named estimate (an entry with name, unit and estimate) of a result's document, by
    name.
    """
    found = {
        check["name"]: Quantity(
            check["name"],
            inf if check["value"] is None else check["value"],
            check["limit"]["unit"],
            check.get("standard_uncertainty"),
            check.get("bound", False),
        )
        for check in document.get("checks", [])
    }
    for entry in _entries(document):
        found.setdefault(
            entry["name"],
            Quantity(entry["name"], entry["estimate"], entry["unit"], entry.get("standard_uncertainty")),
        )
    return found


def quantity(document: Mapping[str, Any], name: str) -> Quantity:
    """Return a named quantity of a result's document, or the number at a JSON pointer (RFC 6901). Raises `NotFound`,
    naming the known quantities.
    """
    if name.startswith("/"):
        return Quantity(name, _pointed(document, name), "")
    found = quantities(document)
    if name not in found:
        raise NotFound("quantity", name, f"the result has {', '.join(found) or 'none'}")
    return found[name]


def _entries(node: Any) -> Iterator[Mapping[str, Any]]:
    """Named estimates in a document; lists of plain numbers are long, and are not searched."""
    if isinstance(node, Mapping):
        if {"name", "unit", "estimate"} <= node.keys() and isinstance(node["estimate"], int | float):
            yield node
        for child in node.values():
            yield from _entries(child)
    elif isinstance(node, list) and node and isinstance(node[0], Mapping | list):
        for child in node:
            yield from _entries(child)


def _pointed(document: Mapping[str, Any], pointer: str) -> float:
    node: Any = document
    for part in pointer.split("/")[1:]:
        key = part.replace("~1", "/").replace("~0", "~")
        if isinstance(node, Mapping) and key in node:
            node = node[key]
        elif isinstance(node, list) and key.isdecimal() and int(key) < len(node):
            node = node[int(key)]
        else:
            raise NotFound("quantity", pointer, f"nothing is at {key!r}")
    if isinstance(node, bool) or not isinstance(node, int | float) or not isfinite(node):
        raise NotFound("quantity", pointer, "no number is there")
    return float(node)
