"""A body holds what UTF-8 and every database can hold, and is of a bounded length; nothing else is stored."""

import json
from collections.abc import Iterator
from typing import Any

import httpx
import pytest
from fastapi import Request

from bench_service.api.http.bodies import BODY_BYTES
from bench_service.api.http.errors import FieldError, respond
from bench_service.campaigns.campaign import Campaign
from bench_service.formats.plain_json import DEPTH
from bench_service.persistence import open_stores
from bench_service.telemetry.audit import record
from bench_service.wall_clock import now
from tests.service.campaigns import named
from tests.service.client import Client

JSON = {"Content-Type": "application/json"}
IGNORED = {"procedure": "not_yet", "optional": True}
"""A step that is left out, so nothing but the rule looks at its parameters."""
UNFIT = {
    "half of a pair": (r'"\ud800"', "\\ud800", "half of a surrogate pair"),
    "half of a pair, as bytes": (b'"\xed\xa0\x80"', "\\ud800", "half of a surrogate pair"),
    "NUL": (r'"a\u0000b"', "a\\u0000b", "the character NUL"),
    "NaN": ("NaN", "nan", "finite number"),
    "infinite": ("-1e999", "-inf", "finite number"),
    "400 digits": ("1" + "0" * 400, "1" + "0" * 199 + "…", "finite number"),
}


def put_in(campaign: dict[str, Any], value: str | bytes) -> bytes:
    """A campaign's text with a value where it has the word HERE."""
    raw = value if isinstance(value, bytes) else value.encode()
    return json.dumps(campaign).encode().replace(b'"HERE"', raw)


def nested(levels: int) -> str:
    return "[" * levels + "]" * levels


def refused(answer: httpx.Response, status: int = 422) -> dict[str, Any]:
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    return answer.json()


def assert_lists_answer(client: Client) -> None:
    for path in ("campaigns", "jobs", "audit", "benches"):
        assert client.http.get(f"/api/v1/{path}").status_code == 200, path


@pytest.fixture(scope="module")
def documents(client: Client) -> list[tuple[str, str]]:
    """Method and path of every operation that takes a JSON document, for an id that is none."""
    found: list[tuple[str, str]] = []
    for path, item in client.http.get("/openapi.json").json()["paths"].items():
        for method, operation in item.items():
            if "application/json" in operation.get("requestBody", {}).get("content", {}):
                address = path
                for parameter in operation.get("parameters", ()):
                    address = address.replace(f"{{{parameter['name']}}}", "none")
                found.append((method.upper(), address))
    assert len(found) >= 14
    return found


@pytest.mark.parametrize("case", UNFIT)
def test_what_not_everything_can_hold_is_refused_by_field_and_not_stored(client: Client, case: str) -> None:
    sent, shown, allowed = UNFIT[case]
    body = put_in(named("unfit", {**IGNORED, "parameters": {"a": [0, "HERE"]}}), sent)
    (error,) = refused(client.http.post("/api/v1/campaigns", content=body, headers=JSON))["errors"]
    assert (error["field"], error["value"]) == ("steps.0.parameters.a.1", shown)
    assert allowed in error["message"]
    assert client.http.get("/api/v1/campaigns/unfit").status_code == 404
    assert_lists_answer(client)


@pytest.mark.parametrize("case", UNFIT)
def test_every_operation_holds_to_it(client: Client, documents: list[tuple[str, str]], case: str) -> None:
    sent = UNFIT[case][0]
    for method, path in documents:
        problem = refused(client.http.request(method, path, content=put_in({"a": "HERE"}, sent), headers=JSON))
        assert [e["field"] for e in problem["errors"]] == ["a"], path
    assert_lists_answer(client)


def test_a_name_is_held_to_it_as_a_value_is(client: Client) -> None:
    body = rb'{"procedure": "no_operation", "unit": "SIM-0001", "parameters": {"a\ud800": 1}}'
    (error,) = refused(client.http.post("/api/v1/jobs", content=body, headers=JSON))["errors"]
    assert (error["field"], error["value"]) == ("parameters.a\\ud800", "a\\ud800")


