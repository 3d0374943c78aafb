"""Campaigns, runs and schedules as tables for a terminal."""

from typing import Any

from rich.table import Table
from rich.text import Text

from bench_service.cli.printing.check_tables import is_inconclusive

COLOURS = {"pass": "green", "fail": "red", "error": "yellow"}


def run_table(run: dict[str, Any]) -> Table:
    """Return the table of a run, step by step: outcome, failed checks and warnings."""
    table = _table(
        "step", "does", "state", "verdict", "checks", "what to know", title=f"{run['campaign']} {run['unit']}"
    )
    for step in run["steps"]:
        bad = [c["name"] for c in step["checks"] if not c["passed"]]
        failed = [c["name"] for c in step["checks"] if not (c["passed"] or is_inconclusive(c))]
        missed = f"missed: {', '.join(failed)}" if failed else ""
        told = "\n".join(filter(None, [step["reason"], missed, *step["warnings"]]))
        passed = f"{len(step['checks']) - len(bad)}/{len(step['checks'])}"
        table.add_row(step["name"], step["does"], step["state"], _verdict(step["verdict"]), passed, told)
    return table


def campaign_table(items: list[dict[str, Any]]) -> Table:
    """Return the table of campaigns with the names of their steps."""
    table = _table("campaign", "title", "steps", "")
    for item in items:
        steps = ", ".join(step["name"] for step in item["campaign"]["steps"])
        table.add_row(item["name"], item["campaign"]["title"], steps, "shipped" if item["shipped"] else "")
    return table


def runs_table(items: list[dict[str, Any]]) -> Table:
    """Return the table of campaign runs, in the order given."""
    table = _table("run", "campaign", "unit", "state", "verdict", "asked for", "what to know")
    for run in items:
        told = run["waiting"] or run["reason"]
        row = (run["id"], run["campaign"], run["unit"], run["state"], _verdict(run["verdict"]))
        table.add_row(*row, run["created_at"][:19].replace("T", " "), told)
    return table


def schedule_table(items: list[dict[str, Any]]) -> Table:
    """Return the table of schedules with their next and last starts."""
    table = _table("schedule", "campaign", "unit", "cron", "zone", "next, UTC", "last outcome")
    for one in items:
        next_at = (one["next_at"] or "off")[:16].replace("T", " ")
        times = ("once", "") if one.get("at") else (one["cron"], one["time_zone"])
        row = (one["id"], one["campaign"], one["unit"], *times, next_at)
        table.add_row(*row, one["last_outcome"])
    return table


def _table(*columns: str, title: str | None = None) -> Table:
    table = Table(title=title)
    for index, column in enumerate(columns):
        table.add_column(column, no_wrap=index == 0)
    return table


def _verdict(verdict: str | None) -> Text:
    return Text("–" if verdict is None else verdict, style=COLOURS.get(verdict or "", ""))
