"""Modules that are changed, each with the tests that must see it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Subject:
    """A module of ours and its own tests, as pytest takes them."""

    name: str
    module: str
    tests: tuple[str, ...]


NO_POSTGRES = ("-k", "not postgres")
"""A server is started for each mutant otherwise: two seconds and more."""

SUBJECTS = (
    Subject(
        "supervisor",
        "bench_service/bench/supervisor.py",
        ("tests/service/test_supervisor.py", "tests/service/test_supervisor_stops.py"),
    ),
    Subject(
        "safety",
        "bench_service/bench/safety.py",
        ("tests/service/test_safety.py", "tests/service/test_safety_at_start.py", *NO_POSTGRES),
    ),
    Subject(
        "queue",
        "bench_service/persistence/jobs/queue_store.py",
        ("tests/storage/test_queue.py", "tests/storage/test_queue_places.py", *NO_POSTGRES),
    ),
    Subject("lease", "bench_service/persistence/bench/lease.py", ("tests/storage/test_lease.py", *NO_POSTGRES)),
    Subject("retries", "bench_service/jobs/retries.py", ("tests/service/test_retry_rules.py",)),
    Subject(
        "decision",
        "procedures/core/limits.py",
        ("tests/domain/test_decision.py", "tests/service/test_limit_power.py"),
    ),
    Subject(
        "estimator",
        "procedures/analysis/calibration/estimator.py",
        ("tests/domain/test_multiposition.py", "tests/domain/test_orientation_plan.py"),
    ),
)
