"""Tables of a thermal cycle beyond the thesis's: the converter's delay, hysteresis, gyros that were corrected."""

from procedures.analysis.thermal.cycle.results import ThermalCycle
from procedures.core import units
from procedures.core.recording import AXES
from procedures.core.report import Table


def sections(cycle: ThermalCycle) -> tuple[Table, ...]:
    """Return the tables of delay, hysteresis, gyros and coefficients that a cycle has."""
    made = (_delay(cycle), _hysteresis(cycle), _gyros(cycle), _coefficients(cycle))
    return tuple(table for table in made if table is not None)


def _delay(cycle: ThermalCycle) -> Table | None:
    found = cycle.following
    if found is None:
        return None
    rows = (
        ("delay Δt of reading behind reading", "s", found.total_delay_s, found.total_delay_sd_s),
        ("delay of the board behind the case", "s", found.delay_s, found.delay_sd_s),
        ("time constant of the converter's sensor", "s", found.sensor_lag_s, found.sensor_lag_sd_s),
        ("time constant that the fit was given", "s", cycle.converter_lag_s, None),
        *((f"board over case, {r.name}", "°C", h, None) for r, h in zip(cycle.runs, found.heating_c, strict=False)),
        ("spread of 30 s means about that law", "°C", found.residual_sd_c, None),
        ("p-value of what drifts about it", "1", found.p_value, None),
    )
    note = (
        "Found from the two sensors' readings alone (thesis figs 3.15, 3.16), beside the case sensor's time constant."
    )
    return Table("The converter's sensor behind the case's", ("what", "unit", "value", "±"), rows, note)


def _hysteresis(cycle: ThermalCycle) -> Table | None:
    if not cycle.hysteresis:
        return None
    rows = tuple(
        (h.target_c, h.run, h.axis, h.difference_m_s2, h.standard_uncertainty_m_s2, h.p_value) for h in cycle.hysteresis
    )
    columns = ("chamber, °C", "run", "axis", "up less down, m/s²", "±", "p-value")
    note = "Corrected outputs in soaks reached from below less those reached from above; ±: the channel's noise."
    return Table("Hysteresis", columns, rows, note)


def _gyros(cycle: ThermalCycle) -> Table | None:
    if not cycle.gyros_corrected:
        return None
    rows = tuple((g.axis, g.order, g.p_before, g.p_after, g.reason) for g in cycle.gyros_corrected)
    columns = ("gyro", "order", "p-value before", "after, in unseen runs", "reason for the order")
    return Table("Gyros that depend on temperature, and their correction", columns, rows)


def _coefficients(cycle: ThermalCycle) -> Table | None:
    correction = cycle.gyro_correction
    if correction is None:
        return None
    rows = tuple(
        (axis, k + 1, c / units.DEG_PER_HOUR, gyro.covariance[k][k] ** 0.5 / units.DEG_PER_HOUR)
        for axis, gyro in zip(AXES, correction.gyros, strict=True)
        for k, c in enumerate(gyro.coefficients)
    )
    note = f"Of bias, about {correction.reference_c:g} °C; a scale factor's dependence does not show at rest."
    return Table("Temperature coefficients of the gyros", ("gyro", "power", "deg/h/°C^k", "±"), rows, note)
