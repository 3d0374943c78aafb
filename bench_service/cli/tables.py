"""Tables for a terminal: coefficients next to the true values, checks next to their limits."""

from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from procedures.core.imu_model import COEFFICIENT_NAMES
from procedures.core.units import DISPLAY


def coefficient_table(triads: list[dict[str, Any]], truths: list[dict[str, Any]] | None) -> tuple[Table, float]:
    """Estimate ± standard uncertainty σ, truth, error in sigmas; and the largest error in sigmas (0 without truth)."""
    table = Table(title="Coefficients, U = b + K·v")
    for column in ("coefficient", "unit", "estimate", "± σ", "truth", "error / σ"):
        table.add_column(column, justify="left" if column in ("coefficient", "unit") else "right", no_wrap=True)
    true_by_triad = {t["triad"]: t for t in truths or []}
    worst = 0.0
    for triad in triads:
        name, size = DISPLAY[triad["output_unit"]]
        true = true_by_triad.get(triad["triad"])
        for index, coefficient in enumerate(COEFFICIENT_NAMES):
            channel, column = divmod(index, 4)
            scale, unit = (size, name) if column == 0 else (1.0, "1")
            estimate = _entry(triad, channel, column)
            sd = triad["covariance"][index][index] ** 0.5
            cells = [f"{triad['triad']} {coefficient}", unit, f"{estimate / scale:.7f}", f"{sd / scale:.2g}", "–", "–"]
            if true is not None:
                error = (estimate - _entry(true, channel, column)) / sd
                worst = max(worst, abs(error))
                cells[4:] = [f"{_entry(true, channel, column) / scale:.7f}", f"{error:+.2f}"]
            table.add_row(*cells, end_section=index == len(COEFFICIENT_NAMES) - 1)
    return table, worst


def check_table(document: dict[str, Any]) -> Table:
    """Table of checks, each value next to its limit."""
    table = Table(title="Checks")
    for column in ("check", "value", "limit", "unit", "outcome"):
        table.add_column(column, justify="left" if column in ("check", "unit", "outcome") else "right")
    for check in document.get("checks", []):
        limit = check["limit"]
        bounds = [f"≥ {limit['minimum']:.4g}"] if limit["minimum"] is not None else []
        bounds += [f"≤ {limit['maximum']:.4g}"] if limit["maximum"] is not None else []
        outcome = Text("pass", style="green") if check["passed"] else Text("fail", style="red")
        table.add_row(check["name"], f"{check['value']:.4g}", ", ".join(bounds), limit["unit"], outcome)
    return table


def show_warnings(document: dict[str, Any], to: Console) -> None:
    """Print the warnings of a result, which a person should read before trusting it."""
    for warning in document.get("warnings", []):
        to.print(Text(f"warning: {warning}", style="yellow"), soft_wrap=True)


def calibration_table(calibrations: list[dict[str, Any]]) -> Table:
    """Table of calibrations: their origin, which one counts and by whose choice, and how long."""
    table = Table()
    for column in ("calibration", "triad", "made", "method", "verdict", "current", "approval", "valid until"):
        table.add_column(column, overflow="fold")
    for one in calibrations:
        chosen = ("by rule" if one["by_rule"] else "chosen") if one["current"] else ""
        origin = f"{one['method']}: {one['origin']}" if one["origin"] else one["method"]
        current = Text(f"{chosen}, not usable" if chosen and one["unusable"] else chosen)
        until = one["valid_until"] or "–"
        cells = (one["made_at"][:19], origin, one["verdict"] or "–", current, one["approval"], until[:19])
        table.add_row(one["id"], one["triad"], *cells)
    return table


def job_table(jobs: list[dict[str, Any]]) -> Table:
    """Table of jobs, newest first."""
    table = Table()
    for column in ("job", "procedure", "unit", "state", "verdict", "stations", "submitted"):
        table.add_column(column, no_wrap=column == "job")
    for job in jobs:
        done = job["progress"]
        table.add_row(
            job["id"],
            job["procedure"],
            job["unit"],
            job["state"],
            job["verdict"] or "–",
            f"{done['station']}/{done['stations']}",
            job["created_at"][:19].replace("T", " "),
        )
    return table


def _entry(triad: dict[str, Any], channel: int, column: int) -> float:
    return triad["bias"][channel] if column == 0 else triad["matrix"][channel][column - 1]
