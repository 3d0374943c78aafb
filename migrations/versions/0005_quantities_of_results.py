"""every number of a result under its name, beside its document

Revision: 0005, after 0004
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

ID = sa.String().with_variant(sa.String(collation="C"), "postgresql")
AT_ONCE = 20
"""Documents in memory."""


@dataclass(frozen=True)
class _Quantity:
    """A copy of the product's class as this migration landed: migrations import nothing of the product."""

    name: str
    value: float
    unit: str
    standard_uncertainty: float | None = None


def upgrade() -> None:
    table = op.create_table(
        "result_quantities",
        sa.Column("result_id", ID, nullable=False),
        sa.Column("name", ID, nullable=False),
        sa.Column("value", sa.Float(53), nullable=False),
        sa.Column("unit", sa.String(), nullable=False),
        sa.Column("standard_uncertainty", sa.Float(53), nullable=True),
        sa.ForeignKeyConstraint(["result_id"], ["results.id"], name=op.f("fk_result_quantities_result_id_results")),
        sa.PrimaryKeyConstraint("result_id", "name", name=op.f("pk_result_quantities")),
    )
    for rows in _known():
        if rows:
            op.bulk_insert(table, rows)


def downgrade() -> None:
    op.drop_table("result_quantities")


def _known() -> Iterator[list[dict[str, object]]]:
    """The numbers of the results that are there already."""
    results = sa.table("results", sa.column("id", sa.String()), sa.column("document", sa.JSON()))
    query, last = sa.select(results).order_by(results.c.id).limit(AT_ONCE), ""
    while found := op.get_bind().execute(query.where(results.c.id > last)).all():
        last = found[-1].id
        yield [
            {
                "result_id": result.id,
                "name": quantity.name,
                "value": quantity.value,
                "unit": quantity.unit,
                "standard_uncertainty": quantity.standard_uncertainty,
            }
            for result in found
            for quantity in _quantities(result.document).values()
        ]


def _quantities(document: Mapping[str, Any]) -> dict[str, _Quantity]:
    """Every check and every named estimate (an entry with name, unit and estimate) of a document, by name."""
    found = {
        check["name"]: _Quantity(
            check["name"], check["value"], check["limit"]["unit"], check.get("standard_uncertainty")
        )
        for check in document.get("checks", [])
    }
    for entry in _entries(document):
        found.setdefault(
            entry["name"],
            _Quantity(entry["name"], entry["estimate"], entry["unit"], entry.get("standard_uncertainty")),
        )
    return found


def _entries(node: Any) -> Iterator[Mapping[str, Any]]:
    """Named estimates; lists of plain numbers are long, and are not looked through."""
    if isinstance(node, Mapping):
        if {"name", "unit", "estimate"} <= node.keys() and isinstance(node["estimate"], int | float):
            yield node
        for child in node.values():
            yield from _entries(child)
    elif isinstance(node, list) and node and isinstance(node[0], Mapping | list):
        for child in node:
            yield from _entries(child)
