"""Tables of a correction set for people; where the set is stored is not known here."""

import numpy as np

from procedures.core.converter import ConverterTriad, Normalised
from procedures.core.report import Cell, Table
from procedures.core.temperature.gyros import GyroThermalCorrection
from procedures.core.temperature.thermometers import ThermometerCorrection
from procedures.core.thermal_correction import COEFFICIENTS, ThermalCorrection
from procedures.core.unit_correction import UnitCorrection
from procedures.core.units import DEG_PER_HOUR


def correction_table(correction: UnitCorrection) -> Table:
    """Return the table of the coefficients of the three axes or channels, each with its standard uncertainty where it
    is known.
    """
    if correction.thermal is not None:
        return _thermal(correction.thermal)
    if correction.thermometers is not None:
        return _thermometers(correction.thermometers)
    if correction.gyros is not None:
        return _gyros(correction.gyros)
    return _converter(correction.converter or ())


def _thermal(value: ThermalCorrection) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for name, axis in zip("xyz", value.axes, strict=True):
        references = (axis.case_reference_c, axis.converter_reference_c)
        rows.append((name, axis.form.value, axis.scale, axis.bias_m_s2, *axis.alpha, *axis.beta, *references))
        if axis.covariance:
            rows.append((None, "±", None, None, *axis.standard_uncertainties().tolist(), None, None))
    stage = "after the converter's own models" if value.first_stage else "of outputs as they are"
    columns = ("axis", "form", "K0", "B0, m/s^2", *COEFFICIENTS, "case reference, °C", "converter reference, °C")
    fitted = "not known" if value.fitted_range is None else str(value.fitted_range)
    note = f"Fitted at: {fitted}. Beyond that it is extrapolated."
    return Table(f"Correction of the {value.triad} triad, {stage}", columns, tuple(rows), note)


def _thermometers(value: ThermometerCorrection) -> Table:
    sd = np.sqrt(np.diag(np.array(value.covariance))).tolist()
    rows: list[tuple[Cell, ...]] = [
        (s.channel, s.offset_c, sd[2 * i], s.slope, sd[2 * i + 1]) for i, s in enumerate(value.sensors)
    ]
    low, high = value.fitted_range_c
    note = f"About {value.reference_c:g} °C; compared with the chamber at {low:.1f} … {high:.1f} °C."
    return Table("Thermometers", ("sensor", "offset, °C", "±", "slope, °C/°C", "±"), tuple(rows), note)


def _gyros(value: GyroThermalCorrection) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for name, gyro in zip("xyz", value.gyros, strict=True):
        for k, c in enumerate(gyro.coefficients):
            rows.append((name, k + 1, c / DEG_PER_HOUR, gyro.covariance[k][k] ** 0.5 / DEG_PER_HOUR))
    low, high = value.fitted_range_c
    note = f"About {value.reference_c:g} °C of each gyro's own sensor; fitted at {low:.1f} … {high:.1f} °C."
    return Table("Gyros over temperature", ("gyro", "power", "deg/h/°C^k", "±"), tuple(rows), note)


def _converter(models: ConverterTriad | tuple[()]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for name, model in zip("xyz", models, strict=False):
        for title, part in (("scale, codes/mA", model.scale), ("zero, codes", model.zero)):
            rows += [(name, title, *_coefficients(part)), (None, "±", *_uncertainties(part))]
    widest = max((len(row) for row in rows), default=2)
    powers = tuple(f"a_{k}" for k in range(1, widest - 3))
    padded = tuple((*row, *[None] * (widest - len(row))) for row in rows)
    return Table(
        "Models of the signal converter", ("channel", "of", "reference, °C", "at the reference", *powers), padded
    )


def _coefficients(part: Normalised) -> tuple[Cell, ...]:
    return (part.reference_c, part.at_reference, *part.coefficients)


def _uncertainties(part: Normalised) -> tuple[Cell, ...]:
    return (None, *(max(row[i], 0.0) ** 0.5 for i, row in enumerate(part.covariance)))
