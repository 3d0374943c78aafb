"""Metrics for monitoring, in Prometheus text format.

Jobs, benches and recordings come from the database and are the same in every process; requests and listeners are this
process's own.
"""

from collections.abc import Iterator

from fastapi import FastAPI, Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, Counter, Histogram, generate_latest
from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    Metric,
)
from prometheus_client.registry import Collector
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bench_service.api.http.dependencies import Hub, Service
from bench_service.api.http.errors import problems
from bench_service.bench.live.values import BenchLive
from bench_service.jobs.events.hub import EventHub
from bench_service.model.job import FINAL, JobState
from bench_service.routing import Routes
from bench_service.service import BenchService
from bench_service.telemetry.tallies import DURATION_S, NEVER_LEFT, Spread, Tallies
from bench_service.wall_clock import monotonic_s, now

router = Routes(tags=["health"])

BENCH_STATES = ("idle", "busy", "stopped", "offline")


@router.get(
    "/metrics",
    response_class=Response,
    responses={**problems(), 200: {"content": {"text/plain": {"schema": {"type": "string"}}}}},
)
def metrics(request: Request, service: Service, hub: Hub) -> Response:
    """Read the metrics: jobs, stations, recordings, benches, listeners and requests, in Prometheus text format."""
    tallies: Tallies = request.app.state.tallies
    tallies.update()
    registry = CollectorRegistry()
    registry.register(Snapshot(service, tallies, hub))
    requests: CollectorRegistry = request.app.state.request_metrics
    return Response(generate_latest(registry) + generate_latest(requests), media_type=CONTENT_TYPE_LATEST)


class Snapshot(Collector):
    """Collector of all metrics of one scrape, read from the service when Prometheus asks."""

    def __init__(self, service: BenchService, tallies: Tallies, hub: EventHub) -> None:
        self._service = service
        self._tallies = tallies
        self._hub = hub

    def collect(self) -> Iterator[Metric]:
        """Yield the metric families: jobs, campaigns, benches, listeners, disk and database. Raises
        `StorageFailure`.
        """
        yield from self._jobs()
        yield from self._campaigns()
        yield from self._benches()
        yield GaugeMetricFamily("bench_listeners", "Listeners to events of jobs in this process", self._hub.listeners)
        dropped = "Listeners that were too slow and let go here"
        yield CounterMetricFamily("bench_listeners_dropped", dropped, self._hub.dropped)
        free = self._tallies.store.free_bytes()
        if free is not None:
            yield GaugeMetricFamily("bench_free_disk_bytes", "Free space on the disk of the database's file", free)
        yield GaugeMetricFamily(
            "bench_database_bytes", "Size of the database", self._service.upkeep.size().stored_bytes
        )

    def _jobs(self) -> Iterator[Metric]:
        tallies = self._tallies
        states = GaugeMetricFamily("bench_jobs", "Jobs by state", labels=["state"])
        left = self._service.stores.jobs.counts([state for state in JobState if state not in NEVER_LEFT])
        for state, count in {**left, **tallies.ended()}.items():
            states.add_metric([state.value], count)
        yield states
        labels = ["procedure", "state", "verdict"]
        finished = CounterMetricFamily("bench_jobs_finished", "Jobs that have ended", labels=labels)
        for key, count in sorted(tallies.finished.items()):
            finished.add_metric(key, count)
        yield finished
        took = HistogramMetricFamily("bench_job_duration_seconds", "From start to end", labels=["procedure"])
        for procedure, spread in sorted(tallies.durations.items()):
            took.add_metric([procedure], _buckets(spread), spread.sum_s)
        yield took
        waited = HistogramMetricFamily("bench_job_wait_seconds", "From submission to start, of jobs that have ended")
        waited.add_metric([], _buckets(tallies.waits), tallies.waits.sum_s)
        yield waited
        yield CounterMetricFamily("bench_stations_done", "Stations recorded", tallies.stations)
        yield GaugeMetricFamily("bench_recordings_bytes", "Stored bytes of all recordings", tallies.recorded_bytes)

    def _campaigns(self) -> Iterator[Metric]:
        labels = ["campaign", "state", "verdict"]
        still = GaugeMetricFamily("bench_campaign_runs_open", "Runs that have not ended", labels=labels[:2])
        finished = CounterMetricFamily("bench_campaign_runs_finished", "Runs that have ended", labels=labels)
        for (campaign, state, verdict), count in sorted(self._service.stores.campaigns.counts().items()):
            if JobState(state) in FINAL:
                finished.add_metric([campaign, state, verdict], count)
            else:
                still.add_metric([campaign, state], count)
        yield from (still, finished)

    def _benches(self) -> Iterator[Metric]:
        benches, at = self._service.stores.benches, now()
        busy = GaugeMetricFamily("bench_busy", "1 while a job drives the bench", labels=["bench"])
        state = GaugeMetricFamily("bench_state", "1 for the state that the bench is in", labels=["bench", "state"])
        seen = GaugeMetricFamily("bench_driver_seen_seconds", "Since the driver gave a sign", labels=["bench"])
        stops = GaugeMetricFamily("bench_stops_standing", "Stops that nobody has released", labels=["bench"])
        for bench in benches.benches():
            live = self._service.live.of_bench(bench.id)
            standing = len(benches.standing_stops(bench.id))
            stops.add_metric([bench.id], standing)
            found = _state(live, standing > 0)
            busy.add_metric([bench.id], live is not None and live.there(at) and live.job is not None)
            for name in BENCH_STATES:
                state.add_metric([bench.id, name], name == found)
            if live is not None:
                seen.add_metric([bench.id], live.seen_s(at))
        yield from (busy, state, seen, stops)


def _state(live: BenchLive | None, stopped: bool) -> str:
    if stopped:
        return "stopped"
    if live is None or not live.there(now()):
        return "offline"
    return "idle" if live.job is None else "busy"


def _buckets(spread: Spread) -> list[tuple[str, float]]:
    """Convert counts to the cumulative counts up to each bound that the format requires."""
    total, found = 0, list[tuple[str, float]]()
    for bound, count in zip([*map(str, DURATION_S), "+Inf"], spread.counts, strict=True):
        total += count
        found.append((bound, total))
    return found


def install(app: FastAPI, service: BenchService) -> None:
    """Give an application the registry of metrics at `app.state`, and have its requests measured."""
    registry = CollectorRegistry()
    app.state.tallies = Tallies(service.stores.tallies)
    app.state.request_metrics = registry
    app.add_middleware(Measured, registry=registry)


class Measured:
    """ASGI middleware that counts requests by route and status, and measures the time until each answer begins."""

    def __init__(self, app: ASGIApp, registry: CollectorRegistry) -> None:
        self._app = app
        labels = ["method", "route", "status"]
        self._requests = Counter("bench_http_requests", "Requests answered here", labels, registry=registry)
        self._latency = Histogram(
            "bench_http_latency_seconds", "Until the answer began", ["method", "route"], registry=registry
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        begun_s = monotonic_s()

        async def count_and_send(message: Message) -> None:
            if message["type"] == "http.response.start":
                self._count(scope, message["status"], monotonic_s() - begun_s)
            await send(message)

        try:
            await self._app(scope, receive, count_and_send)
        except Exception:
            self._count(scope, 500, monotonic_s() - begun_s)
            raise

    def _count(self, scope: Scope, status: int, seconds: float) -> None:
        route = scope.get("route")
        path = "none" if route is None else route.path
        method = scope["method"] if route is not None else "any"  # a client may invent methods, not series
        self._requests.labels(method, path, str(status)).inc()
        self._latency.labels(method, path).observe(seconds)
