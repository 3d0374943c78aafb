"""Tables for a terminal: coefficients next to the true values, checks next to their limits."""

import json
from typing import Any

from rich.table import Table
from rich.text import Text

from bench_service.cli.printing.moments import moment
from procedures.core.imu_model import COEFFICIENT_NAMES
from procedures.core.units import DISPLAY

CURRENT = ("gyro_calibration", "accelerometer_calibration", "thermal_correction", "converter", "thermometers")
"""Fields of a unit that name its current calibrations and corrections."""


def coefficient_table(triads: list[dict[str, Any]], truths: list[dict[str, Any]] | None) -> tuple[Table, float]:
    """Return the table of estimate ± standard uncertainty σ, truth, error in sigmas; and the largest error in sigmas (0
    without truth).
    """
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


def calibration_table(calibrations: list[dict[str, Any]]) -> Table:
    """Return the table of calibrations: their origin, which one is current and by whose choice, and how long."""
    table = Table()
    for column in ("calibration", "triad", "made", "method", "verdict", "current", "approval", "valid until"):
        table.add_column(column, overflow="fold", no_wrap=column == "calibration")
    for one in calibrations:
        chosen = ("by rule" if one["by_rule"] else "chosen") if one["current"] else ""
        origin = f"{one['method']}: {one['origin']}" if one["origin"] else one["method"]
        current = Text(f"{chosen}, not usable" if chosen and one["unusable"] else chosen)
        until = one["valid_until"] or "–"
        cells = (one["made_at"][:19], origin, one["verdict"] or "–", current, one["approval"], until[:19])
        table.add_row(one["id"], one["triad"], *cells)
    return table


def correction_table(corrections: list[dict[str, Any]]) -> Table:
    """Return the table of corrections: the result that gave each, which one of its kind is current, and how long."""
    table = Table()
    for column in ("correction", "kind", "made", "result", "verdict", "current", "approval", "valid until"):
        table.add_column(column, overflow="fold")
    for one in corrections:
        chosen = ("by rule" if one["by_rule"] else "chosen") if one["current"] else ""
        current = f"{chosen}, not usable" if chosen and one["unusable"] else chosen
        until = one["valid_until"] or "–"
        cells = (one["made_at"][:19], one["result"], one["verdict"], current, one["approval"], until[:19])
        table.add_row(one["id"], one["kind"], *cells)
    return table


def job_table(jobs: list[dict[str, Any]]) -> Table:
    """Return the table of jobs, in the order given."""
    table = Table()
    for column in ("", "job", "procedure", "unit", "state", "verdict", "stations", "submitted"):
        table.add_column(column, no_wrap=column == "job")
    for job in jobs:
        done = job["progress"]
        table.add_row(
            f"#{job['number']}",
            job["id"],
            job["procedure"],
            job["unit"],
            job["state"],
            job["verdict"] or "–",
            f"{done['station']}/{done['stations']}",
            job["created_at"][:16].replace("T", " "),
        )
    return table


def _entry(triad: dict[str, Any], channel: int, column: int) -> float:
    return triad["bias"][channel] if column == 0 else triad["matrix"][channel][column - 1]


def recording_table(recordings: list[dict[str, Any]]) -> Table:
    """Return the table of recordings, in the order given."""
    table = _table("recording", "unit", "station or files", "channels", "rate, Hz", "length, s", "made")
    for one in recordings:
        files = ", ".join(str(file.get("name")) for file in one["source"].get("files", []))
        where = one["station"]["label"] if one["station"] else files or "–"
        numbers = str(len(one["channels"])), f"{one['rate_hz']:g}", f"{one['duration_s']:g}"
        table.add_row(one["id"], Text(one["unit"]), Text(where), *numbers, moment(one["created_at"]))
    return table


def recording_line(recording: dict[str, Any]) -> str:
    """A recording in one line: its id first."""
    return (
        f"recording {recording['id']} of unit {recording['unit']}: {recording['count']} samples of "
        f"{len(recording['channels'])} channels, {recording['rate_hz']:.9g} Hz, {recording['duration_s']:.9g} s"
    )


def result_table(results: list[dict[str, Any]]) -> Table:
    """Return the table of results, in the order given."""
    table = _table("result", "procedure or method", "unit", "verdict", "job", "made")
    table.columns[4].no_wrap = True
    for one in results:
        job = one["lineage"]["job"] or "–"
        table.add_row(
            one["id"], Text(one["name"]), Text(one["unit"] or "–"), one["verdict"], job, moment(one["created_at"])
        )
    return table


def batch_table(batches: list[dict[str, Any]]) -> Table:
    """Return the table of batches of analyses, in the order given."""
    table = _table("batch", "method", "state", "analyses", "done", "reused", "failed", "submitted")
    for one in batches:
        numbers = (str(one["counts"][state]) for state in ("done", "reused", "failed"))
        made = moment(one["created_at"])
        table.add_row(one["id"], Text(one["method"]), one["state"], str(one["total"]), *numbers, made)
    return table


def unit_table(units: list[dict[str, Any]]) -> Table:
    """Return the table of units with the current calibration and corrections of each."""
    table = _table("unit", "rate, Hz", "channels", *(name.replace("_", " ") for name in CURRENT))
    for one in units:
        current = [one.get(name) or "–" for name in CURRENT]
        table.add_row(Text(one["serial"]), f"{one['sample_rate_hz']:g}", str(len(one["channels"])), *current)
    return table


