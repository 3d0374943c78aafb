"""The end of every stop of a bench, where a test is about something else."""

from bench_service.bench.registry import BenchRegistry
from bench_service.wall_clock import now


def release_all(benches: BenchRegistry, bench: str) -> None:
    """Release whatever stops of a bench stand."""
    for stop in benches.standing_stops(bench):
        benches.release_stop(bench, stop.id, now(), "a test", "")
