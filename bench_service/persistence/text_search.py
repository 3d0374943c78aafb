"""Searches of jobs, recordings and results by a text, along indexes. Knows which columns a text is sought in, and how
names of files stand in JSON documents; must not know how lists are paged.

To look for a part of a word in every row costs what the history costs. A history has few different words: units,
procedures, benches, people, stations and labels repeat. So the different values of a column are gone through first, by
one step along its index for each, and then only the rows that have one of those that hold the text. Ids are all
different, and are looked through in their index alone, where the text could be a part of one. Names of files and labels
of stations may be of any length: the few long ones are no keys, and are read from their rows.

A search gets conditions of which at least one must hold; each of them is a walk along one index.
"""

import re
from collections.abc import Sequence
from typing import Any

from sqlalchemy import ColumnElement, and_, exists, func, or_, select
from sqlalchemy.ext.compiler import compiles
from sqlalchemy.orm import InstrumentedAttribute, Session, aliased
from sqlalchemy.sql.functions import FunctionElement

from bench_service.model.job import job_number
from bench_service.persistence.tables.columns import is_long, is_short
from bench_service.persistence.tables.evidence import NAMES_JOIN, RecordingRow, ResultRow
from bench_service.persistence.tables.jobs import JobLabelRow, JobRow

MOST = 2000
"""Different values of a column that are gone through; of a column with more of them every value is looked at."""
LABEL_NAMES = 50
"""Different names of labels whose values are gone through, name by name."""
LISTED = 500
"""Values in one condition; where more of them hold the text, rows with it are frequent."""
ID_LENGTH = 36
Ways = tuple[ColumnElement[bool], ...]

_OTHER = aliased(RecordingRow)
_PART_OF_ID = re.compile(r"[0-9a-f-]{1,36}", re.IGNORECASE)
_Column = InstrumentedAttribute[Any]


class ImportedNames(FunctionElement[Any]):
    """SQL function with the names of the files in the `source` of an import, as rows."""

    name = "imported_names"
    inherit_cache = True


def ways_to_jobs(session: Session, text: str) -> Ways:
    """Return conditions of jobs, at least one of which holds where a job has the text."""
    named = (JobRow.procedure, JobRow.unit, JobRow.bench, JobRow.requested_by)
    return (*_in_columns(session, named, text), *_in_ids(JobRow.id, text), *_in_job(session, JobRow.id, text))


def ways_to_recordings(session: Session, text: str) -> Ways:
    """Return conditions of recordings, at least one of which holds where a recording or its job's labels have the
    text.
    """
    label = _in_column(session, RecordingRow.station_label, text, is_short(RecordingRow.station_label))
    names = _imported_name_holds(text)
    by_row = (
        and_(is_long(_OTHER.station_label), _holds(_OTHER.station_label, text)),
        and_(is_short(_OTHER.file_names), names),
        and_(is_long(_OTHER.file_names), names),
    )
    of_job = tuple(RecordingRow.job_id.in_(select(JobRow.id).where(way)) for way in _in_ids(JobRow.id, text))
    return (
        *_in_columns(session, (RecordingRow.unit, RecordingRow.bench), text),
        *([] if label is None else [label]),
        *_in_ids(RecordingRow.id, text),
        *of_job,
        *_in_job(session, RecordingRow.job_id, text),
        *(RecordingRow.id.in_(select(_OTHER.id).where(way)) for way in by_row),
    )


def ways_to_results(session: Session, text: str) -> Ways:
    """Return conditions of results, at least one of which holds where a result or its job's labels have the text."""
    of_job = tuple(ResultRow.job_id.in_(select(JobRow.id).where(way)) for way in _in_ids(JobRow.id, text))
    return (
        *_in_columns(session, (ResultRow.name, ResultRow.unit), text),
        *_in_ids(ResultRow.id, text),
        *of_job,
        *_in_job(session, ResultRow.job_id, text),
    )


