"""single starts of campaigns: a moment with its date, in place of a cron line without a year

Revision: 0023, after 0022
"""

import json
from datetime import UTC, datetime
from typing import Any
from zoneinfo import ZoneInfo

import sqlalchemy as sa
from alembic import op

revision = "0023"
down_revision = "0022"
branch_labels = None
depends_on = None

SCHEDULES = sa.table(
    "schedules", sa.column("id", sa.String), sa.column("enabled", sa.Boolean), sa.column("document", sa.JSON)
)
NEXT_AT = sa.text("UPDATE schedules SET next_at = NULL WHERE id = :id")


def upgrade() -> None:
    bind = op.get_bind()
    for row in bind.execute(sa.select(SCHEDULES)).all():
        old: dict[str, Any] = json.loads(row.document) if isinstance(row.document, str) else dict(row.document)
        once = old.pop("once", False)
        new = {**old, "at": None}
        if once:
            over = old["last_at"] is not None  # it was switched on again: its start was, and comes once
            new |= {"cron": None, "time_zone": None, "at": _moment(old)}
            new |= {"enabled": False, "next_at": None} if over else {}
        change = sa.update(SCHEDULES).where(SCHEDULES.c.id == row.id)
        bind.execute(change.values(document=new, enabled=new["enabled"]))
        if new["next_at"] is None:
            bind.execute(NEXT_AT, {"id": row.id})


def downgrade() -> None:
    bind = op.get_bind()
    for row in bind.execute(sa.select(SCHEDULES)).all():
        new: dict[str, Any] = json.loads(row.document) if isinstance(row.document, str) else dict(row.document)
        text = new.pop("at", None)
        old = {**new, "once": text is not None}
        if text is not None:
            at = datetime.fromisoformat(text).astimezone(UTC)
            old |= {"cron": f"{at.minute} {at.hour} {at.day} {at.month} *", "time_zone": "UTC"}
        bind.execute(sa.update(SCHEDULES).where(SCHEDULES.c.id == row.id).values(document=old))


def _moment(schedule: dict[str, Any]) -> str:
    """The moment that was meant: the start that was, or the next one, or of one that is off the first after it was
    made; where its line is of another kind, that is over.
    """
    known = schedule["last_at"] or schedule["next_at"]
    if known is not None:
        return known
    try:
        zone = ZoneInfo(schedule["time_zone"])
        made = datetime.fromisoformat(schedule["created_at"]).astimezone(zone)
        minute, hour, day, month = (int(field) for field in schedule["cron"].split()[:4])
        starts = [datetime(made.year + years, month, day, hour, minute, tzinfo=zone) for years in (0, 1)]
    except (ValueError, KeyError, OSError):  # of the zone too: it is not installed, or has another name by now
        return schedule["created_at"]
    return next((at for at in starts if at > made), made).astimezone(UTC).isoformat()
