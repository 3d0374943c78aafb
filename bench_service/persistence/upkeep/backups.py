"""A copy of the database that is checked and reported: the command ``bench backup``."""

import logging
from pathlib import Path

from bench_service import wall_clock
from bench_service.model.errors import ServiceError
from bench_service.persistence.database import Database, connect
from bench_service.persistence.migration import newest_revision
from bench_service.persistence.telemetry.upkeep_store import SqlUpkeepStore
from bench_service.persistence.upkeep.contents import CopyContents, check_copy
from bench_service.persistence.upkeep.copies import copy_database
from bench_service.telemetry.upkeep import UpkeepKind, UpkeepReport

log = logging.getLogger(__name__)


def back_up(database_url: str, target: Path, by: str) -> CopyContents:
    """Copy a database to a new file, check the copy, and add a report to the database.

    Raises `StorageFailure`, `StorageFull`.
    """
    database = connect(database_url)
    try:
        began_at = wall_clock.now()
        copy_database(database, target)
        contents = check_copy(target)
        if contents.revision == newest_revision():
            document = {"file": str(target.absolute()), "rows": contents.rows, "faults": list(contents.faults)}
            good = not contents.faults
            report = UpkeepReport(
                wall_clock.new_id(), UpkeepKind.BACKUP, began_at, by, wall_clock.now(), good, document
            )
            _report(database, report)
        return contents
    finally:
        database.dispose()


def _report(database: Database, report: UpkeepReport) -> None:
    try:
        SqlUpkeepStore(database).begin(report)
    except ServiceError as error:  # the copy is made and good, whether or not it can be noted
        log.warning("the copy is not entered in the database: %s", error)
