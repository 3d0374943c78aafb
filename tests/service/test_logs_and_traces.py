"""Output of a real process: lines as JSON with what they are about, and a trace of every job."""

import json
import threading
from collections.abc import Generator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from uuid import UUID

import pytest
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest

from bench_service.wall_clock import monotonic_s
from tests.kit.logged_service import process
from tests.service.campaigns import add, ended, named, start
from tests.service.client import FAST


class Collector(ThreadingHTTPServer):
    """Takes spans; `broken` answers with an error instead."""

    def __init__(self, broken: bool) -> None:
        super().__init__(("127.0.0.1", 0), _Take)
        self.broken = broken
        self.spans: list = []
        self.asked = 0


class _Take(BaseHTTPRequestHandler):
    def do_POST(self) -> None:
        assert isinstance(self.server, Collector)
        body = self.rfile.read(int(self.headers["Content-Length"]))
        if self.headers.get("Content-Encoding") == "gzip":
            import gzip

            body = gzip.decompress(body)
        self.server.asked += 1
        if self.path == "/v1/traces" and not self.server.broken:
            for resource in ExportTraceServiceRequest.FromString(body).resource_spans:
                self.server.spans += [span for scope in resource.scope_spans for span in scope.spans]
        self.send_response(503 if self.server.broken else 200)
        self.end_headers()

    def log_message(self, *_: object) -> None: ...


@contextmanager
def collector(broken: bool = False) -> Generator[Collector]:
    with Collector(broken) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


def attributes(span) -> dict:
    return {a.key: a.value.string_value or a.value.int_value for a in span.attributes}


def test_every_line_is_json_about_its_job_and_every_job_one_trace(tmp_path: Path, free_port: int) -> None:
    with collector() as spans:
        where = f"http://127.0.0.1:{spans.server_address[1]}"
        told = {"BENCH_LOG": "json", "BENCH_LOG_ACCESS": "true", "OTEL_EXPORTER_OTLP_ENDPOINT": where}
        with process(tmp_path, free_port, **told) as (client, file):
            job = client.wait(client.submit(seed=1)["id"])
            client.http.get("/healthz", headers={"X-Request-ID": "probe-1"})
            token = f"bench_{'A1-_' * 10}xyz"
            assert client.http.get("/api/v1/jobs", params={"token": token}).status_code == 400
        assert token not in file.read_text(), "a line of the log hides a token"
        lines = [json.loads(line) for line in file.read_text().splitlines()]
    assert all({"at", "level", "logger", "message", "bench"} <= set(line) for line in lines)
    about = [line for line in lines if line.get("job") == job["id"]]
    messages = [line["message"] for line in about]
    assert next(line for line in about if line["message"].endswith("queued"))["request"]
    assert "started, attempt 1, 12 stations" in messages
    assert [line["step"] for line in about if line["message"].endswith("recorded")] == [
        f"station {k}" for k in range(12)
    ]
    assert "bench made safe" in messages
    assert f"ended as succeeded, verdict {job['verdict']}" in messages
    access = [line for line in lines if line["logger"] == "uvicorn.access" and "/healthz" in line["message"]]
    assert [line["request"] for line in access] == ["probe-1"]

    ours = {s.name: s for s in spans.spans if s.trace_id == UUID(job["id"]).bytes}
    root = ours["job calibration_12_orientations"]
    assert {f"station {k}" for k in range(12)} | {"make safe", "analysis"} == set(ours) - {root.name}
    assert {s.parent_span_id for s in ours.values() if s is not root} == {root.span_id}
    assert root.parent_span_id == b""
    assert attributes(root)["bench.verdict"] == attributes(ours["analysis"])["bench.verdict"] == job["verdict"]
    assert root.start_time_unix_nano <= ours["station 0"].start_time_unix_nano
    assert any("bench_[hidden]" in str(attributes(s)) for s in spans.spans)
    assert not any(token in str(attributes(s)) for s in spans.spans), "and so does a span"
    requests = [s for s in spans.spans if s.name == "POST /api/v1/jobs"]
    assert len(requests) == 1


def test_lines_about_a_campaigns_jobs_name_its_run_and_those_about_other_jobs_none(
    tmp_path: Path, free_port: int
) -> None:
    with process(tmp_path, free_port, BENCH_LOG="json") as (client, file):
        add(
            client, named("night", {"parameters": {}}, {"procedure": "calibration_12_orientations", "parameters": FAST})
        )
        run = ended(client, start(client, "night")["id"])
        alone = client.wait(client.submit("no_operation")["id"])
    lines = [json.loads(line) for line in file.read_text().splitlines()]
    for step in run["steps"]:
        about = [line for line in lines if line.get("job") == step["job"]]
        assert {line.get("campaign") for line in about} == {run["id"]}, about
        messages = {line["message"] for line in about}
        assert any(message.endswith("queued") for message in messages), "said by the conductor"
        assert any(message.startswith("ended as") for message in messages), "said by the worker"
        queued = next(line for line in about if line["message"].endswith("queued"))
        assert queued["campaign_step"] == step["name"]
    assert all("campaign" not in line for line in lines if line.get("job") == alone["id"])


@pytest.mark.parametrize("there", [True, False], ids=["broken", "absent"])
def test_a_collector_that_fails_disturbs_nothing(tmp_path: Path, free_port: int, there: bool) -> None:
    with collector(broken=True) as spans:
        where = f"http://127.0.0.1:{spans.server_address[1] if there else 9}"
        with process(tmp_path, free_port, BENCH_TRACES_URL=f"{where}/v1/traces") as (client, file):
            job = client.wait(client.submit(parameters=FAST, seed=1)["id"])
            assert job["state"] == "succeeded"
            assert client.http.get("/readyz").status_code == 200
            ending = monotonic_s()
        took = monotonic_s() - ending
        assert (spans.asked > 0) == there
    text = file.read_text()
    assert f"ended as succeeded, verdict {job['verdict']} [bench=sim job={job['id']} step=conclude]" in text
    assert "Traceback" not in text
    print(f"the service ended {took:.1f} s after it was asked to")