@pytest.mark.parametrize("of_more", ["problem+json", "JSON; charset=utf-8"])
def test_other_names_for_json_are_held_to_it(client: Client, of_more: str) -> None:
    headers = {"Content-Type": f"application/{of_more}"}
    answer = client.http.post("/api/v1/benches/sim/stop", content=rb'{"reason": "\ud800"}', headers=headers)
    assert refused(answer)["errors"][0]["field"] == "reason"
    assert client.http.get("/api/v1/benches/sim").json()["stopped"] is None


def test_a_pair_of_surrogates_is_a_character(client: Client) -> None:
    body = put_in(named("smile", {**IGNORED, "parameters": {"a": "HERE"}}), r'"\ud83d\ude00"')
    assert client.http.post("/api/v1/campaigns", content=body, headers=JSON).status_code == 201
    steps = client.http.get("/api/v1/campaigns/smile").json()["campaign"]["steps"]
    assert steps[0]["parameters"] == {"a": "\N{GRINNING FACE}"}


def test_so_deep_and_no_deeper(client: Client) -> None:
    around = 4  # the campaign, its steps, a step, its parameters
    for levels, status in ((DEPTH - around, 201), (DEPTH - around + 1, 422), (400, 422), (100_000, 422)):
        body = put_in(named("deep", {**IGNORED, "parameters": {"a": "HERE"}}), nested(levels))
        answer = client.http.post("/api/v1/campaigns", content=body, headers=JSON)
        assert answer.status_code == status, answer.text
        if status == 422:
            assert "at most 50 lists and objects" in answer.json()["errors"][0]["message"]
    assert_lists_answer(client)


def test_an_integer_that_python_does_not_read_is_no_finite_number(client: Client) -> None:
    answer = client.http.post("/api/v1/jobs", content=b'{"seed": 1%s}' % (b"0" * 5000), headers=JSON)
    assert "finite number" in refused(answer)["errors"][0]["message"]


def test_of_many_faults_the_first_are_told(client: Client) -> None:
    answer = client.http.post("/api/v1/jobs", content=b"[" + b"NaN," * 100_000 + b"1]", headers=JSON)
    assert [e["field"] for e in refused(answer)["errors"]][:2] == ["0", "1"]
    assert len(answer.content) < 10_000


def test_of_a_megabyte_of_wrong_values_some_are_told(client: Client) -> None:
    answer = client.preview(orientations=[[0, 361]] * 50_000)
    assert refused(answer)["errors"][0]["field"] == "parameters.orientations.0.1"
    assert len(answer.content) < 100_000


def test_an_answer_can_be_sent_whatever_it_quotes() -> None:
    field = FieldError(field="a\ud800", message="\udfff", value="1")
    request = Request({"type": "http", "path": "/\ud800", "headers": []})
    problem = json.loads(bytes(respond(request, 422, "\ud800 is none", "Invalid", [field], ["\ud800"]).body))
    assert (problem["detail"], problem["instance"], problem["lost"]) == ("\\ud800 is none", "/\\ud800", ["\\ud800"])
    assert (problem["errors"][0]["field"], problem["errors"][0]["message"]) == ("a\\ud800", "\\udfff")


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"time_column": "a\x00b"}, "description.time_column"),
        ({"reference_values": {"a\x00b": 1.0}}, "description.reference_values.a\\u0000b"),
        ({"time_column": "\ud800"}, "description"),
    ],
)
def test_the_description_of_a_file_is_held_to_it(client: Client, changes: dict[str, Any], field: str) -> None:
    channel = {"name": "gyro_x", "quantity": "angular_rate", "unit": "count"}
    answer = client.import_files({"unit": "FILE-1", "channels": [channel], "rate_hz": 100.0, **changes}, b"gyro_x\n1\n")
    assert [e["field"] for e in refused(answer)["errors"]] == [field]


@pytest.mark.parametrize("header", ["Idempotency-Key", "X-Requested-By"])
@pytest.mark.parametrize("value", [b"a\x00b", b"a\x01b", b"a\tb", b"a\x7fb"])
def test_a_header_without_sense_is_refused(client: Client, header: str, value: bytes) -> None:
    headers = [(header.encode(), value), (b"Content-Type", b"application/json")]
    body = b'{"procedure": "no_operation", "unit": "SIM-0001"}'
    before = client.stored()
    try:
        answer = client.http.post("/api/v1/jobs", content=body, headers=headers)
    except httpx.LocalProtocolError:
        return  # the client itself does not send it
    assert answer.status_code in (400, 422)
    assert client.stored() == before


