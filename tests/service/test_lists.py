"""Lists over HTTP: their conditions, names in a query that mean nothing, HEAD, and compressed answers."""

import gzip
import json
from collections.abc import Generator
from datetime import datetime, timedelta

import httpx
import pytest

from tests.service.client import Client


@pytest.fixture(scope="module")
def jobs(sqlite_client: Client) -> list[dict]:
    """Three jobs, the first with recordings and a result."""
    first = sqlite_client.submit(labels={"lot": "7", "for": "Пилот"})
    others = [sqlite_client.submit("no_operation", labels={"lot": lot}) for lot in ("7", "70")]
    return [sqlite_client.wait(job["id"]) for job in (first, *others)]


def ids(client: Client, what: str, **query: object) -> list[str]:
    answer = client.http.get(f"/api/v1/{what}", params=query)  # pyright: ignore[reportArgumentType]
    assert answer.status_code == 200, answer.text
    return [item["id"] for item in answer.json()["items"]]


def test_a_list_is_searched_by_verdict_date_label_and_text(sqlite_client: Client, jobs: list[dict]) -> None:
    first, second, third = (job["id"] for job in jobs)
    assert ids(sqlite_client, "jobs", label="lot") == [third, second, first]
    assert ids(sqlite_client, "jobs", label=["lot=7", "for=Пилот"]) == [first]
    assert ids(sqlite_client, "jobs", text="Пил") == [first]
    assert set(ids(sqlite_client, "jobs", verdict=jobs[0]["verdict"])) >= {first}
    assert ids(sqlite_client, "jobs", since=jobs[1]["created_at"]) == [third, second]
    assert ids(sqlite_client, "jobs", until=jobs[1]["created_at"]) == [first]
    assert ids(sqlite_client, "jobs", bench="elsewhere") == []
    tomorrow = datetime.fromisoformat(jobs[2]["created_at"]) + timedelta(days=1)
    assert ids(sqlite_client, "recordings", since=tomorrow.isoformat()) == []
    assert len(ids(sqlite_client, "recordings", label="for", verdict=jobs[0]["verdict"])) == 12
    assert ids(sqlite_client, "results", label="for", name="calibration_12_orientations") == [jobs[0]["result"]]


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ({"since": "2031-05-06T00:00:00"}, "since"),
        ({"until": "yesterday"}, "until"),
        ({"verdict": "good"}, "verdict"),
        ({"label": "=7"}, "label.0"),
        ({"text": ""}, "text"),
    ],
)
def test_a_condition_that_is_none_is_refused_with_its_name(sqlite_client: Client, query: dict, field: str) -> None:
    answer = sqlite_client.http.get("/api/v1/jobs", params=query)
    assert answer.status_code == 422
    assert [error["field"] for error in answer.json()["errors"]] == [field]


def test_an_unknown_name_in_a_query_is_refused_with_the_known_ones(sqlite_client: Client) -> None:
    answer = sqlite_client.http.get("/api/v1/recordings", params={"chanels": "gyro_x", "limit": 3, "foo": "1"})
    assert answer.status_code == 422
    errors = {error["field"]: error["message"] for error in answer.json()["errors"]}
    assert set(errors) == {"chanels", "foo"}
    assert "unit" in errors["foo"]
    assert "simulated" in errors["foo"]
    none = sqlite_client.http.post("/api/v1/jobs", params={"dry": "1"}, json={})
    assert [e["message"] for e in none.json()["errors"] if e["field"] == "dry"] == [
        "none: this address takes no query parameters"
    ]
    assert sqlite_client.http.get("/metrics", params={"any": "1"}).status_code == 200


def test_an_unknown_name_makes_nothing(sqlite_client: Client, jobs: list[dict]) -> None:
    before = sqlite_client.stored()
    body = {"procedure": "no_operation", "unit": "SIM-0001"}
    assert sqlite_client.http.post("/api/v1/jobs", params={"priorty": "1"}, json=body).status_code == 422
    assert sqlite_client.stored() == before


def plain(client: Client, method: str, path: str, encoding: str = "identity") -> httpx.Response:
    return client.http.request(method, path, headers={"Accept-Encoding": encoding})


def test_head_has_the_header_of_get_and_no_body(sqlite_client: Client, jobs: list[dict]) -> None:
    recording = ids(sqlite_client, "recordings", job=jobs[0]["id"])[0]
    for noun in ("procedures", "methods"):  # pages show their titles once they have been read
        assert sqlite_client.http.get(f"/api/v1/{noun}").is_success
    for path in ("/api/v1/jobs", f"/jobs/{jobs[0]['id']}", "/healthz", f"/api/v1/recordings/{recording}/data", "/docs"):
        head, get = (plain(sqlite_client, method, path) for method in ("HEAD", "GET"))
        assert head.status_code == get.status_code == 200, path
        assert head.content == b""
        assert len(get.content) > 0
        for name in ("content-type", "content-length", "content-disposition", "etag"):
            assert head.headers.get(name) == get.headers.get(name), (path, name)


def test_head_of_a_stream_that_does_not_end_answers(sqlite_client: Client) -> None:
    job = sqlite_client.submit("static_run", parameters={"duration_s": 36000.0})
    answer = sqlite_client.http.head(f"/api/v1/jobs/{job['id']}/events", timeout=5)
    assert (answer.status_code, answer.headers["content-type"].split(";")[0]) == (200, "text/event-stream")
    assert sqlite_client.http.head("/api/v1/jobs/none").status_code == 404
    assert sqlite_client.http.head("/api/v1/analyses").status_code == 405
    sqlite_client.http.post(f"/api/v1/jobs/{job['id']}/cancel")
    sqlite_client.wait(job["id"])


@pytest.fixture
def raw(sqlite_client: Client) -> Generator[httpx.Response]:
    """A long answer, as it came over the line."""
    with sqlite_client.http.stream("GET", "/openapi.json", headers={"Accept-Encoding": "gzip"}) as answer:
        yield answer


def test_a_text_is_compressed_for_a_client_that_takes_it(sqlite_client: Client, raw: httpx.Response) -> None:
    sent = b"".join(raw.iter_raw())
    whole = plain(sqlite_client, "GET", "/openapi.json")
    assert raw.headers["content-encoding"] == "gzip"
    assert "content-encoding" not in whole.headers
    assert json.loads(gzip.decompress(sent)) == whole.json()
    assert len(sent) < len(whole.content) / 5


def test_samples_streams_and_short_answers_are_not_compressed(sqlite_client: Client, jobs: list[dict]) -> None:
    recording = ids(sqlite_client, "recordings", job=jobs[0]["id"])[0]
    data = [f"/api/v1/recordings/{recording}/data?format={form}" for form in ("csv", "arrow", "parquet", "npy")]
    for path in (*data, f"/api/v1/jobs/{jobs[0]['id']}/events", "/healthz"):
        assert "content-encoding" not in plain(sqlite_client, "GET", path, "gzip").headers, path