def _in_columns(session: Session, columns: Sequence[_Column], text: str) -> list[ColumnElement[bool]]:
    ways = (_in_column(session, column, text) for column in columns)
    return [way for way in ways if way is not None]


def _in_column(session: Session, column: _Column, text: str, *where: ColumnElement[bool]) -> ColumnElement[bool] | None:
    """Return the condition that a column holds a text; None where no row does. `where`: see `_values`."""
    known = _values(session, column, text, where)
    if known is None or sum(known.values()) > LISTED:
        return and_(*where, _holds(column, text))
    having = [value for value, held in known.items() if held]
    return and_(*where, column.in_(having)) if having else None


def _values(
    session: Session, column: _Column, text: str, where: Sequence[ColumnElement[bool]]
) -> dict[str, bool] | None:
    """Find the different values of a column, and whether each holds a text; None where there are more than `MOST`.

    The column begins an index, whose condition `where` is, or follows columns in one that `where` fixes.
    """
    steps = select(func.min(column).label("value")).where(*where).cte("steps", recursive=True)
    following = select(func.min(column)).where(*where, column > steps.c.value).correlate(steps).scalar_subquery()
    steps = steps.union_all(select(following).where(steps.c.value.is_not(None)))
    query = select(steps.c.value, _holds(steps.c.value, text)).where(steps.c.value.is_not(None)).limit(MOST + 1)
    found = session.execute(query).all()
    return None if len(found) > MOST else {value: bool(held) for value, held in found}


def _in_job(session: Session, job: ColumnElement[Any] | _Column, text: str) -> list[ColumnElement[bool]]:
    """Conditions that a job has a label that holds a text, or the number that the text is."""
    pairs = list[ColumnElement[bool]]()
    names = _values(session, JobLabelRow.name, text, ())
    if names is None or len(names) > LABEL_NAMES:
        pairs = [_holds(JobLabelRow.name, text), _holds(JobLabelRow.value, text)]
    else:
        for name, held in names.items():
            named = JobLabelRow.name == name
            way = named if held else _in_column(session, JobLabelRow.value, text, named)
            pairs += [] if way is None else [way]
    ways: list[ColumnElement[bool]] = [job.in_(select(JobLabelRow.job_id).where(or_(*pairs)))] if pairs else []
    number = job_number(text)
    return ways if number is None else [*ways, job.in_(select(JobRow.id).where(JobRow.number == number))]


def _in_ids(key: _Column, text: str) -> list[ColumnElement[bool]]:
    """Conditions that an id is, or holds, a text: none where no id could."""
    if not _PART_OF_ID.fullmatch(text):
        return []
    if len(text) == ID_LENGTH:
        return [key == text.lower()]
    other = aliased(key.class_)
    return [key.in_(select(getattr(other, key.key)).where(getattr(other, key.key).contains(text.lower())))]


def _holds(column: Any, text: str) -> ColumnElement[bool]:
    """Return whether a column holds a text, capital or small."""
    return column.icontains(text, autoescape=True)


def _imported_name_holds(text: str) -> ColumnElement[bool]:
    """Return whether the name of an imported file holds a text.

    Names are stored joined by line breaks, so a text that has one is sought in each name by itself, too.
    """
    held = _holds(_OTHER.file_names, text)
    if NAMES_JOIN in text:
        files = ImportedNames(_OTHER.source).table_valued("name")
        held = and_(held, exists(select(files.c.name).where(_holds(files.c.name, text))))
    return and_(_OTHER.file_names.is_not(None), held)


@compiles(ImportedNames, "sqlite")
def _names_sqlite(element: ImportedNames, compiler: Any, **given: Any) -> str:
    source = compiler.process(element.clauses, **given)
    return f"(SELECT json_extract(value, '$.name') AS name FROM json_each({source}, '$.files'))"


@compiles(ImportedNames, "postgresql")
def _names_postgres(element: ImportedNames, compiler: Any, **given: Any) -> str:
    source = compiler.process(element.clauses, **given)
    return f"(SELECT value ->> 'name' AS name FROM json_array_elements({source} -> 'files'))"
