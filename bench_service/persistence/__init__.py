"""Memory in SQL: SQLite on one machine, Postgres for many, the same code. Knows no HTTP and no job engine.

`open_stores` is the way in; `acquire_lease` is the right to drive a bench. Every error of the database leaves here as
`StorageFull` or `StorageFailure`.
"""

from bench_service.persistence.database import Database
from bench_service.persistence.engine_database import engine_database
from bench_service.persistence.lease import BenchLease, acquire_lease, lease_holder
from bench_service.persistence.stores import open_stores

__all__ = ["BenchLease", "Database", "acquire_lease", "engine_database", "lease_holder", "open_stores"]
