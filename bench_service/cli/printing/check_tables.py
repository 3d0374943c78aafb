"""Tables of a result's checks and uncertainty budgets for a terminal, and its warnings."""

from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text


def is_inconclusive(check: dict[str, Any]) -> bool:
    """Return whether a check decided nothing: what was not observed stays below a value outside the limit."""
    return check.get("bound", False) and not check["passed"]


def check_table(document: dict[str, Any]) -> Table:
    """Return the table of a result's checks, each value next to its limit with its source; the notes stand below."""
    table = Table(title="Checks")
    words = ("check", "unit", "source of the limit", "outcome")
    for column in ("check", "value", "U", "limit", "unit", "source of the limit", "outcome"):
        table.add_column(column, justify="left" if column in words else "right")
    for check in document.get("checks", []):
        limit = check["limit"]
        bounds = [f"≥ {limit['minimum']:.4g}"] if limit["minimum"] is not None else []
        bounds += [f"≤ {limit['maximum']:.4g}"] if limit["maximum"] is not None else []
        made = check.get("decision") or {}
        decided = made.get("outcome") or ("pass" if check["passed"] else "fail")
        outcome = Text(decided, style="green" if check["passed"] else "yellow" if is_inconclusive(check) else "red")
        expanded = "" if made.get("expanded_uncertainty") is None else f"{made['expanded_uncertainty']:.2g}"
        source = Text(limit.get("source", ""))
        value = "unbounded" if check["value"] is None else f"{'< ' if check.get('bound') else ''}{check['value']:.4g}"
        table.add_row(check["name"], value, expanded, ", ".join(bounds), limit["unit"], source, outcome)
    said: list[str] = []
    if (statement := document.get("statement")) is not None:
        said = [f"{statement['outcome']}; decision rule: {statement['rule']}; U: expanded uncertainty"]
    notes = [f"{check['name']}: {check['note']}" for check in document.get("checks", []) if check.get("note")]
    table.caption = Text("\n".join([*said, *notes]))
    return table


def budget_table(document: dict[str, Any], coefficient: str) -> Table:
    """Return the uncertainty budget of one coefficient, named as in the result ("gyro.K11"). Raises `KeyError` with the
    names.
    """
    parts = [*document.get("triads", []), document.get("gyro") or {}, document.get("accelerometer") or {}]
    found = {b["coefficient"]: b for part in parts for b in part.get("budgets", [])}
    if coefficient not in found:
        raise KeyError(", ".join(found) or "none: the result has no budget")
    budget = found[coefficient]
    table = Table(title=f"Uncertainty budget of {coefficient}, {budget['unit']}")
    for column in ("source", "value", "unit", "distribution", "divisor", "sensitivity", "contribution", "ν"):
        table.add_column(column, justify="left" if column in ("source", "unit", "distribution") else "right")
    for row in budget["rows"]:
        figures = (f"{row[name]:.3g}" for name in ("divisor", "sensitivity", "contribution"))
        freedom = "∞" if row["degrees_of_freedom"] is None else f"{row['degrees_of_freedom']:.3g}"
        table.add_row(row["source"], f"{row['value']:.3g}", row["unit"], row["distribution"], *figures, freedom)
    freedom = "∞" if budget["degrees_of_freedom"] is None else f"{budget['degrees_of_freedom']:.3g}"
    total = f"{budget['standard_uncertainty']:.3g}"
    table.add_row("root sum of squares", "", "", "", "", "", total, freedom, style="bold")
    table.caption = f"U = {budget['expanded_uncertainty']:.3g} {budget['unit']}, k = {budget['coverage_factor']:.3g}"
    return table


def show_warnings(document: dict[str, Any], to: Console) -> None:
    """Print the warnings of a result, which a person should read before trusting it."""
    for warning in document.get("warnings", []):
        to.print(Text(f"warning: {warning}", style="yellow"), soft_wrap=True)
