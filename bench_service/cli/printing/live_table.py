"""Table of the live readings of a bench for a terminal, as manual mode prints it."""

from typing import Any

from rich.table import Table

from bench_service.cli.printing.moments import moment


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
