"""The columns of a proposed description as a table."""

from collections.abc import Sequence
from typing import Any

from rich.table import Table


def proposal_table(columns: Sequence[Any]) -> Table:
    """Return the table of the channels that an import proposes."""
    table = Table(title="proposed channels")
    for name in ("channel", "column", "quantity", "unit", "scale", "mean", "deviation", "from"):
        table.add_column(name, justify="right" if name in ("scale", "mean", "deviation") else "left", overflow="fold")
    for column in columns:
        table.add_row(
            column["channel"],
            str(column["column"]),
            column["quantity"],
            column["unit"],
            f"{column['scale']:.9g}",
            _number(column["mean"]),
            _number(column["deviation"]),
            column["source"],
        )
    return table


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.5g}"
