"""Tables of the size of the database: where raw data are, and how large it will be."""

from typing import Any

from rich.table import Table


def share_table(raw: dict[str, Any]) -> Table:
    """Return the table of recordings and bytes by the place of their raw data."""
    table = Table("raw data", "recordings", "GB")
    for place, share in raw.items():
        table.add_row(place, str(share["recordings"]), f"{share['stored_bytes'] / 1e9:.3f}")
    return table


def prediction_table(predicted: list[dict[str, Any]], growth: dict[str, Any]) -> Table:
    """Return the table of the predicted sizes of the database [GB], without and with the rules."""
    per_day = growth["stored_bytes"] / growth["days"] / 1e6
    table = Table("in days", "GB without rules", "GB with the rules", title=f"growth {per_day:.1f} MB a day")
    for one in predicted:
        without, with_rules = one["without_rules_bytes"] / 1e9, one["with_rules_bytes"] / 1e9
        table.add_row(str(one["days"]), f"{without:.2f}", f"{with_rules:.2f}")
    return table
