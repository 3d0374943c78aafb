"""Submission and control of batches of analyses: a selection of recordings becomes tasks, one for each group."""

from collections.abc import Callable, Sequence
from typing import Any

from pydantic_core import to_jsonable_python

from bench_service.evidence.catalogue import Catalogue
from bench_service.evidence.stores import EvidenceStores
from bench_service.model.batches import AnalysisBatch, BatchRequest, Grouping
from bench_service.model.errors import Overloaded
from bench_service.model.records import Idempotency
from bench_service.wall_clock import new_id, now
from procedures.core.errors import BadParameter

MOST_RECORDINGS = 20_000
"""Largest number of recordings of one batch; for more, submit several batches, by dates or units."""
MOST_WAITING = 100_000
"""Largest number of tasks of all batches that wait at one time; further batches are refused for now."""


class BatchService:
    """Operations of clients on batches of analyses, from submission to retry; `BatchRunner` and other processes run the
    tasks.
    """

    def __init__(self, stores: EvidenceStores, catalogue: Catalogue, wake: Callable[[], object] = lambda: None) -> None:
        """Set up with `wake`, called after a batch was queued."""
        self._stores = stores
        self._catalogue = catalogue
        self._wake = wake

    def submit(self, request: BatchRequest, requested_by: str, key: str | None = None) -> AnalysisBatch:
        """Queue one task for each group of the selected recordings.

        Raises `NotFound` for the method and the calibrations, `ValidationError` for the parameters, `BadParameter`
        for a selection that is empty, too large or names what is no complete recording, and `Overloaded`.
        """
        idempotency = Idempotency.of("batches", key, _document(request))
        known = self._stores.keys.made(idempotency, "batch")
        if known is not None:
            return self._stores.batches.get(known)
        method = self._catalogue.method(request.method)
        params = method.params.model_validate(request.parameters)
        self._stores.calibrations.several(request.calibrations)
        waiting = self._stores.batches.waiting(MOST_WAITING)
        if waiting >= MOST_WAITING:
            raise Overloaded(f"{waiting} analyses wait already: submit this batch later, or cancel another one")
        groups = self._groups(request)
        batch = AnalysisBatch(
            id=new_id(),
            method=method.name,
            version=method.version,
            parameters=params.model_dump(mode="json"),
            calibrations=request.calibrations,
            each=request.each,
            priority=request.priority,
            selection=_document(request)["selection"],
            requested_by=requested_by,
            created_at=now(),
            total=len(groups),
        )
        added = self._stores.batches.add(batch, groups, idempotency)
        self._wake()
        return added

    def cancel(self, batch_id: str, by: str) -> AnalysisBatch:
        """Cancel the waiting tasks of a batch and return it; those that run end by themselves. Raises `NotFound`,
        `IllegalTransition`.
        """
        return self._stores.batches.cancel(batch_id, by, now())

    def retry(self, batch_id: str) -> AnalysisBatch:
        """Queue failed and cancelled tasks of a batch again, and return it. Raises `NotFound`, `IllegalTransition`."""
        batch = self._stores.batches.retry(batch_id, now())
        self._wake()
        return batch

    def _groups(self, request: BatchRequest) -> list[tuple[str, ...]]:
        """Ids of recordings by task, oldest first. Raises `BadParameter`."""
        found = self._stores.batches.select(request.selection, MOST_RECORDINGS + 1)
        missing = sorted(set(request.selection.ids) - {recording for recording, _, _ in found})
        if missing:
            raise BadParameter("selection.ids", missing[0], "ids of complete recordings that meet the other conditions")
        if not found:
            raise BadParameter("selection", "", "conditions that at least one complete recording meets")
        if len(found) > MOST_RECORDINGS:
            raise BadParameter(
                "selection",
                f"more than {MOST_RECORDINGS} recordings",
                f"at most {MOST_RECORDINGS} recordings a batch: narrow it by since and until, or by unit",
            )
        return grouped(found, request.each)


def grouped(found: Sequence[tuple[str, str | None, str]], each: Grouping) -> list[tuple[str, ...]]:
    """Group the ids of recordings, given as (id, job, unit), in the order of their first ones; a recording without a
    job is a group alone.
    """
    groups: dict[str, list[str]] = {}
    for recording, job, unit in found:
        by = {Grouping.RECORDING: recording, Grouping.JOB: job or recording, Grouping.UNIT: unit}[each]
        groups.setdefault(by, []).append(recording)
    return [tuple(ids) for ids in groups.values()]


def _document(request: BatchRequest) -> dict[str, Any]:
    """The request as JSON."""
    return to_jsonable_python(request)
