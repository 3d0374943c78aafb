"""Tables and figure of a calibration of thermometers."""

from collections.abc import Sequence

import numpy as np

from procedures.analysis.thermal.thermometers import Calibrated
from procedures.core.report import Cell, Figure, Report, Series, Table


def thermometer_report(found: Calibrated, target_c: Sequence[float], air_c: Sequence[float]) -> Report:
    """Return the report: offsets and slopes, errors at the soaks, up against down, and the lines with the data."""
    rows: list[tuple[Cell, ...]] = [
        (s.channel, s.offset_c, s.offset_sd_c, s.slope, s.slope_sd, s.p_value) for s in found.sensors
    ]
    columns = ("sensor", "offset, °C", "±", "slope, °C/°C", "±", "p-value of the line")
    note = (
        f"Reading less temperature = offset + slope·(reading − {found.correction.reference_c:g} °C). The offsets share "
        "the uncertainty of the air at the unit's place; the slopes do not."
    )
    lines = Table("Thermometers", columns, tuple(rows), note)
    soaks: list[tuple[Cell, ...]] = []
    for k, (target, air, rest) in enumerate(zip(target_c, air_c, found.unsoaked_c, strict=True)):
        soaks.append((target, air, *(s.error_c[k] for s in found.sensors), rest))
    heads = ("target, °C", "chamber's air, °C", *(s.channel for s in found.sensors), "not followed, °C")
    errors = Table("Reading at switching on less the chamber's air, °C", heads, tuple(soaks))
    paths = Table(
        "Up against down",
        ("sensor", "at, °C", "up less down, °C", "±", "p-value"),
        tuple((h.channel, h.target_c, h.difference_c, h.standard_uncertainty_c, h.p_value) for h in found.hysteresis),
    )
    return Report(sections=(lines, errors, *((paths,) if found.hysteresis else ()), _figure(found, air_c)))


def _figure(found: Calibrated, air_c: Sequence[float]) -> Figure:
    series: list[Series] = []
    reference = found.correction.reference_c
    for s in found.sensors:
        at = np.array(air_c) + np.array(s.error_c)
        fine = np.linspace(at.min(), at.max(), 2)
        line = s.offset_c + s.slope * (fine - reference)
        series.append(Series(s.channel, tuple(at.tolist()), s.error_c, s.error_sd_c))
        series.append(Series(f"{s.channel}, fitted", tuple(fine.tolist()), tuple(line.tolist()), style="line"))
    return Figure("Errors of the thermometers", "reading, °C", "reading less chamber's air, °C", tuple(series))
