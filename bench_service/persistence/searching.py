"""Searches of jobs, recordings and results as SQL. Knows how labels and file names stand in JSON documents.

Ids sort by time, so a moment bounds the ids too: a search for an old month does not walk over everything newer.
"""

from datetime import datetime, timedelta
from typing import Any, TypeVar

from sqlalchemy import ColumnElement, Select, exists, or_, select
from sqlalchemy.ext.compiler import compiles
from sqlalchemy.orm import InstrumentedAttribute
from sqlalchemy.sql.functions import FunctionElement

from bench_service.model.job import job_number
from bench_service.model.search import LabelSought, Search
from bench_service.persistence.tables.evidence import RecordingRow, ResultRow
from bench_service.persistence.tables.jobs import JobRow

S = TypeVar("S", bound=Select[Any])
CLOCK_DIFFERS = timedelta(hours=1)
"""Longest time by which the moment in an id may differ from the moment that is stored with it."""


class JsonPairs(FunctionElement[Any]):
    """Keys and values of a JSON object of texts, as rows."""

    name = "json_pairs"
    inherit_cache = True


class ImportedNames(FunctionElement[Any]):
    """Names of the files in the `source` of an import, as rows."""

    name = "imported_names"
    inherit_cache = True


def find_jobs(query: S, search: Search) -> S:
    """Restrict a query of jobs."""
    query = _made(query, JobRow.id, JobRow.created_at, search)
    if search.verdict is not None:
        query = query.where(JobRow.verdict == search.verdict.value)
    query = query.where(*(_has_label(label) for label in search.labels))
    if search.text is None:
        return query
    named = (JobRow.id, JobRow.procedure, JobRow.unit, JobRow.bench, JobRow.requested_by)
    texts = [_holds(column, search.text) for column in named]
    return query.where(or_(*texts, _label_holds(search.text), *_numbered(search.text)))


def find_recordings(query: S, search: Search) -> S:
    """Restrict a query of recordings; verdict and labels are those of the job that recorded."""
    query = _made(query, RecordingRow.id, RecordingRow.created_at, search)
    job = RecordingRow.job_id == JobRow.id
    if search.verdict is not None:
        query = query.where(exists().where(job, JobRow.verdict == search.verdict.value))
    query = query.where(*(exists().where(job, _has_label(label)) for label in search.labels))
    if search.text is None:
        return query
    station = RecordingRow.station["label"].as_string()
    files = ImportedNames(RecordingRow.source).table_valued("name")
    named = (RecordingRow.id, RecordingRow.unit, RecordingRow.bench, RecordingRow.job_id, station)
    in_job = exists().where(job, or_(_label_holds(search.text), *_numbered(search.text)))
    in_file = exists(select(files.c.name).where(_holds(files.c.name, search.text)))
    return query.where(or_(*(_holds(column, search.text) for column in named), in_job, in_file))


def find_results(query: S, search: Search) -> S:
    """Restrict a query of results; labels are those of the job whose recordings were analysed."""
    query = _made(query, ResultRow.id, ResultRow.created_at, search)
    job = ResultRow.job_id == JobRow.id
    if search.verdict is not None:
        query = query.where(ResultRow.verdict == search.verdict.value)
    query = query.where(*(exists().where(job, _has_label(label)) for label in search.labels))
    if search.text is None:
        return query
    named = (ResultRow.id, ResultRow.name, ResultRow.unit, ResultRow.job_id)
    in_job = exists().where(job, or_(_label_holds(search.text), *_numbered(search.text)))
    return query.where(or_(*(_holds(column, search.text) for column in named), in_job))


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


def _has_label(label: LabelSought) -> ColumnElement[bool]:
    pairs = JsonPairs(JobRow.labels).table_valued("key", "value")
    wanted = [pairs.c.key == label.name] + ([] if label.value is None else [pairs.c.value == label.value])
    return exists(select(pairs.c.key).where(*wanted))


def _label_holds(text: str) -> ColumnElement[bool]:
    pairs = JsonPairs(JobRow.labels).table_valued("key", "value")
    return exists(select(pairs.c.key).where(or_(_holds(pairs.c.key, text), _holds(pairs.c.value, text))))


def _numbered(text: str) -> list[ColumnElement[bool]]:
    """Condition that a job has the number that the text is, where it is one."""
    number = job_number(text)
    return [] if number is None else [JobRow.number == number]


def _holds(column: Any, text: str) -> ColumnElement[bool]:
    return column.icontains(text, autoescape=True)


@compiles(JsonPairs, "sqlite")
def _pairs_sqlite(element: JsonPairs, compiler: Any, **given: Any) -> str:
    return f"json_each({compiler.process(element.clauses, **given)})"


@compiles(JsonPairs, "postgresql")
def _pairs_postgres(element: JsonPairs, compiler: Any, **given: Any) -> str:
    return f"json_each_text({compiler.process(element.clauses, **given)})"


@compiles(ImportedNames, "sqlite")
def _names_sqlite(element: ImportedNames, compiler: Any, **given: Any) -> str:
    source = compiler.process(element.clauses, **given)
    return f"(SELECT json_extract(value, '$.name') AS name FROM json_each({source}, '$.files'))"


@compiles(ImportedNames, "postgresql")
def _names_postgres(element: ImportedNames, compiler: Any, **given: Any) -> str:
    source = compiler.process(element.clauses, **given)
    return f"(SELECT value ->> 'name' AS name FROM json_array_elements({source} -> 'files'))"
