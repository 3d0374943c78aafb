"""Exceptions of the client. All are `BenchClientError`; each message is a sentence for a person."""

from bench_client.views import Job, Problem


class BenchClientError(Exception):
    """Base of the client's exceptions: it could not do what was asked."""


class Refused(BenchClientError):
    """The service refused a request; `problem` has status, kind, and the fields that caused it."""

    def __init__(self, problem: Problem) -> None:
        fields = "; ".join(f"{one.field} = {one.value!r}: {one.message}" for one in problem.errors)
        super().__init__(fields or problem.detail)
        self.problem = problem


class Unavailable(BenchClientError):
    """The service did not answer within the client's patience, or a proxy answered in its place.

    A create that was asked with a key may be repeated: it is made once.
    """


class TimedOut(BenchClientError):
    """A job did not end in the time that the caller gave it; it continues in the service."""

    def __init__(self, job: Job, timeout_s: float) -> None:
        super().__init__(f"job {job.id} is still {job.state} after {timeout_s:g} s; it continues in the service")
        self.job = job


class JobEnded(BenchClientError):
    """A job ended without a result: it failed, was cancelled, or was interrupted."""

    def __init__(self, job: Job) -> None:
        why = "no reason given" if job.error is None else f"{job.error.kind}: {job.error.message}"
        super().__init__(f"job {job.id} of {job.procedure} is {job.state}: {why}")
        self.job = job
