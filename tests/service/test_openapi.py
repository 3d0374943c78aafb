"""The OpenAPI document: whole in itself, and what the service does is what it says."""

import re
import socket
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from bench_service.cli.serving import serving
from bench_service.settings import Settings

METHODS = ("get", "put", "post", "delete", "patch")
PROBLEM = {"$ref": "#/components/schemas/Problem"}
CHECKS = (
    "not_a_server_error",
    "status_code_conformance",
    "content_type_conformance",
    "response_headers_conformance",
    "response_schema_conformance",
    "unsupported_method",
)


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
def test_the_service_keeps_to_its_document_whatever_it_is_sent(address: str, tmp_path: Path) -> None:
    pytest.importorskip("schemathesis")
    command = Path(sys.executable).with_name("schemathesis")
    arguments = ["run", f"{address}/openapi.json", "--checks", ",".join(CHECKS)]
    arguments += ["--exclude-path", "/api/v1/feed"]  # a stream without an end
    arguments += ["--phases", "coverage,fuzzing,stateful", "--max-examples", "15", "--seed", "1"]
    done = subprocess.run([command, *arguments], capture_output=True, text=True, timeout=220, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-2000:]
