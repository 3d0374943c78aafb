"""Pages of lists, newest first: ids sort by time, so the cursor of the next page is the last id of this one.

Ids are found first, by indexes alone where the conditions allow it, and only then the rows that are shown: a row with
its documents is many times longer than its keys, and sorting or walking over those costs what the history costs.
"""

from collections.abc import Callable
from typing import Any, TypeVar

from sqlalchemy import Select, select
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
) -> Page[T]:
    """The next `limit` rows older than `after`, each made an item; one of which none can be made is left out."""
    if after is not None:
        query = query.where(key < after)
    ids = session.scalars(query.with_only_columns(key).order_by(key.desc()).limit(limit + 1)).all()
    shown = ids[:limit]
    if not shown:
        return Page(())
    whole: Select[Any] = select(key.class_).where(key.in_(shown)).order_by(key.desc())
    items = (item(row) for row in session.scalars(whole))
    return Page(tuple(made for made in items if made is not None), shown[-1] if len(ids) > limit else None)
