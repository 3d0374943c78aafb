"""A job as a client asks for it, and how a repeated request is recognised."""

import hashlib
import json
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

CAMPAIGN_RUN = "campaign_run"
"""The label that names the campaign run to which a job belongs."""


@dataclass(frozen=True, kw_only=True)
class JobTerms:
    """What a client asks of a job and its record keeps under the same name. A job inherits these fields."""

    procedure: str
    unit: str
    priority: int = 10
    """Smaller runs first."""
    labels: dict[str, str] = field(default_factory=dict[str, str])
    seed: int | None = None
    """Of the simulated world; None on a real bench."""
    deadline_at: datetime | None = None
    """No station begins later; the job then fails."""
    retries: int = 0
    """How often a fault of the bench may be answered by trying again from the station that failed."""
    reservation: str | None = None
    """The reservation under which it runs; None: it waits while its bench or unit is reserved."""


@dataclass(frozen=True, kw_only=True)
class JobRequest(JobTerms):
    """A job as a client asks for it."""

    bench: str | None = None
    parameters: dict[str, Any] = field(default_factory=dict[str, Any])


def fingerprint(request: object) -> str:
    """A digest of what a client asked, the same for the same request."""
    return hashlib.sha256(json.dumps(request, sort_keys=True, default=_plain).encode()).hexdigest()


def _plain(value: object) -> object:
    return value.isoformat() if isinstance(value, datetime) else vars(value)
