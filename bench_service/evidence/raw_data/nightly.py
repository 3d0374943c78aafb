"""The nightly work on raw data: retention and archive by the rules of the deployment, once a night and database."""

import logging
from collections.abc import Callable
from dataclasses import replace
from threading import Event

from bench_service.evidence.raw_data.service import RawDataService
from bench_service.evidence.stores import EvidenceStores
from bench_service.evidence.upkeep import APART
from bench_service.model.errors import ServiceError
from bench_service.model.raw_data import RawPlan
from bench_service.telemetry.audit import record
from bench_service.telemetry.upkeep import UpkeepKind, UpkeepReport
from bench_service.wall_clock import new_id, now
from procedures.core.errors import DomainError

BY = "retention"
"""Name under which the night removes and archives in the audit trail."""

log = logging.getLogger(__name__)


class NightlyStorage:
    """Applies the deployment's rules of retention and archive once a night; of several processes on one database the
    first one of the night does it.
    """

    def __init__(self, raw_data: RawDataService, stores: EvidenceStores, by: str) -> None:
        """Set up with `by`, the name of this process in reports."""
        self._by = by
        self._raw_data = raw_data
        self._stores = stores

    def run(self, ending: Event) -> None:
        """Remove and archive raw data as the rules say, until done or `ending` is set; blocks, and stores reports and
        audit entries.
        """
        rules, raw = self._raw_data.settings, self._raw_data
        if rules.remove_days is not None:
            self._one(UpkeepKind.RETENTION, "remove_raw_data", lambda go: raw.remove(None, False, go), ending)
        if rules.archive_days is not None and rules.archive is not None:
            self._one(UpkeepKind.ARCHIVE, "archive_raw_data", lambda go: raw.archive(None, False, go), ending)

    def _one(self, kind: UpkeepKind, act: str, work: Callable[[Callable[[], bool]], RawPlan], ending: Event) -> None:
        report = UpkeepReport(new_id(), kind, now(), self._by)
        if not self._stores.upkeep.begin(report, now() - APART):
            return
        try:
            plan = work(lambda: not ending.is_set())
        except (ServiceError, DomainError) as error:
            log.error("%s tonight: %s", kind.value, error)
            ended = replace(report, ended_at=now(), good=False, document={"faults": [str(error)]})
            self._stores.upkeep.end(ended)
            return
        document = document_of(plan)
        self._stores.upkeep.end(replace(report, ended_at=now(), good=not plan.faults, document=document))
        detail = {name: document[name] for name in ("days", "done", "done_bytes", "kept")}
        record(self._stores.audit, BY, act, "/api/v1/storage", "done", **detail)
        log.info("%s: raw data of %d recordings, %d bytes", kind.value, plan.done, plan.done_bytes)


def document_of(plan: RawPlan) -> dict[str, object]:
    """Return the outcome of a rule as a JSON object, for the report of the night."""
    return {
        "days": plan.rule.days,
        "before": plan.before.isoformat(),
        "recordings": plan.recordings,
        "stored_bytes": plan.stored_bytes,
        "done": plan.done,
        "done_bytes": plan.done_bytes,
        "kept": {reason.value: number for reason, number in plan.kept.items()},
        "faults": plan.faults,
    }
