"""Construction of the stores: one database, all stores. Must not know their callers."""

from bench_service.campaigns.stores import Stores
from bench_service.persistence.access.access_store import SqlAccessStore
from bench_service.persistence.bench.live_store import SqlLiveStore
from bench_service.persistence.bench.prompt_store import SqlPromptStore
from bench_service.persistence.bench.registry_store import SqlBenchRegistry
from bench_service.persistence.campaign_store import SqlCampaignStore
from bench_service.persistence.database import Database, connect
from bench_service.persistence.evidence.calibration_store import SqlCalibrationStore
from bench_service.persistence.evidence.correction_store import SqlCorrectionStore
from bench_service.persistence.evidence.recording_store import SqlRecordingStore
from bench_service.persistence.evidence.result_store import SqlResultStore
from bench_service.persistence.evidence.unit_store import SqlUnitStore
from bench_service.persistence.idempotency import SqlKeyStore
from bench_service.persistence.jobs.job_store import SqlJobStore
from bench_service.persistence.jobs.queue_store import SqlQueueStore
from bench_service.persistence.jobs.reservation_store import SqlReservationStore
from bench_service.persistence.migration import upgrade_to_head
from bench_service.persistence.telemetry.audit_store import SqlAuditTrail
from bench_service.persistence.telemetry.tally_store import SqlTallyStore


def open_stores(database_url: str) -> tuple[Stores, Database]:
    """Open all stores behind a URL, in the newest form; `Database.dispose` closes it. Raises `StorageFailure`."""
    database = connect(database_url)
    try:
        upgrade_to_head(database)
    except BaseException:
        database.dispose()
        raise
    return stores_of(database), database


def stores_of(database: Database) -> Stores:
    """Build the stores of a database that is in the newest form."""
    return Stores(
        jobs=SqlJobStore(database),
        queue=SqlQueueStore(database),
        reservations=SqlReservationStore(database),
        recordings=SqlRecordingStore(database),
        results=SqlResultStore(database),
        units=SqlUnitStore(database),
        benches=SqlBenchRegistry(database),
        campaigns=SqlCampaignStore(database),
        calibrations=SqlCalibrationStore(database),
        corrections=SqlCorrectionStore(database),
        live=SqlLiveStore(database),
        prompts=SqlPromptStore(database),
        audit=SqlAuditTrail(database),
        tallies=SqlTallyStore(database),
        access=SqlAccessStore(database),
        keys=SqlKeyStore(database),
    )
