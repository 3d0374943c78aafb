"""Pages of lists, newest first: ids sort by time, so the cursor of the next page is the last id of this one."""

from collections.abc import Callable
from typing import Any, TypeVar

from sqlalchemy import Select
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
    rows = session.scalars(query.order_by(key.desc()).limit(limit + 1)).all()
    shown = rows[:limit]
    items = (item(row) for row in shown)
    return Page(
        tuple(made for made in items if made is not None), shown[-1].id if len(rows) > limit and shown else None
    )
