"""Schemas of results: one for each procedure and method, told apart by the result's `name`."""

from collections.abc import Iterable
from typing import Any

from pydantic.json_schema import models_json_schema

from bench_service.api.openapi.schemas import PREFIX, Schema, camel, component, plain_name, renamed
from bench_service.evidence.catalogue import AnyMethod, AnyProcedure, Catalogue

RESULT = "ResultView"
REFERENCE = PREFIX + "{model}"


def add_results(schemas: dict[str, Schema], catalogue: Catalogue) -> dict[str, type]:
    """Replace the general schema of a result by one of as many as there are procedures and methods. Return the classes
    of their documents by the names of the documents' schemas.

    Each schema is the general one with a fixed `kind` and `name`, and with the schema of its own `document`.
    """
    general = schemas[RESULT]
    kinds = {"procedure": catalogue.procedures, "method": catalogue.methods}
    documents = _documents(schemas, [entry for entries in kinds.values() for entry in entries.values()])
    mapping: dict[str, str] = {}
    for kind, entries in kinds.items():
        for entry in entries.values():
            name = f"{camel(entry.name)}Result"
            schemas[name] = _result(general, name, kind, entry, documents[entry.name])
            mapping[entry.name] = PREFIX + name
    schemas[RESULT] = {
        "title": RESULT,
        "description": f"{general['description']} Its `name` says which of these it is.",
        "oneOf": [{"$ref": reference} for reference in mapping.values()],
        "discriminator": {"propertyName": "name", "mapping": mapping},
    }
    return {documents[name]: entry.result for entries in kinds.values() for name, entry in entries.items()}


def _result(general: Schema, name: str, kind: str, entry: AnyProcedure | AnyMethod, document: str) -> Schema:
    properties = {
        **general["properties"],
        "kind": {"type": "string", "const": kind},
        "name": {"type": "string", "const": entry.name},
        "document": {"$ref": PREFIX + document},
    }
    return {**general, "title": name, "description": f"A result: {entry.title}.", "properties": properties}


def _documents(schemas: dict[str, Schema], entries: Iterable[AnyProcedure | AnyMethod]) -> dict[str, str]:
    """Add the schemas of all documents and of what they contain; return the name of each entry's own, by the entry's.

    A schema that the API has under the same name is shared where both say the same; else the result's gets a name of
    its own. Answers may have more fields in a later version, so none of these schemas excludes them.
    """
    roots = [(entry.result, "serialization") for entry in entries]
    found, together = models_json_schema(roots, ref_template=REFERENCE)  # pyright: ignore[reportArgumentType]
    parts: dict[str, Any] = together["$defs"]
    own = {entry.name: found[entry.result, "serialization"]["$ref"].removeprefix(PREFIX) for entry in entries}
    names = {part: plain_name(part) for part in parts}
    names |= {part: f"{camel(name)}Document" for name, part in reversed(own.items())}  # the first of several names it
    for part, name in names.items():
        made = _open(component(name, renamed(parts[part], names)))
        if name in schemas and schemas[name] != made:
            names[part] = f"Result{name}"
    for part, name in names.items():
        schemas[name] = _open(component(name, renamed(parts[part], names)))
    return {name: names[part] for name, part in own.items()}


def _open(node: Any) -> Any:
    """Copy a schema of an answer as the framework writes it: further fields are allowed, a default null is not said."""
    if isinstance(node, list):
        return [_open(one) for one in node]
    if not isinstance(node, dict):
        return node
    unsaid = {"additionalProperties": False, "default": None}
    return {key: _open(child) for key, child in node.items() if not (key in unsaid and child is unsaid[key])}
