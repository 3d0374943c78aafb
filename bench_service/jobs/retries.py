"""Retry rules: the failures that are retried, and the pauses before it. A job resumes at the station that failed."""

from datetime import timedelta

from bench_service.jobs.queue import LONGEST_PAUSE_S, QueueStore
from bench_service.model.job import BENCH_FAULTS, Failure, Job
from bench_service.wall_clock import now

RETRY_PAUSES_S = (10.0, 30.0, 60.0, 120.0, LONGEST_PAUSE_S)
"""Pause before a job's first, second, … retry after a fault of the bench [s]."""
DATABASE_FAULTS = frozenset({"StorageFailure", "LeaseLost"})
"""Kinds of failure that a restart of the database causes in a running job."""
DATABASE_PAUSE_S = 1.0
"""Pause before such a job is retried [s]."""
MOST_ATTEMPTS = 20
"""Maximum attempts of a job: one that was queued this often is not requeued after a database fault."""


def try_again(queue: QueueStore, job: Job, failure: Failure | None, scale: float) -> Job | None:
    """Requeue a running job whose failure may not recur; None where the job ends.

    A fault of the bench costs one of the requested retries. A database that was restarted costs none: like a
    killed process, that is not the job's affair. `scale`: factor on the pauses before a retry.
    """
    if failure is None:
        return None
    if failure.kind in BENCH_FAULTS and job.retries_left > 0:
        pauses = RETRY_PAUSES_S[: job.retries - job.retries_left + 1]
        due = now() + timedelta(seconds=pauses[-1] * scale)
        return queue.requeue(job.id, now(), due, failure, spend=True)
    if failure.kind in DATABASE_FAULTS and job.attempt < MOST_ATTEMPTS:
        due = now() + timedelta(seconds=DATABASE_PAUSE_S)
        return queue.requeue(job.id, now(), due, failure, spend=False)
    return None
