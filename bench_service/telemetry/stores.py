"""Stores of the telemetry room: the audit trail and the counts that a monitor reads."""

from dataclasses import dataclass

from bench_service.telemetry.audit import AuditTrail
from bench_service.telemetry.tallies import TallyStore


@dataclass(frozen=True)
class TelemetryStores:
    """The stores that record what the service itself did."""

    audit: AuditTrail
    tallies: TallyStore
