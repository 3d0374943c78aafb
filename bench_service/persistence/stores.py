"""Construction of the stores: one database, all stores. Must not know their callers."""

import logging
from functools import partial
from pathlib import Path

from bench_service import wall_clock
from bench_service.campaigns.stores import Stores
from bench_service.persistence.access.access_store import SqlAccessStore
from bench_service.persistence.bench.live_store import SqlLiveStore
from bench_service.persistence.bench.mounting_store import SqlMountingStore
from bench_service.persistence.bench.prompt_store import SqlPromptStore
from bench_service.persistence.bench.registry_store import SqlBenchRegistry
from bench_service.persistence.campaign_store import SqlCampaignStore
from bench_service.persistence.database import Database, connect
from bench_service.persistence.evidence.batch_store import SqlBatchStore
from bench_service.persistence.evidence.calibration_store import SqlCalibrationStore
from bench_service.persistence.evidence.correction_store import SqlCorrectionStore
from bench_service.persistence.evidence.raw_store import SqlRawDataStore
from bench_service.persistence.evidence.recording_store import SqlRecordingStore
from bench_service.persistence.evidence.result_store import SqlResultStore
from bench_service.persistence.evidence.unit_note_store import SqlUnitNoteStore
from bench_service.persistence.evidence.unit_store import SqlUnitStore
from bench_service.persistence.idempotency import SqlKeyStore
from bench_service.persistence.jobs.job_store import SqlJobStore
from bench_service.persistence.jobs.manual_store import SqlManualStore
from bench_service.persistence.jobs.queue_store import SqlQueueStore
from bench_service.persistence.jobs.reservation_store import SqlReservationStore
from bench_service.persistence.migration import upgrade_to_head
from bench_service.persistence.telemetry.audit_store import SqlAuditTrail
from bench_service.persistence.telemetry.tally_store import SqlTallyStore
from bench_service.persistence.telemetry.upkeep_store import SqlUpkeepStore

log = logging.getLogger(__name__)


def open_stores(database_url: str, copies: Path | None = None) -> tuple[Stores, Database]:
    """Open all stores behind a URL, in the newest form; `Database.dispose` closes it. Raises `StorageFailure`.

    `copies`: folder of the copy that is made before a database is changed to a newer form; None: next to an SQLite
    file, and of a Postgres database none.
    """
    database = connect(database_url)
    try:
        upgrade_to_head(database, partial(_keep_copy, database, copies))
    except BaseException:
        database.dispose()
        raise
    return stores_of(database), database


def stores_of(database: Database) -> Stores:
    """Return the stores of a database that is in the newest form."""
    return Stores(
        jobs=SqlJobStore(database),
        queue=SqlQueueStore(database),
        reservations=SqlReservationStore(database),
        manual=SqlManualStore(database),
        recordings=SqlRecordingStore(database),
        results=SqlResultStore(database),
        units=SqlUnitStore(database),
        unit_notes=SqlUnitNoteStore(database),
        benches=SqlBenchRegistry(database),
        campaigns=SqlCampaignStore(database),
        calibrations=SqlCalibrationStore(database),
        corrections=SqlCorrectionStore(database),
        live=SqlLiveStore(database),
        prompts=SqlPromptStore(database),
        mountings=SqlMountingStore(database),
        audit=SqlAuditTrail(database),
        tallies=SqlTallyStore(database),
        upkeep=SqlUpkeepStore(database),
        access=SqlAccessStore(database),
        keys=SqlKeyStore(database),
        batches=SqlBatchStore(database),
        raw_data=SqlRawDataStore(database),
    )


def _keep_copy(database: Database, copies: Path | None, old: str, new: str) -> None:
    """Copy a database before its form is changed, and log the place of the copy. Raises `StorageFailure`."""
    from bench_service.persistence.upkeep.copies import copy_database

    stamp = wall_clock.now().strftime("%Y%m%dT%H%M%S.%fZ")
    file = None if database.is_postgres else Path(database.engine.url.database or "")
    folder = copies or (None if file is None else file.parent)
    if folder is None:
        log.warning("the database goes from revision %s to %s without a copy: no folder for it is named", old, new)
        return
    place = folder / f"{'bench' if file is None else file.name}.before-{new}-{stamp}"
    copy_database(database, place)
    log.warning("the database goes from revision %s to %s; a copy of it as it was is %s", old, new, place)
