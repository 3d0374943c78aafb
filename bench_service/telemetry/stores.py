"""Stores of the telemetry room: the audit trail, the counts that a monitor reads, and the reports of upkeep."""

from dataclasses import dataclass

from bench_service.telemetry.audit import AuditTrail
from bench_service.telemetry.tallies import TallyStore
from bench_service.telemetry.upkeep import UpkeepStore


@dataclass(frozen=True)
class TelemetryStores:
    """The stores that record what the service itself did."""

    audit: AuditTrail
    tallies: TallyStore
    upkeep: UpkeepStore
