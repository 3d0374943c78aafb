"""A client's request for a job, and the recognition of a repeated request."""

import hashlib
import json
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

CAMPAIGN_RUN = "campaign_run"
"""The label that names the campaign run to which a job belongs."""


@dataclass(frozen=True, kw_only=True)
class JobTerms:
    """The terms of a job that a request and its record have in common. A job inherits these fields."""

    procedure: str
    unit: str
    priority: int = 10
    """Priority in the queue: smaller runs first."""
    labels: dict[str, str] = field(default_factory=dict[str, str])
    seed: int | None = None
    """Seed of the simulated world; None on a real bench."""
    deadline_at: datetime | None = None
    """Latest time at which a station may begin; the job then fails."""
    retries: int = 0
    """Maximum number of retries after faults of the bench, each from the station that failed."""
    reservation: str | None = None
    """The reservation under which it runs; None: it waits while its bench or unit is reserved."""
    mounting: str | None = None
    """The mounting of its unit that it rests on; of a request, None: the bench's current one of that unit, if any."""


@dataclass(frozen=True, kw_only=True)
class JobRequest(JobTerms):
    """A client's request for a job: the terms, the bench, the parameters, and the earliest start."""

    bench: str | None = None
    not_before: datetime | None = None
    """Earliest start, by the service's clock; None: as soon as its turn comes."""
    parameters: dict[str, Any] = field(default_factory=dict[str, Any])


def fingerprint(request: object) -> str:
    """Return a digest of a client's request, the same for the same request."""
    return hashlib.sha256(json.dumps(request, sort_keys=True, default=_plain).encode()).hexdigest()


def _plain(value: object) -> object:
    return value.isoformat() if isinstance(value, datetime) else vars(value)
