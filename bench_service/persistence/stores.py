"""Putting the stores together: one database, all stores. Must not know who uses them."""

from bench_service.jobs.store import Stores
from bench_service.persistence.audit_store import SqlAuditTrail
from bench_service.persistence.campaign_store import SqlCampaignStore
from bench_service.persistence.correction_store import SqlCorrectionStore
from bench_service.persistence.database import Database, connect
from bench_service.persistence.idempotency import SqlKeyStore
from bench_service.persistence.job_store import SqlJobStore
from bench_service.persistence.live_store import SqlLiveStore
from bench_service.persistence.migration import upgrade_to_head
from bench_service.persistence.prompt_store import SqlPromptStore
from bench_service.persistence.queue_store import SqlQueueStore
from bench_service.persistence.recording_store import SqlRecordingStore
from bench_service.persistence.reservation_store import SqlReservationStore
from bench_service.persistence.result_store import SqlResultStore
from bench_service.persistence.tally_store import SqlTallyStore
from bench_service.persistence.unit_store import SqlUnitStore


def open_stores(database_url: str) -> tuple[Stores, Database]:
    """All memory behind a URL, brought to the newest form; `Database.dispose` closes it. Raises `StorageFailure`."""
    database = connect(database_url)
    try:
        upgrade_to_head(database)
    except BaseException:
        database.dispose()
        raise
    return stores_of(database), database


def stores_of(database: Database) -> Stores:
    """The stores of a database that is in the newest form."""
    return Stores(
        jobs=SqlJobStore(database),
        queue=SqlQueueStore(database),
        reservations=SqlReservationStore(database),
        recordings=SqlRecordingStore(database),
        results=SqlResultStore(database),
        units=SqlUnitStore(database),
        campaigns=SqlCampaignStore(database),
        corrections=SqlCorrectionStore(database),
        live=SqlLiveStore(database),
        prompts=SqlPromptStore(database),
        audit=SqlAuditTrail(database),
        tallies=SqlTallyStore(database),
        keys=SqlKeyStore(database),
    )
