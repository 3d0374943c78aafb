"""Write the modules of `bench_client/results` from a service's OpenAPI document: a class for each part of a result.

    python client/generate_results.py openapi.json

A schema that one result alone uses goes into that result's module, what two use into `shared_by_two.py`, what more use
into `shared.py`. A test writes them again and compares.
"""

import json
import re
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent / "bench_client" / "results"
PREFIX = "#/components/schemas/"
PLAIN = {"string": "str", "number": "float", "integer": "int", "boolean": "bool", "null": "None"}
WIDTH = 116
SHARED = {
    "shared": "Parts that three results or more have in common.",
    "shared_by_two": "Parts that two results have in common.",
}
Schemas = dict[str, dict[str, Any]]


def modules(document: dict[str, Any]) -> dict[str, str]:
    """Return the text of each generated module by its file name, from an OpenAPI document."""
    schemas: Schemas = document["components"]["schemas"]
    names: dict[str, str] = schemas["ResultView"]["discriminator"]["mapping"]
    roots = {name: reference.removeprefix(PREFIX) for name, reference in names.items()}
    documents = {name: _document(schemas[root]) for name, root in roots.items()}
    needed = {name: list(dict.fromkeys(_needed(schemas, document))) for name, document in documents.items()}
    users: dict[str, int] = {}
    for parts in needed.values():
        for part in parts:
            users[part] = users.get(part, 0) + 1
    places = {part: {1: "", 2: "shared_by_two"}.get(number, "shared") for part, number in users.items()}
    made = {
        f"{place}.py": _module(summary, schemas, [part for part in users if places[part] == place], places, place)
        for place, summary in SHARED.items()
    }
    for name, parts in needed.items():
        own = [part for part in parts if not places[part]]
        own_class = _result_class(name, roots[name], schemas[roots[name]])
        made[f"{name}.py"] = _module(f"Result of `{name}`.", schemas, own, places, last=own_class)
    made["__init__.py"] = _index(roots)
    return made


def _document(result: dict[str, Any]) -> str:
    """Return the name of the schema of a result's document; a procedure and a method may have one in common."""
    return result["properties"]["document"]["$ref"].removeprefix(PREFIX)


def _needed(schemas: Schemas, name: str) -> Iterator[str]:
    """Yield a schema after all that it refers to."""
    for reference in _references(schemas[name]):
        yield from _needed(schemas, reference)
    yield name


def _references(node: Any) -> Iterator[str]:
    if isinstance(node, dict):
        if isinstance(node.get("$ref"), str):
            yield node["$ref"].removeprefix(PREFIX)
        for child in node.values():
            yield from _references(child)
    if isinstance(node, list):
        for child in node:
            yield from _references(child)


def _module(
    summary: str, schemas: Schemas, parts: list[str], places: dict[str, str], here: str = "", last: str = ""
) -> str:
    """Return the text of a module; what stands in the module of another place is imported from there."""
    body = "\n\n".join([*(_class(part, schemas[part]) for part in parts), *([last] if last else [])])
    used = [n for n, place in sorted(places.items()) if place not in ("", here) and re.search(rf"\b{n}\b", body)]
    head = f'"""{summary} Written by `generate_results.py`; do not edit."""\n\n'
    head += "from datetime import datetime\n" if re.search(r"\bdatetime\b", body) else ""
    words = [word for word in ("Any", "Literal") if re.search(rf"\b{word}\b", body)]
    head += f"from typing import {', '.join(words)}\n\n" if words else "\n"
    bases = "Part, ResultHead" if last else "Part"
    head += f"from bench_client.results.part import {bases}\n"
    head += "".join(f"from bench_client.results.{places[name]} import {name}\n" for name in used)
    return f"{head}\n\n{body}\n"


def _class(name: str, schema: dict[str, Any]) -> str:
    if "enum" in schema:
        return f"{name} = Literal[{', '.join(json.dumps(value) for value in schema['enum'])}]\n"
    required = schema.get("required", [])
    lines = [f"class {name}(Part):", _docstring(schema.get("description", f"The part {name} of a result."))]
    for field, inside in schema.get("properties", {}).items():
        kind, default = _kind(inside), "" if field in required else f" = {_default(inside)}"
        kind += " | None" if default == " = None" and "None" not in kind else ""
        lines.append(f"    {field}: {kind}{default}")
        if inside.get("description"):
            lines.append(_docstring(inside["description"]))
    return "\n".join(lines) + "\n"


def _docstring(text: str) -> str:
    """Format a description as a docstring, its paragraphs wrapped."""
    paragraphs = ["\n".join(textwrap.wrap(" ".join(one.split()), WIDTH - 8)) for one in text.split("\n\n")]
    whole = "\n\n".join(paragraphs).replace("\\", "\\\\").replace('"""', "'''")
    whole = whole + " " if whole.endswith('"') else whole
    end = '"""' if "\n" not in whole else '\n"""'
    return textwrap.indent(f'"""{whole}{end}', "    ")


def _kind(schema: dict[str, Any]) -> str:
    """Return a schema as a type of Python."""
    if "$ref" in schema:
        return schema["$ref"].removeprefix(PREFIX)
    if "const" in schema or "enum" in schema:
        return f"Literal[{', '.join(json.dumps(v) for v in schema.get('enum', [schema.get('const')]))}]"
    if "anyOf" in schema:
        return " | ".join(dict.fromkeys(_kind(one) for one in schema["anyOf"]))
    if schema.get("type") == "array":
        if "prefixItems" in schema:
            return f"tuple[{', '.join(_kind(one) for one in schema['prefixItems'])}]"
        return f"tuple[{_kind(schema['items'])}, ...]"
    if schema.get("type") == "object":
        more = schema.get("additionalProperties")
        return f"dict[str, {_kind(more) if isinstance(more, dict) and more else 'Any'}]"
    if schema.get("format") == "date-time":
        return "datetime"
    return PLAIN.get(schema.get("type", ""), "Any")


def _default(schema: dict[str, Any]) -> str:
    value = schema.get("default")
    return repr(tuple(value)) if isinstance(value, list) else repr(value) if not isinstance(value, dict) else "{}"


def _result_class(name: str, title: str, schema: dict[str, Any]) -> str:
    kind = schema["properties"]["kind"]["const"]
    return (
        f"class {title}(ResultHead):\n{_docstring(schema['description'])}\n"
        f'    kind: Literal["{kind}"]\n    name: Literal["{name}"]\n    document: {_document(schema)}\n'
    )


def _index(roots: dict[str, str]) -> str:
    imports = "".join(f"from bench_client.results.{name} import {root}\n" for name, root in sorted(roots.items()))
    return f'''"""Results as objects, a class for each procedure or method. By `generate_results.py`; do not edit."""

from typing import Any

{imports}from bench_client.results.part import OtherResult, ResultHead

Result = (
    {chr(10).join(f"    | {root}" for root in roots.values()).lstrip(" |")}
    | OtherResult
)
"""A result; `isinstance` or `match` says which, and then its `document` has fields of its own."""
CLASSES: dict[str, type[ResultHead]] = {{
{chr(10).join(f'    "{name}": {root},' for name, root in roots.items())}
}}


def result_of_document(document: dict[str, Any]) -> Result:
    """Make an object of a result's JSON document, by its name; of one that is not known here, an `OtherResult`."""
    return CLASSES.get(str(document.get("name")), OtherResult).model_validate(document)  # pyright: ignore
'''


if __name__ == "__main__":
    for file, text in modules(json.loads(Path(sys.argv[1]).read_text())).items():
        (FOLDER / file).write_text(text)
