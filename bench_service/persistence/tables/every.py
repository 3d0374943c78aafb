"""Every table of the database in one metadata: what migrations compare a database with."""

from bench_service.persistence.tables import access, batches, bench, campaigns, evidence, jobs, manual, telemetry
from bench_service.persistence.tables.columns import Table

ROOMS = (access, batches, bench, campaigns, evidence, jobs, manual, telemetry)
METADATA = Table.metadata
