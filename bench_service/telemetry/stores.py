"""Stores that `telemetry` needs: the audit trail, the counts that a monitor reads, and the reports of upkeep."""

from dataclasses import dataclass

from bench_service.telemetry.audit import AuditTrail
from bench_service.telemetry.tallies import TallyStore
from bench_service.telemetry.upkeep import UpkeepStore


@dataclass(frozen=True)
class TelemetryStores:
    """The stores of what the service itself did, as one value: audit trail, counts, reports of upkeep."""

    audit: AuditTrail
    tallies: TallyStore
    upkeep: UpkeepStore
