"""A job as a client asks for it, and how a repeated request is recognised."""

import hashlib
import json
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

CAMPAIGN_RUN = "campaign_run"
"""The label that names the campaign run to which a job belongs."""


@dataclass(frozen=True)
class JobRequest:
    """A job as a client asks for it."""

    procedure: str
    unit: str
    bench: str | None = None
    parameters: dict[str, Any] = field(default_factory=dict[str, Any])
    priority: int = 10
    labels: dict[str, str] = field(default_factory=dict[str, str])
    seed: int | None = None
    deadline_at: datetime | None = None
    """No station begins later."""
    retries: int = 0
    """How often a fault of the bench is answered by trying again."""
    reservation: str | None = None
    """The reservation under which it runs."""


def fingerprint(request: object) -> str:
    """A digest of what a client asked, the same for the same request."""
    return hashlib.sha256(json.dumps(request, sort_keys=True, default=_plain).encode()).hexdigest()


def _plain(value: object) -> object:
    return value.isoformat() if isinstance(value, datetime) else vars(value)
