"""Rewriting of JSON schemas so that linters and generators of clients read them in one way.

One name and one title for each schema of the components; no titles below them, because generators name types by them;
arrays always with `items`; files as binary.
"""

import re
from collections.abc import Mapping
from typing import Any

Schema = dict[str, Any]
PREFIX = "#/components/schemas/"
DATA = frozenset(("default", "example", "examples", "const", "enum"))
"""Keys whose value is data and no schema."""
BINARY = "application/octet-stream"


def plain_name(name: str) -> str:
    """Return the name of a schema in letters and digits, as types of programming languages have it.

    What a schema means in answers keeps the model's name, in requests it gets `Input` behind it. Of two models with one
    name, each has the last two parts of its module in front.
    """
    if "__" in name:
        *modules, own = name.split("__")
        name = "".join(map(camel, modules[-2:])) + own
    return re.sub(r"\W", "", name.removesuffix("-Output").replace("Body_", ""))


def camel(name: str) -> str:
    """Return a name of parts, `static_run`, as the name of a type, `StaticRun`."""
    return "".join(part[:1].upper() + part[1:] for part in name.split("_"))


def renamed(node: Any, names: Mapping[str, str]) -> Any:
    """Return a copy of a document in which every reference to a schema of the components has that schema's new name."""
    if isinstance(node, dict):
        return {key: _led(key, child, names) for key, child in node.items()}
    return [renamed(child, names) for child in node] if isinstance(node, list) else node


def _led(key: str, child: Any, names: Mapping[str, str]) -> Any:
    if key == "$ref" and isinstance(child, str) and child.startswith(PREFIX):
        old = child.removeprefix(PREFIX)
        return PREFIX + names.get(old, old)
    return renamed(child, names)


def component(name: str, schema: Schema) -> Schema:
    """Return a copy of a schema of the components in the form that generators read, with its name as its only title."""
    return {"title": name, **tidy(schema)}


def tidy(schema: Any) -> Any:
    """Return a copy of a schema without titles, its arrays with `items`, its files as binary; in what it contains
    too.
    """
    if isinstance(schema, list):
        return [tidy(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    made = {key: _inside(key, child) for key, child in schema.items() if not (key == "title" and _is_text(child))}
    if made.pop("contentMediaType", None) == BINARY:
        made["format"] = "binary"
    if made.get("type") == "array":
        _with_items(made)
    return made


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _inside(key: str, child: Any) -> Any:
    if key in DATA:
        return child
    if key in ("properties", "$defs", "patternProperties"):
        return {name: tidy(one) for name, one in child.items()}
    return tidy(child)


def _with_items(array: Schema) -> None:
    """Say of an array of a fixed length what each of its items may be, also for those who do not know `prefixItems`."""
    places = array.get("prefixItems")
    if places is None:
        array.setdefault("items", {})
        return
    kinds = [place for number, place in enumerate(places) if place not in places[:number]]
    if len(kinds) == 1:
        del array["prefixItems"]
    array["items"] = kinds[0] if len(kinds) == 1 else {"anyOf": kinds}
