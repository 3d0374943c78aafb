"""every number of a result under its name, beside its document

Revision: 0005, after 0004
"""

from collections.abc import Iterator

import sqlalchemy as sa
from alembic import op

from bench_service.jobs.campaigns.quantities import quantities

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

ID = sa.String().with_variant(sa.String(collation="C"), "postgresql")
AT_ONCE = 20
"""Documents in memory."""


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
            for quantity in quantities(result.document).values()
        ]
