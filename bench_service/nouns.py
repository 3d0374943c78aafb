"""All routes of the service, by noun of the API and by page, and what only they use.

Imported while the service already answers liveness checks, see `bench_service.api.http.late_routes`: health alone is
there before.
"""

from fastapi import FastAPI

from bench_service.api import (
    audit,
    audit_chain,
    batches,
    certificates,
    database,
    metrics,
    mountings,
    procedures,
    recordings,
    reservations,
    results,
    samples,
    storage,
    synthetic,
    trends,
)
from bench_service.api.access import routes as access
from bench_service.api.benches import routes as benches
from bench_service.api.campaigns import routes as campaigns
from bench_service.api.campaigns import schedules
from bench_service.api.feed import news
from bench_service.api.feed import routes as feed
from bench_service.api.jobs import estimates, event_stream
from bench_service.api.jobs import routes as jobs
from bench_service.api.manual import routes as manual
from bench_service.api.openapi import document
from bench_service.api.units import calibrations, notes
from bench_service.api.units import routes as units
from bench_service.jobs.events.hub import EventHub
from bench_service.pages import (
    access_pages,
    bench_pages,
    campaign_pages,
    console_pages,
    docs,
    images,
    languages,
    static_files,
    stop_pages,
)
from bench_service.pages import routes as pages
from bench_service.service import BenchService

ROUTERS = (
    procedures,
    jobs,
    recordings,
    synthetic,
    samples,
    batches,
    results,
    units,
    calibrations,
    trends,
    benches,
    reservations,
    mountings,
    manual,
    campaigns,
    schedules,
    access,
    audit,
    database,
    storage,
    audit_chain,
    metrics,
    feed,
    certificates,
    estimates,
    notes,
)
PAGES = (
    static_files,
    languages,
    docs,
    access_pages,
    images,
    stop_pages,
    bench_pages,
    console_pages,
    pages,
    campaign_pages,
)


def add_nouns(app: FastAPI, service: BenchService) -> None:
    """Add the routes of all nouns and pages to an application, and what they take from its state."""
    app.state.hub = EventHub(service.stores.jobs, service.live, event_stream.FRAMES)
    app.state.news = news.NewsReader(service)
    document.install(app, lambda: service.catalogue)
    for module in (*ROUTERS, *PAGES):
        module.router.add_to(app.router)
