"""The OpenAPI document as it is served: the framework's, with what it does not know of this service."""

from collections.abc import Callable
from typing import Any

from fastapi import FastAPI

from bench_service.api.http.errors import Problem
from bench_service.api.openapi.access import SCHEMES, declare_security
from bench_service.api.openapi.field_words import describe
from bench_service.api.openapi.result_schemas import REFERENCE, add_results
from bench_service.api.openapi.schemas import PREFIX, Schema, component, plain_name, renamed, tidy
from bench_service.evidence.catalogue import Catalogue
from bench_service.formats.description import ImportDescription

TAGS = {
    "procedures": "What the bench can do: procedures, methods, and previews of a plan before anything moves.",
    "jobs": "Executions of a procedure on a unit: submit, watch, pause, cancel, read the result.",
    "recordings": "Raw samples: of jobs, or imported from files; lists and exports.",
    "analyses": "Results: of jobs, and of methods that are run on what is stored.",
    "units": "Units under test: their records, calibrations and corrections.",
    "benches": "Benches: state, queue, software stops.",
    "reservations": "Benches and units that are kept free for a client until a moment.",
    "mountings": "Units on plates of benches, and the azimuth that was read for each.",
    "manual mode": "A bench driven by hand under a lease: demands one by one, within the limits.",
    "campaigns": "Sequences of jobs with limits, their runs, schedules and trends.",
    "access": "The session of a request, accounts of people, tokens of programs, approvals of procedures.",
    "audit": "The audit trail: every request that may have changed something.",
    "health": "Probes and counts for programs that watch the service.",
}
UPLOAD = "RecordingUpload"
INFO: Schema = {
    "contact": {"name": "The operators of this bench"},
    "license": {"name": "MIT", "identifier": "MIT"},
    "description": (
        "Lists are newest first and come in pages: pass `next` as `after` for the page behind. HEAD answers as GET, "
        "without the body. An unknown name in a query is refused. Errors are problem documents (RFC 9457)."
    ),
}


def install(app: FastAPI, catalogue: Callable[[], Catalogue]) -> None:
    """Have an application serve the completed document. `catalogue` is asked when the document is first wanted: to read
    it takes long.
    """
    made = app.openapi

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            app.openapi_schema = completed(made(), catalogue())
        return app.openapi_schema

    app.openapi = openapi


def completed(document: Schema, catalogue: Catalogue) -> Schema:
    """Return the framework's document with servers, tags, access, problems, files, and the results' own schemas."""
    own: dict[str, Schema] = dict(document["components"]["schemas"])
    for model in (Problem, ImportDescription):
        extra = model.model_json_schema(ref_template=REFERENCE)
        own |= {f"{name}-Input" if f"{name}-Input" in own else name: s for name, s in extra.pop("$defs", {}).items()}
        own[model.__name__] = extra
    names = _names(own)
    schemas = {names[name]: component(names[name], renamed(schema, names)) for name, schema in own.items()}
    documents = add_results(schemas, catalogue)
    paths = renamed(_tidy_paths(document["paths"]), names)
    _describe_upload(paths, schemas)
    describe(schemas, documents)
    declare_security(paths)
    return {
        **document,
        "info": {**document["info"], **INFO},
        "servers": [{"url": "/", "description": "The service that this document came from"}],
        "tags": [{"name": name, "description": text} for name, text in TAGS.items()],
        "paths": paths,
        "components": {
            **document["components"],
            "schemas": dict(sorted(schemas.items())),
            "securitySchemes": SCHEMES,
        },
    }


def _names(schemas: dict[str, Schema]) -> dict[str, str]:
    names = {name: plain_name(name) for name in schemas}
    names["Body_import_recording"] = UPLOAD
    names["Body_describe_file"] = "FileToDescribe"
    names["Body_check_certificate_file"] = "CertificateToCheck"
    return names


def _tidy_paths(paths: Schema) -> Schema:
    """Copy the operations with the schemas of their parameters, bodies and answers without titles."""
    return {path: {method: _tidy(operation) for method, operation in item.items()} for path, item in paths.items()}


def _tidy(node: Any) -> Any:
    if isinstance(node, list):
        return [_tidy(one) for one in node]
    if not isinstance(node, dict):
        return node
    return {key: tidy(child) if key == "schema" else _tidy(child) for key, child in node.items()}


def _describe_upload(paths: Schema, schemas: dict[str, Schema]) -> None:
    """Say of the form with files that its description is a JSON document of a known schema."""
    body = schemas[UPLOAD]
    body["description"] = "Files, and the description of what is in them."
    body["properties"]["description"] = {"$ref": f"{PREFIX}{ImportDescription.__name__}"}
    form = paths["/api/v1/recordings"]["post"]["requestBody"]["content"]["multipart/form-data"]
    form["encoding"] = {"description": {"contentType": "application/json"}}
