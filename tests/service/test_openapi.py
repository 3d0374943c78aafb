"""The OpenAPI document: whole in itself, and what the service does is what it says."""

import re
import socket
import tomllib
from collections.abc import Callable, Generator, Iterator
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import httpx
import pytest

from bench_service.api.openapi import field_words
from bench_service.cli.processes.serving import serving
from bench_service.settings import Settings
from tests.kit.kept_document import keeps_to_document
from tests.kit.reference_pages import CAMPAIGNS, RESULTS, campaigns_page, results_page

METHODS = ("get", "put", "post", "delete", "patch")
PROBLEM = {"$ref": "#/components/schemas/Problem"}


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Generator[str]:
    """The service on a loopback port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    file = tmp_path_factory.mktemp("served") / "bench.sqlite"
    with serving(Settings(database_url=f"sqlite:///{file}", port=port)):
        yield f"http://127.0.0.1:{port}"


@pytest.fixture(scope="module")
def document(address: str) -> dict[str, Any]:
    return httpx.get(f"{address}/openapi.json", timeout=60).json()


def operations(document: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for path, item in document["paths"].items():
        for method in METHODS:
            if method in item:
                yield f"{method.upper()} {path}", item[method]


def test_every_operation_has_a_name_of_its_own_and_says_what_it_does(document: dict[str, Any]) -> None:
    named = dict(operations(document))
    names = [operation["operationId"] for operation in named.values()]
    assert len(names) == len(set(names)) >= 20
    assert all(re.fullmatch(r"[a-z][a-z_]*", name) for name in names)
    assert [where for where, operation in named.items() if not operation.get("description")] == []


def test_every_error_is_a_problem_document(document: dict[str, Any]) -> None:
    wrong = [
        f"{where} {status}"
        for where, operation in operations(document)
        for status, response in operation["responses"].items()
        if int(status) >= 400 and response.get("content") != {"application/problem+json": {"schema": PROBLEM}}
    ]
    assert wrong == []


def test_every_good_answer_with_json_is_modelled(document: dict[str, Any]) -> None:
    for where, operation in operations(document):
        for status, response in operation["responses"].items():
            schema = response.get("content", {}).get("application/json", {}).get("schema")
            if int(status) < 300 and schema is not None:
                assert "$ref" in schema or "$ref" in schema.get("items", {}), where


def without(document: dict[str, Any], status: str, may_give_it: Callable[[str, dict[str, Any]], bool]) -> list[str]:
    """The operations that may give a status and do not say so."""
    return [
        where
        for where, operation in operations(document)
        if may_give_it(where, operation) and status not in operation["responses"]
    ]


def test_every_path_parameter_answers_for_an_id_that_is_none(document: dict[str, Any]) -> None:
    assert without(document, "404", lambda where, _: "{" in where and not where.startswith("PUT")) == []


@pytest.mark.parametrize("status", ["400", "422", "503"])
def test_every_operation_says_that_an_address_may_be_refused_and_the_database_fail(
    document: dict[str, Any], status: str
) -> None:
    assert without(document, status, lambda *_: True) == []


def test_every_operation_that_writes_says_that_the_disk_may_be_full(document: dict[str, Any]) -> None:
    assert without(document, "507", lambda where, _: not where.startswith("GET") and "preview" not in where) == []


def test_every_operation_that_takes_a_document_says_that_it_may_be_too_long(document: dict[str, Any]) -> None:
    def takes_a_document(_where: str, operation: dict[str, Any]) -> bool:
        return bool(
            {"application/json", "multipart/form-data"} & set(operation.get("requestBody", {}).get("content", {}))
        )

    assert without(document, "413", takes_a_document) == []
    says_so = [where for where, operation in operations(document) if "413" in operation["responses"]]
    assert len(says_so) == sum(takes_a_document(where, operation) for where, operation in operations(document))


def references(node: Any) -> Iterator[str]:
    if isinstance(node, dict):
        if isinstance(node.get("$ref"), str):
            yield node["$ref"]
        for child in node.values():
            yield from references(child)
    if isinstance(node, list):
        for child in node:
            yield from references(child)


def test_every_reference_and_every_link_leads_somewhere(document: dict[str, Any]) -> None:
    found = set(references(document))
    assert "#/components/schemas/Problem" in found
    for reference in found:
        node: Any = document
        for part in reference.removeprefix("#/").split("/"):
            node = node[part]
        assert node
    names = {operation["operationId"] for _, operation in operations(document)}
    links = [
        link["operationId"]
        for _, operation in operations(document)
        for response in operation["responses"].values()
        for link in response.get("links", {}).values()
    ]
    assert links
    assert set(links) <= names


@pytest.mark.timeout(240)
def test_the_service_keeps_to_its_document_at_the_edges_of_every_schema(address: str, tmp_path: Path) -> None:
    """The deterministic phase; `make validate` sends random data and follows links (`tests.validation.document`)."""
    pytest.importorskip("schemathesis")
    done = keeps_to_document(address, tmp_path, ("coverage",))
    assert done.returncode == 0, done.stdout[done.stdout.find("= FAILURES =") :][:9000] + done.stderr[-2000:]


def schemas_in(node: Any) -> Iterator[dict[str, Any]]:
    """Every schema of a document: of the components, and of parameters, bodies and answers, with what they contain."""
    if isinstance(node, list):
        for child in node:
            yield from schemas_in(child)
    if isinstance(node, dict):
        if node.keys() & {"type", "$ref", "anyOf", "oneOf", "allOf", "enum", "const"} and not isinstance(
            node.get("type"), dict
        ):
            yield node
        for key, child in node.items():
            if key not in ("default", "example", "examples", "const", "enum", "discriminator"):
                yield from schemas_in(child)


def test_each_schema_has_one_name_that_is_its_only_title(document: dict[str, Any]) -> None:
    components = document["components"]["schemas"]
    assert [name for name in components if not re.fullmatch(r"[A-Z][A-Za-z0-9]*", name)] == []
    assert {name: schema["title"] for name, schema in components.items()} == {name: name for name in components}
    titles = [schema["title"] for schema in schemas_in(document) if isinstance(schema.get("title"), str)]
    assert sorted(titles) == sorted(components), "a title below the components would name a second type"


def test_every_list_says_what_is_in_it(document: dict[str, Any]) -> None:
    lists = [schema for schema in schemas_in(document) if schema.get("type") == "array"]
    assert len(lists) > 100
    assert [schema for schema in lists if not isinstance(schema.get("items"), dict)] == []


def test_the_document_says_where_it_is_served_who_may_ask_and_what_its_tags_are(document: dict[str, Any]) -> None:
    assert [server["url"] for server in document["servers"]] == ["/"]
    assert document["info"]["license"]["identifier"] == "MIT"
    assert document["info"]["contact"]
    used = {tag for _, operation in operations(document) for tag in operation["tags"]}
    assert used == {tag["name"] for tag in document["tags"] if tag["description"]}
    named = {name for _, operation in operations(document) for way in operation["security"] for name in way}
    assert named == set(document["components"]["securitySchemes"]) != set()


def test_each_schema_is_used(document: dict[str, Any]) -> None:
    found = {reference.rpartition("/")[2] for reference in references(document)}
    by_themselves = {"EventView", "BenchLive"}
    assert set(document["components"]["schemas"]) - found <= by_themselves


def test_files_and_samples_are_binary_and_the_description_of_files_is_a_schema(document: dict[str, Any]) -> None:
    form = document["paths"]["/api/v1/recordings"]["post"]["requestBody"]["content"]["multipart/form-data"]
    upload = document["components"]["schemas"][form["schema"]["$ref"].rpartition("/")[2]]["properties"]
    assert upload["files"]["items"] == {"type": "string", "format": "binary"}
    assert upload["description"]["$ref"] == "#/components/schemas/ImportDescription"
    assert form["encoding"]["description"]["contentType"] == "application/json"
    data = document["paths"]["/api/v1/recordings/{recording_id}/data"]["get"]["responses"]["200"]["content"]
    assert len(data) == 4
    assert all(body["schema"] == {"type": "string", "format": "binary"} for body in data.values())
    assert "contentMediaType" not in str(document)


def test_each_procedure_and_method_has_a_schema_of_its_result(document: dict[str, Any], address: str) -> None:
    catalogue = {
        (kind, entry["name"]): entry
        for kind, path in (("procedure", "procedures"), ("method", "methods"))
        for entry in httpx.get(f"{address}/api/v1/{path}", timeout=60).json()
    }
    schemas = document["components"]["schemas"]
    mapping: dict[str, str] = schemas["ResultView"]["discriminator"]["mapping"]
    assert [one["$ref"] for one in schemas["ResultView"]["oneOf"]] == list(mapping.values())
    assert set(mapping) == {name for _, name in catalogue}
    for (kind, name), entry in catalogue.items():
        properties = schemas[mapping[name].rpartition("/")[2]]["properties"]
        assert (properties["kind"]["const"], properties["name"]["const"]) == (kind, name)
        body = schemas[properties["document"]["$ref"].rpartition("/")[2]]
        assert set(body["properties"]) == set(entry["result"]["properties"])
        assert body["required"] == entry["result"]["required"]


def test_every_field_has_a_description(document: dict[str, Any]) -> None:
    schemas = document["components"]["schemas"]
    bare = [
        f"{name}.{field}"
        for name, schema in schemas.items()
        for field, inside in schema.get("properties", {}).items()
        if not inside.get("description", "").strip()
    ]
    assert not bare, f"give the field a description, or write one into openapi/field_words.toml: {bare}"
    headless = ("Of ", "Who ", "Whoever ", "Whose ", "What he ", "Those ")
    described = [inside for one in schemas.values() for inside in one.get("properties", {}).values()]
    assert [inside["description"] for inside in described if inside["description"].startswith(headless)] == []


def test_every_entry_of_the_table_of_descriptions_describes_a_field(document: dict[str, Any]) -> None:
    """An entry is in use where a field that its key fits, and no more special key, has its text."""
    table: dict[str, str] = tomllib.loads(Path(field_words.__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    used = set[str]()
    for name, schema in document["components"]["schemas"].items():
        for field, inside in schema.get("properties", {}).items():
            patterns = [key for key in table if "*" in key and fnmatchcase(f"{name}.{field}", key)]
            key = next((key for key in (f"{name}.{field}", *patterns, field) if key in table), None)
            if key is not None and inside["description"].startswith(table[key].rstrip(".")):
                used.add(key)
    assert table.keys() - used == set()


def test_the_pages_of_result_and_campaign_documents_are_those_of_the_schemas(document: dict[str, Any]) -> None:
    schemas = document["components"]["schemas"]
    assert RESULTS.read_text(encoding="utf-8") == results_page(schemas), "run `make references`"
    assert CAMPAIGNS.read_text(encoding="utf-8") == campaigns_page(schemas), "run `make references`"
