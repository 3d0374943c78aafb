"""The pages of result and campaign documents, made from the schemas of the API: `make references` writes them."""

import json
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from procedures import catalog, methods

PREFIX = "#/components/schemas/"
DOCS = Path(__file__).parents[2] / "docs"
RESULTS = DOCS / "results.md"
CAMPAIGNS = DOCS / "campaign-document.md"
_RESULT_HEAD = """# Result documents

Made from the schemas of the API by `make references`; a test compares it. Every result has the same head; its
`document` depends on the procedure or method, by `name`. A field that ends in a unit (`_s`, `_deg_h`, `_m_s2`) is in
that unit; other values have a field `unit` with them. `null` means: not known, or not asked for. Later versions may add
fields, and keep those that there are.

Read a result with `GET /api/v1/results/{id}`, `bench results ID --json`, or as an object by the Python client, whose
classes are made from the same schemas.

"""
_CAMPAIGN_HEAD = """# Campaign documents

Made from the schemas of the API by `make references`; a test compares it. A campaign is a JSON document: `bench
campaign show NAME` prints one, `bench campaign add FILE` stores one, `POST /api/v1/campaigns` takes one. Every step
has a procedure or a method, limits and trends; [a bench left alone](a-bench-left-alone.md) says how steps, gates and
verdicts work. The report of a run is `GET /api/v1/campaign-runs/{id}/report`.

"""


def document() -> dict[str, Any]:
    """Return the OpenAPI document as the command line prints it, by a process of its own."""
    run = subprocess.run([sys.executable, "-m", "bench_service", "openapi"], capture_output=True, text=True, check=True)
    return json.loads(run.stdout)


def results_page(schemas: Mapping[str, Any]) -> str:
    """The page of results: the head, each procedure's and method's document, and the parts that they contain."""
    titles = {name: entry.title for name, entry in {**catalog.discover(), **methods.discover()}.items()}
    mapping = schemas["ResultView"]["discriminator"]["mapping"]
    documents = {name: _inside(schemas[_target(ref)]["properties"]["document"]) for name, ref in mapping.items()}
    head = schemas[_target(next(iter(mapping.values())))]
    fields = {name: field for name, field in head["properties"].items() if name != "document"}
    fields |= {name: {"type": "string", "description": fields[name]["description"]} for name in ("kind", "name")}
    lines = [_RESULT_HEAD, "## Head of every result\n\n", _rows({"properties": fields}), "\n## Documents\n"]
    for name, (schema,) in documents.items():
        lines += [f"\n### {name}\n\n{titles[name]}. {_sentence(schemas[schema])}\n\n", _rows(schemas[schema])]
    roots = {one for found in documents.values() for one in found}
    lines += ["\n## Parts\n", *_parts(schemas, roots | set(_inside(fields)), roots)]
    return "".join(lines)


def campaigns_page(schemas: Mapping[str, Any]) -> str:
    """The page of campaigns: the document, the report of a run, and the parts of both."""
    lines = [_CAMPAIGN_HEAD]
    roots = {"Campaign", "CampaignReport"}
    for name in sorted(roots):
        lines += [f"## {name}\n\n{_sentence(schemas[name])}\n\n", _rows(schemas[name]), "\n"]
    return "".join([*lines, "## Parts\n", *_parts(schemas, roots, roots)])


def _parts(schemas: Mapping[str, Any], begin: set[str], without: set[str]) -> Iterator[str]:
    found, left = set[str](), list(begin)
    while left:
        name = left.pop()
        if name not in found and name in schemas:
            found.add(name)
            left += _inside(schemas[name])
    for name in sorted(found - without):
        if "oneOf" not in schemas[name]:
            shown = _rows(schemas[name]) if "properties" in schemas[name] else f"{_kind(schemas[name])}\n"
            yield f"\n### {name}\n\n{_sentence(schemas[name])}\n\n{shown}"


def _rows(schema: Mapping[str, Any]) -> str:
    fields = schema.get("properties", {})
    rows = [
        f"| `{name}` | {_kind(field)} | {_capital(field.get('description', ''))} |\n" for name, field in fields.items()
    ]
    return "| field | type | meaning |\n|---|---|---|\n" + "".join(rows) if rows else "It has no fields.\n"


def _kind(schema: Mapping[str, Any]) -> str:
    """Return a schema as a short word, with links to parts."""
    if "$ref" in schema:
        name = _target(schema["$ref"])
        return f"[{name}](#{name.lower()})"
    if "const" in schema or "enum" in schema:
        return " or ".join(f"`{one}`" for one in schema.get("enum", [schema.get("const")]))
    if "anyOf" in schema:
        return " or ".join(dict.fromkeys(_kind(one) for one in schema["anyOf"]))
    if schema.get("type") == "array":
        return f"list of {_kind(schema.get('items') or {})}"
    if schema.get("type") == "object":
        values = schema.get("additionalProperties")
        return f"map to {_kind(values)}" if isinstance(values, dict) and values else "object"
    return str(schema.get("format", schema.get("type", "any")))


def _inside(node: Any) -> list[str]:
    if isinstance(node, dict):
        own = [_target(node["$ref"])] if isinstance(node.get("$ref"), str) else []
        return own + [name for child in node.values() for name in _inside(child)]
    return [name for child in node for name in _inside(child)] if isinstance(node, list) else []


def _target(reference: str) -> str:
    return reference.removeprefix(PREFIX)


def _sentence(schema: Mapping[str, Any]) -> str:
    return _cell(schema.get("description", "").split("\n\n")[0])


def _capital(text: str) -> str:
    """Return a meaning that begins as a sentence does, unless its first word is a name of ours."""
    cell = _cell(text)
    return cell if cell.split(":")[0].isidentifier() or not cell[:2].islower() else cell[0].upper() + cell[1:]


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("``", "`")


if __name__ == "__main__":
    made = document()["components"]["schemas"]
    RESULTS.write_text(results_page(made), encoding="utf-8")
    CAMPAIGNS.write_text(campaigns_page(made), encoding="utf-8")
