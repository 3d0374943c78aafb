"""Pages of lists, newest first: ids sort by time, so the cursor of the next page is the last id of this one.

Ids are found first, by indexes alone where the conditions allow it, and only then the rows that are shown: a row with
its documents is many times longer than its keys, and sorting or walking over those costs what the history costs.
"""

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from sqlalchemy import ColumnElement, Select, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from bench_service.model.records import Page

R = TypeVar("R", bound=Any)
T = TypeVar("T")


def page(
    session: Session,
    query: Select[R],
    key: InstrumentedAttribute[str],
    after: str | None,
    limit: int,
    item: Callable[[R], T | None],
    either: Sequence[ColumnElement[bool]] | None = None,
) -> Page[T]:
    """Return the next `limit` rows older than the id `after`, each converted to an item; a row that cannot be converted
    is left out.

    `either`: conditions of which at least one must hold, each found by an index of its own; None: no such condition.
    """
    if after is not None:
        query = query.where(key < after)
    newest = query.with_only_columns(key).order_by(key.desc()).limit(limit + 1)
    parts = [newest] if either is None else [newest.where(way) for way in either]
    ids = sorted({found for part in parts for found in session.scalars(part)}, reverse=True)[: limit + 1]
    shown = ids[:limit]
    if not shown:
        return Page(())
    whole: Select[Any] = select(key.class_).where(key.in_(shown)).order_by(key.desc())
    items = (item(row) for row in session.scalars(whole))
    return Page(tuple(made for made in items if made is not None), shown[-1] if len(ids) > limit else None)