def reservation_table(reservations: list[dict[str, Any]]) -> Table:
    """Return the table of reservations, in the order given."""
    table = _table("reservation", "of", "holder", "until", "holds now", "note")
    for one in reservations:
        of = f"bench {one['bench']}" if one["bench"] else f"unit {one['unit']}"
        now = "yes" if one["active"] else "no"
        table.add_row(one["id"], Text(of), Text(one["holder"]), moment(one["until"]), now, Text(one["note"]))
    return table


def mounting_table(mountings: list[dict[str, Any]]) -> Table:
    """Return the table of mountings, in the order given."""
    table = _table("mounting", "unit", "bench", "plate", "azimuth, deg", "± arcsec", "by", "mounted", "until")
    for one in mountings:
        until = "it stands" if one["ended_at"] is None else moment(one["ended_at"])
        where = Text(one["unit"]), Text(one["bench"]), Text(one["plate"])
        azimuth = f"{one['azimuth_deg']:.5f}", f"{one['azimuth_sd_arcsec']:g}"
        table.add_row(one["id"], *where, *azimuth, Text(one["by"]), moment(one["mounted_at"]), until)
    return table


def queue_table(entries: list[dict[str, Any]]) -> Table:
    """Return the table of the jobs that wait for a bench, in the order in which they start."""
    table = _table("place", "", "job", "unit", "priority", "queued", "waiting")
    for one in entries:
        numbers = str(one["position"]), f"#{one['number']}", one["job"], Text(one["unit"]), str(one["priority"])
        table.add_row(*numbers, moment(one["queued_at"]), Text(one["waiting"]))
    return table


def procedure_table(entries: list[dict[str, Any]]) -> Table:
    """Return the table of procedures or methods with the names of their parameters."""
    table = _table("name", "version", "title", "parameters")
    for one in entries:
        table.add_row(
            one["name"], one["version"], one["title"], Text(", ".join(one["parameters"].get("properties", {})))
        )
    return table


def parameter_table(entry: dict[str, Any]) -> Table:
    """Return the table of the parameters of a procedure or method: default and description of each."""
    table = _table("parameter", "default", "description", title=entry["title"])
    for name, schema in entry["parameters"].get("properties", {}).items():
        default = Text("needed") if "default" not in schema else Text(json.dumps(schema["default"], ensure_ascii=False))
        table.add_row(name, default, Text(schema.get("description", "")))
    return table


def uncertainty_table(predicted: list[dict[str, Any]]) -> Table:
    """Return the table of the uncertainties that a plan is expected to have, and of their origins."""
    table = _table("quantity", "unit", "expected σ", "from noise", "from the table", title="Expected uncertainties")
    for one in predicted:
        figures = (one["standard_uncertainty"], one["from_noise"], one["from_table"])
        table.add_row(Text(one["name"]), one["unit"], *(f"{figure:.3g}" for figure in figures))
    return table


def outcome_table(plans: list[dict[str, Any]], outcomes: list[dict[str, Any]]) -> Table:
    """Return the table of the previews of a batch: duration and warnings of each plan, or why it cannot be run."""
    table = _table("plan", "procedure", "unit", "duration, h", "outcome")
    for number, (plan, outcome) in enumerate(zip(plans, outcomes, strict=True), start=1):
        made, refusal = outcome["preview"], outcome["refusal"]
        if made is None:
            table.add_row(str(number), Text(plan["procedure"]), Text(plan["unit"]), "–", Text(refusal["detail"], "red"))
            continue
        said = [*made["violations"], *made["warnings"]]
        text = Text("; ".join(said), "yellow") if said else Text("good")
        table.add_row(str(number), made["procedure"], Text(made["unit"]), f"{made['duration_s'] / 3600:.2f}", text)
    return table


def _table(*columns: str, title: str | None = None) -> Table:
    table = Table(title=title)
    for number, column in enumerate(columns):
        table.add_column(column, no_wrap=number == 0)
    return table


def live_table(bench: str, live: dict[str, Any]) -> Table:
    """Return the table of a bench's live readings; one row a reading."""
    table = Table(title=f"bench {bench}, {moment(live['at'])}")
    table.add_column("reading")
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("unit")
    devices, manual = live["devices"], live["manual"]
    rates = devices["rates_deg_s"] or (None, None, None)
    for axis, rate in zip(("outer", "middle", "inner"), rates, strict=True):
        table.add_row(f"{axis} angle", f"{devices[f'{axis}_deg']:.4f}", "deg")
        if rate is not None:
            table.add_row(f"{axis} rate", f"{rate:.4f}", "deg/s")
    table.add_row("table", "moves" if devices["moving"] else "rests", "")
    chamber = devices["chamber"]
    if chamber is not None:
        table.add_row("air", f"{chamber['air_c']:.2f}", "°C")
        target = "off" if chamber["target_c"] is None else f"{chamber['target_c']:.2f}"
        table.add_row("set point", target, "°C")
    table.add_row("supply", "on" if devices["unit_on"] else "off", "")
    for name, unit in (("voltage_v", "V"), ("current_a", "A")):
        if devices[name] is not None:
            table.add_row(f"supply {name.partition('_')[0]}", f"{devices[name]:.3f}", unit)
    for sensor in [] if manual is None else manual["sensors"]:
        table.add_row(sensor["name"], f"{sensor['value']:.6g}", sensor["unit"])
    for word in devices["status"]:
        table.add_row(f"{word['device']} {word['name']}", word["raw"], ", ".join(word["bits"]))
    return table
