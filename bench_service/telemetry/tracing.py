"""Traces of jobs (job → station → analysis), sent to an OpenTelemetry collector where one is configured.

All spans of a job, from any process, belong to one trace whose id is the job's: a job that outlives its
worker is still one trace. The span of the job itself is written at its end, under an id that its parts know beforehand.
OpenTelemetry is imported only where traces are wanted; a collector that fails costs a line in the log.
"""

import hashlib
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from datetime import datetime
from typing import Any
from uuid import UUID

from bench_service.model.job import Job
from bench_service.telemetry.redaction import names_token, without_tokens

TIMEOUT_S = 2.0
"""Maximum time for a collector's answer, also at the end of the service [s]."""
Found = dict[str, str | int | float | bool]
"""Attributes that a span gets at its end; "error" is a sentence."""


class Traces:
    """Traces that go nowhere: the service's default unless a collector is configured. Base of `CollectedTraces`."""

    @contextmanager
    def part(self, job_id: str, name: str, **known: str | int | float | bool) -> Generator[Found]:
        """Trace a part of a job while the block runs; what the block puts into the dictionary becomes attributes of the
        span.
        """
        yield {}

    def ended(self, job: Job) -> None:
        """Write the span of a job that has ended, or was paused."""

    def instrument(self, app: Any) -> None:
        """Have every request to this application traced as a span."""

    def close(self) -> None:
        """Send the waiting spans and wait, at most `TIMEOUT_S`."""


class CollectedTraces(Traces):
    """Traces sent to a collector, OTLP over HTTP."""

    def __init__(self, url: str, bench_id: str, code_version: str) -> None:
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor

        about = {"service.name": "bench", "service.version": code_version, "bench.id": bench_id}
        self._provider = TracerProvider(resource=Resource.create(about), id_generator=_ids(), shutdown_on_exit=False)
        exporter = OTLPSpanExporter(endpoint=url, timeout=TIMEOUT_S)
        self._provider.add_span_processor(BatchSpanProcessor(exporter, schedule_delay_millis=1000))
        self._tracer = self._provider.get_tracer("bench_service")

    @contextmanager
    def part(self, job_id: str, name: str, **known: str | int | float | bool) -> Generator[Found]:
        from opentelemetry import trace

        trace_id, span_id = _of_job(job_id)
        parent = trace.SpanContext(trace_id, span_id, True, trace.TraceFlags(trace.TraceFlags.SAMPLED))
        context = trace.set_span_in_context(trace.NonRecordingSpan(parent))
        found: Found = {}
        with self._tracer.start_as_current_span(
            name, context, attributes={"bench.job": job_id, **known}, record_exception=False
        ) as span:
            yield found
            if (error := found.pop("error", None)) is not None:
                span.set_status(trace.StatusCode.ERROR, str(error))
            span.set_attributes(found)

    def ended(self, job: Job) -> None:
        from opentelemetry import trace
        from opentelemetry.context import Context

        token = _GIVEN.set(_of_job(job.id))
        try:
            span = self._tracer.start_span(
                f"job {job.procedure}", Context(), attributes=_attributes(job), start_time=_ns(job.created_at)
            )
        finally:
            _GIVEN.reset(token)
        if job.failure is not None:
            span.set_status(trace.StatusCode.ERROR, f"{job.failure.kind}: {job.failure.message}")
        span.end(None if job.finished_at is None else max(_ns(job.created_at), _ns(job.finished_at)))

    def instrument(self, app: Any) -> None:
        from opentelemetry.instrumentation.fastapi import FastAPIInstrumentor

        FastAPIInstrumentor.instrument_app(
            app,
            tracer_provider=self._provider,
            excluded_urls="/healthz,/readyz,/metrics,/events$",  # a stream would be a span as long as its job
            exclude_spans=["receive", "send"],
            server_request_hook=_hide_tokens,
        )

    def close(self) -> None:
        self._provider.shutdown()


def _hide_tokens(span: Any, _scope: Any) -> None:
    """Hide tokens in the addresses of a request's span: such a request is refused, and its span is sent anyway."""
    for name, value in dict(getattr(span, "attributes", None) or {}).items():
        if isinstance(value, str) and names_token(value):
            span.set_attribute(name, without_tokens(value))


def traces_to(url: str | None, bench_id: str, code_version: str) -> Traces:
    """Return traces that go to a collector's address, or nowhere where `url` is None."""
    return Traces() if url is None else CollectedTraces(url, bench_id, code_version)


_GIVEN: ContextVar[tuple[int, int] | None] = ContextVar("given", default=None)


def _ids() -> Any:
    from opentelemetry.sdk.trace.id_generator import RandomIdGenerator

    class GivenIds(RandomIdGenerator):
        """Random ids, unless a span of a job is being made."""

        def generate_trace_id(self) -> int:
            given = _GIVEN.get()
            return super().generate_trace_id() if given is None else given[0]

        def generate_span_id(self) -> int:
            given = _GIVEN.get()
            return super().generate_span_id() if given is None else given[1]

    return GivenIds()


def _of_job(job_id: str) -> tuple[int, int]:
    """Trace and span id of a job; neither is ever zero."""
    return UUID(job_id).int, int.from_bytes(hashlib.sha256(job_id.encode()).digest()[:8], "big") or 1


def _attributes(job: Job) -> dict[str, str | int | bool]:
    """The attributes of a job's span, at its end."""
    known: dict[str, str | int | bool | None] = {
        "bench.job": job.id,
        "bench.id": job.bench,
        "bench.unit": job.unit,
        "bench.procedure": job.procedure,
        "bench.state": job.state.value,
        "bench.verdict": None if job.verdict is None else job.verdict.value,
        "bench.stations": job.stations_done,
        "bench.attempt": job.attempt,
        "bench.simulated": job.simulated,
        "bench.result": job.result_id,
    }
    return {name: value for name, value in known.items() if value is not None}


def _ns(at: datetime) -> int:
    return int(at.timestamp() * 1e6) * 1000
