"""Searches of jobs, recordings and results as SQL. Knows how names of files stand in JSON documents.

Ids sort by time, so a moment bounds the ids too: a search for an old month does not walk over everything newer.
"""

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Any, TypeVar

from sqlalchemy import ColumnElement, Select, and_, exists, func, literal_column, or_, select
from sqlalchemy.ext.compiler import compiles
from sqlalchemy.orm import InstrumentedAttribute
from sqlalchemy.sql.functions import FunctionElement

from bench_service.model.job import job_number
from bench_service.model.search import LabelSought, Search
from bench_service.persistence.tables.columns import KEY_LENGTH
from bench_service.persistence.tables.evidence import NAMES_JOIN, RecordingRow, ResultRow
from bench_service.persistence.tables.jobs import JobLabelRow, JobRow

S = TypeVar("S", bound=Select[*tuple[Any, ...]])
CLOCK_DIFFERS = timedelta(hours=1)
"""Longest time by which the moment in an id may differ from the moment that is stored with it."""


class ImportedNames(FunctionElement[Any]):
    """Names of the files in the `source` of an import, as rows."""

    name = "imported_names"
    inherit_cache = True


def find_jobs(query: S, search: Search, text: bool = True) -> S:
    """Restrict a query of jobs.

    `text`: also by the text; a list finds that along indexes instead (`text_search`).
    """
    query = _made(query, JobRow.id, JobRow.created_at, search)
    if search.verdict is not None:
        query = query.where(JobRow.verdict == search.verdict.value)
    query = query.where(*(_has_label(label, JobRow.id) for label in search.labels))
    if search.text is None or not text:
        return query
    named = (JobRow.id, JobRow.procedure, JobRow.unit, JobRow.bench, JobRow.requested_by)
    return query.where(or_(_one_holds(named, search.text), _of_job(search.text, JobRow.id)))


def find_recordings(query: S, search: Search, text: bool = True) -> S:
    """Restrict a query of recordings; verdict and labels are those of the job that recorded.

    `text`: also by the text; a list finds that along indexes instead (`text_search`).
    """
    query = _made(query, RecordingRow.id, RecordingRow.created_at, search)
    job = RecordingRow.job_id == JobRow.id
    if search.verdict is not None:
        query = query.where(exists().where(job, JobRow.verdict == search.verdict.value))
    query = query.where(*(_has_label(label, RecordingRow.job_id) for label in search.labels))
    if search.text is None or not text:
        return query
    named = (RecordingRow.id, RecordingRow.unit, RecordingRow.bench, RecordingRow.job_id, RecordingRow.station_label)
    in_job = _of_job(search.text, RecordingRow.job_id)
    return query.where(or_(_one_holds(named, search.text), in_job, imported_name_holds(search.text)))


def find_results(query: S, search: Search, text: bool = True) -> S:
    """Restrict a query of results; labels are those of the job whose recordings were analysed.

    `text`: also by the text; a list finds that along indexes instead (`text_search`).
    """
    query = _made(query, ResultRow.id, ResultRow.created_at, search)
    if search.verdict is not None:
        query = query.where(ResultRow.verdict == search.verdict.value)
    query = query.where(*(_has_label(label, ResultRow.job_id) for label in search.labels))
    if search.text is None or not text:
        return query
    named = (ResultRow.id, ResultRow.name, ResultRow.unit, ResultRow.job_id)
    in_job = _of_job(search.text, ResultRow.job_id)
    return query.where(or_(_one_holds(named, search.text), in_job))


def _made(query: S, key: InstrumentedAttribute[str], at: InstrumentedAttribute[datetime], search: Search) -> S:
    if search.since is not None:
        query = query.where(at >= search.since, key >= first_id(search.since, -CLOCK_DIFFERS))
    if search.until is not None:
        query = query.where(at < search.until, key < first_id(search.until, CLOCK_DIFFERS))
    return query


def first_id(moment: datetime, shift: timedelta = timedelta(0)) -> str:
    """Return the beginning of the ids that are made from a moment on; it sorts before all of them."""
    try:
        seconds = (moment + shift).timestamp()
    except OverflowError:  # at the ends of the calendar
        seconds = moment.timestamp()
    digits = f"{min(max(0, int(seconds * 1000)), 2**48 - 1):012x}"
    return f"{digits[:8]}-{digits[8:]}"


def _has_label(label: LabelSought, job: ColumnElement[Any] | InstrumentedAttribute[Any]) -> ColumnElement[bool]:
    """Restrict to the jobs that have a label: a walk over an index of the labels, however long the history."""
    having = select(JobLabelRow.job_id).where(JobLabelRow.name == label.name)
    return job.in_(having if label.value is None else having.where(JobLabelRow.value == label.value))


def _label_holds(text: str, job: ColumnElement[Any] | InstrumentedAttribute[Any]) -> ColumnElement[bool]:
    return job.in_(select(JobLabelRow.job_id).where(_one_holds((JobLabelRow.name, JobLabelRow.value), text)))


def _one_holds(columns: Sequence[Any], text: str) -> ColumnElement[bool]:
    """Return whether one of some columns holds a text: one comparison with all of them in a row, a line each."""
    joined = func.coalesce(columns[0], "")
    for column in columns[1:]:
        joined = joined.concat("\n").concat(func.coalesce(column, ""))
    return or_(*(text_held(column, text) for column in columns)) if "\n" in text else text_held(joined, text)


def _of_job(text: str, job: ColumnElement[Any] | InstrumentedAttribute[Any]) -> ColumnElement[bool]:
    """Restrict to the jobs with a label that holds a text, and to the one whose number the text is."""
    labelled, number = _label_holds(text, job), job_number(text)
    return labelled if number is None else or_(labelled, job.in_(select(JobRow.id).where(JobRow.number == number)))


def text_held(column: Any, text: str) -> ColumnElement[bool]:
    """Return whether a column holds a text, capital or small."""
    return column.icontains(text, autoescape=True)


def imported_name_holds(text: str, row: type[RecordingRow] = RecordingRow) -> ColumnElement[bool]:
    """Return whether the name of an imported file holds a text."""
    held = text_held(row.file_names, text)
    if NAMES_JOIN in text:
        files = ImportedNames(row.source).table_valued("name")
        held = and_(held, exists(select(files.c.name).where(text_held(files.c.name, text))))
    return and_(row.file_names.is_not(None), held)


def short(column: Any) -> ColumnElement[bool]:
    """Return whether a text is short, as the condition of the index of such texts says it: the bound in words."""
    return func.length(column) <= literal_column(str(KEY_LENGTH))


def long(column: Any) -> ColumnElement[bool]:
    """Return whether a text is long, as the condition of the index of their rows says it."""
    return func.length(column) > literal_column(str(KEY_LENGTH))


@compiles(ImportedNames, "sqlite")
def _names_sqlite(element: ImportedNames, compiler: Any, **given: Any) -> str:
    source = compiler.process(element.clauses, **given)
    return f"(SELECT json_extract(value, '$.name') AS name FROM json_each({source}, '$.files'))"


@compiles(ImportedNames, "postgresql")
def _names_postgres(element: ImportedNames, compiler: Any, **given: Any) -> str:
    source = compiler.process(element.clauses, **given)
    return f"(SELECT value ->> 'name' AS name FROM json_array_elements({source} -> 'files'))"
