"""People in a printed report: who asked for the work and when, and their remarks about the unit."""

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime

from bench_service.formats.printed.document import Block, Facts, Heading, PrintedTable
from bench_service.model.job import Job
from bench_service.model.notes import UnitNote
from bench_service.model.records import StoredResult

REMARKS = 50
"""Newest remarks about the unit that a report has."""


def moment(at: datetime | None) -> str:
    """Return a time to the second as text, in UTC with the zone named; a dash for None."""
    return "–" if at is None else f"{at.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC"


def named(by: str, proven: bool) -> str:
    """Return the name of a person, marked where the request declared it without a log-in; empty for none."""
    return by if proven or not by else f"{by} (name as given)"


def people(result: StoredResult, job: Job | None) -> Iterator[Block]:
    """Yield the rows on who asked for the work, and on the times of the job and of the result. `job` None: a result of
    a method.
    """
    yield Heading("Who and when")
    rows = [("result", moment(result.created_at))]
    if job is not None:
        rows = [
            ("requested by", job.requested_by or "no name was given"),
            ("requested", moment(job.created_at)),
            ("begun", moment(job.started_at)),
            ("ended", moment(job.finished_at)),
            ("job", f"{job.number}, {job.id}"),
            ("bench", job.bench),
            *rows,
        ]
    yield Facts(tuple(rows))


def remarks(notes: Sequence[UnitNote]) -> Iterator[Block]:
    """Yield the section of remarks about the unit, newest first; nothing where there are none."""
    if not notes:
        return
    yield Heading("Remarks about the unit")
    rows = tuple((moment(note.at), named(note.by, note.proven), note.text) for note in notes)
    yield PrintedTable("", ("at", "by", "remark"), rows)
