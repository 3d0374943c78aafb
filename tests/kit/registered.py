"""A registered bench that this process does not drive, so that another service can: a process has one job engine."""

from contextlib import ExitStack

from bench_service.app import open_service
from bench_service.settings import Settings


def register_bench(settings: Settings) -> None:
    """Register the settings' bench and its units, as a service does that starts, and end before it works."""
    with ExitStack() as closing:
        open_service(settings, closing)