@pytest.mark.parametrize("address", ["jobs?unit=%ED%A0%80", "jobs?unit=%00", "jobs/%ED%A0%80", "jobs/a%00b"])
def test_an_address_that_is_no_text_is_never_a_defect_of_the_service(client: Client, address: str) -> None:
    assert client.http.get(f"/api/v1/{address}").status_code in (200, 400, 404)
    assert client.http.post(f"/api/v1/{address}").status_code in (400, 404, 405, 422)
    assert_lists_answer(client)


def test_what_an_older_service_let_in_does_not_close_a_list(client: Client, database_url: str) -> None:
    stores, database = open_stores(database_url)
    unfit = {"a": "\ud800", "b": ["c\x00"]}
    record(stores.audit, "an older service", "submit", "/api/v1/jobs", "500", body=unfit)
    record(stores.audit, "of brackets", "submit", "/api/v1/jobs", "503", body=json.loads(nested(400)))
    stores.campaigns.add(Campaign.model_validate(named("older", {**IGNORED, "parameters": unfit})), now())
    database.dispose()
    shown = {"a": "\\ud800", "b": ["c\\u0000"]}
    campaign = client.http.get("/api/v1/campaigns/older").json()["campaign"]
    assert campaign["steps"][0]["parameters"] == shown
    (entry,) = client.http.get("/api/v1/audit", params={"who": "an older service"}).json()["items"]
    assert entry["detail"] == {"body": shown}
    (entry,) = client.http.get("/api/v1/audit", params={"who": "of brackets"}).json()["items"]
    assert "…" in str(entry["detail"])
    assert_lists_answer(client)


# Length.


def long_campaign(size: int) -> bytes:
    """A campaign of a name `long` and of so many bytes."""
    body = put_in(named("long", {**IGNORED, "parameters": {"a": "HERE"}}), '""')
    return body.replace(b'""', b'"' + b"x" * (size - len(body)) + b'"')


def in_pieces(body: bytes) -> Iterator[bytes]:
    """Sent in chunks: without a length beforehand."""
    for start in range(0, len(body), 100_000):
        yield body[start : start + 100_000]


@pytest.mark.parametrize("chunked", [False, True])
def test_a_body_is_so_long_and_no_longer(client: Client, chunked: bool) -> None:
    path = "/api/v1/campaigns"
    for size in (BODY_BYTES + 1, 5 * BODY_BYTES):
        body = long_campaign(size)
        problem = refused(client.http.post(path, content=in_pieces(body) if chunked else body, headers=JSON), 413)
        assert problem["instance"] == path
        assert [e["field"] for e in problem["errors"]] == ["body"]
        assert str(BODY_BYTES) in problem["detail"]
        assert client.http.get(f"{path}/long").status_code == 404
    entry = client.http.get("/api/v1/audit", params={"limit": 1}).json()["items"][0]
    assert (entry["action"], entry["outcome"]) == ("add_campaign", "413")


def test_the_longest_body_is_taken(client: Client) -> None:
    body = long_campaign(BODY_BYTES).replace(b'"long"', b'"just"')
    assert len(body) == BODY_BYTES
    assert client.http.post("/api/v1/campaigns", content=body, headers=JSON).status_code == 201


def test_every_operation_that_takes_a_document_bounds_it(client: Client, documents: list[tuple[str, str]]) -> None:
    for kind in ("application/json", "text/plain", "multipart/form-data; boundary=x"):
        for method, path in documents:
            headers = {"Content-Type": kind}
            refused(client.http.request(method, path, content=b"1" * (BODY_BYTES + 1), headers=headers), 413)


def test_a_file_may_be_longer_than_a_document(client: Client) -> None:
    channel = {"name": "gyro_x", "quantity": "angular_rate", "unit": "count"}
    file = b"gyro_x\n" + b"1\n" * BODY_BYTES
    answer = client.import_files({"unit": "FILE-2", "channels": [channel], "rate_hz": 100.0}, file)
    assert answer.status_code == 201, answer.text
    assert answer.json()["count"] == BODY_BYTES
