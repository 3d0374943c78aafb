"""Tables of a thermal cycle: 4.3 to 4.7 of the thesis, laid out again, the ways to correct, the soaks' evidence."""

from procedures.analysis.thermal.cycle.results import AxisFound, GyroNoise, LegRegime, ThermalCycle
from procedures.analysis.thermal.profile_progress import LegEvidence
from procedures.core import units
from procedures.core.recording import AXES
from procedures.core.report import Cell, Table
from procedures.core.thermal_correction import COEFFICIENTS, Form
from procedures.reports import thermal_sensors as more

OF_COEFFICIENT = ("1/°C²", "1/°C", "1/°C²", "1/°C", "m/s²/°C", "m/s²/°C²", "m/s²/°C", "m/s²/°C²")
"""Units in the order of `COEFFICIENTS`; thesis 4.1 does not print β in the order of α."""


def summary(cycle: ThermalCycle) -> str:
    """Return the summary of the cycle in two sentences."""
    hours = sum(run.duration_s for run in cycle.runs) / units.HOUR
    judged = "the correction that was fitted to them" if cycle.judged == "fit" else "the unit's current correction"
    seen = "" if cycle.judged == "fit" else ", which they had no part in"
    return f"{len(cycle.runs)} runs, {hours:.3g} h in all. 3σ, |ĝ| and Allan deviations are those of {judged}{seen}."


def tables(cycle: ThermalCycle) -> tuple[Table, ...]:
    """Return all tables of a cycle, in reading order."""
    return (
        soak_table(cycle),
        forms_table(cycle),
        coefficient_table(cycle),
        order_table(cycle),
        accelerometer_correlations(cycle),
        *more.sections(cycle),
        gyro_correlations(cycle),
        gyro_noise_table(cycle),
        magnitude_table(cycle),
        evidence_table(cycle),
        regime_table(cycle),
    )


def soak_table(cycle: ThermalCycle) -> Table:
    """Return the table of soak errors as in Table 4.5."""
    rows = tuple(
        (s.leg + 1, s.target_c, s.case_c, s.runs, axis, s.before_m_s2[i], s.after_m_s2[i], s.spread_after_m_s2[i])
        for s in cycle.soaks
        for i, axis in enumerate(AXES)
    )
    columns = ("leg", "chamber, °C", "case, °C", "runs", "axis", "before", "after", "spread after")
    note = (
        "3σ in m/s²: three times the rms departure from what the same run showed in its reference soak, root mean "
        "square over the runs; spread: about the soak's own mean. Thesis table 4.5 prints 0.07 to 0.18 before and "
        "0.00012 to 0.00046 after, at −20 and +60 °C."
    )
    return Table("3σ before and after correction at each soak", columns, rows, note)


def forms_table(cycle: ThermalCycle) -> Table:
    """Return the table of the forms of the correction, side by side."""
    single = next((f for f in cycle.forms if f.form == Form.SINGLE.value), None)
    rows: list[tuple[Cell, ...]] = []
    for f in cycle.forms:
        gain = None if single is None else single.magnitude_dynamic_m_s2 / f.magnitude_dynamic_m_s2
        rows.append((f.form, *f.worst_3_sigma_m_s2, f.magnitude_static_m_s2, f.magnitude_dynamic_m_s2, gain))
    columns = ("form", "3σ x", "3σ y", "3σ z", "|ĝ| static", "|ĝ| dynamic", "single over this")
    note = (
        "m/s². 3σ of the worst soak; |ĝ| root mean square about each run's mean, in either regime; last: how many "
        "times as large |ĝ| of the single polynomial (thesis 3.15) is on ramps. All but a current correction were "
        "fitted to this very cycle. Both: thesis 4.1; switched: thesis 3.19."
    )
    return Table("Ways to correct", columns, tuple(rows), note)


def coefficient_table(cycle: ThermalCycle) -> Table:
    """Return the table of K0, B0, α and β of the fit (Table 4.4)."""
    rows: list[tuple[Cell, ...]] = []
    for axis, found in zip(AXES, cycle.axes, strict=True):
        c = found.correction
        rows += [(axis, "K0", "1", c.scale, None), (axis, "B0", "m/s²", c.bias_m_s2, None)]
        values = (*c.alpha, *c.beta)
        for name, unit, value, sd in zip(COEFFICIENTS, OF_COEFFICIENT, values, found.uncertainties, strict=True):
            used = sd > 0.0 or value != 0.0
            rows.append((axis, name.replace("_", " "), unit, value if used else None, sd if used else None))
    columns = ("axis", "coefficient", "unit", "estimate", "± standard uncertainty")
    note = (
        f"thesis 4.1 about readings of {cycle.reference_c[0]:g} °C (case) and {cycle.reference_c[1]:g} °C (converter). "
        "α1, α2, β1, β2 go with the case sensor, the others with the converter's. Thesis table 4.4 has α3 and α4 the "
        "other way round than thesis 4.1."
    )
    return Table("Temperature coefficients of the accelerometers", columns, tuple(rows), note)


def order_table(cycle: ThermalCycle) -> Table:
    """Return the table of the tests for the polynomial order."""
    rows = tuple((axis, *_order(found)) for axis, found in zip(AXES, cycle.axes, strict=True))
    orders = len(cycle.axes[0].bic)
    columns = (
        *("axis", *(f"BIC {k + 1}" for k in range(orders))),
        *(f"F test {k + 1} against {k}, p" for k in range(1, orders)),
        "preferred",
        *("effective samples", "residual static, m/s²", "dynamic, m/s²", "condition"),
    )
    reasons = ". ".join(f"{a}: {f.order_reason}" for a, f in zip(AXES, cycle.axes, strict=True) if f.order_reason)
    note = f"Least criterion is best; the counts are those of independent samples in correlated noise. {reasons}"
    return Table("Choice of the order, and what the fit leaves", columns, rows, note)


def _order(found: AxisFound) -> tuple[Cell, ...]:
    least = min(found.bic)
    relative = tuple(b - least for b in found.bic)
    return (
        *relative,
        *found.p_values,
        found.preferred_order,
        found.effective_samples,
        *found.residual_sd_m_s2,
        found.condition,
    )


def accelerometer_correlations(cycle: ThermalCycle) -> Table:
    """Return Table 4.3, correlations with temperature, and the same after correction."""
    rows = tuple(
        (
            c.before.axis,
            c.before.run,
            c.before.r,
            c.before.p_value,
            c.after.r,
            c.after.p_value,
            c.after.effective_samples,
        )
        for c in cycle.accelerometers
    )
    columns = ("axis", "run", "r before", "p before", "r after", "p after", "effective samples after")
    note = "With the case sensor; p: chance of as steep a slope from the channel's own noise. Thesis: |r| 0.80 to 0.94."
    return Table("Accelerometers against temperature", columns, rows, note)


def gyro_correlations(cycle: ThermalCycle) -> Table:
    """Return the table of gyro correlations with temperature, as in Table 4.6."""
    per_degree = units.DEG_PER_HOUR
    rows: list[tuple[Cell, ...]] = []
    for g in cycle.gyros:
        rows += [
            (g.axis, c.run, c.r, c.effective_samples, c.slope / per_degree, c.slope_sd / per_degree, c.p_value)
            for c in g.runs
        ]
        slope, sd = g.slope_rad_s_c / per_degree, g.slope_sd_rad_s_c / per_degree
        rows.append((g.axis, "together", None, None, slope, sd, g.p_value))
    columns = ("axis", "run", "r", "effective samples", "slope, deg/h/°C", "± standard uncertainty", "p-value")
    note = (
        "Each gyro with its own sensor. Together: slopes weighted, p-values joined by Fisher. Thesis: |r| below 0.0077."
    )
    return Table("Gyros against temperature", columns, tuple(rows), note)


def gyro_noise_table(cycle: ThermalCycle) -> Table:
    """Return the table of gyro noise as in Table 4.7, with the unit's known noise."""
    shown = units.NOISE_DISPLAY["rad/s"]
    rows: list[tuple[Cell, ...]] = []
    for i, process in enumerate(("quantization", "random_walk", "bias_instability")):
        unit, size = shown[process]
        for g in cycle.gyro_noise:
            known = None if g.known is None else g.known[i] / size
            rows.append((process.replace("_", " "), unit, g.axis, g.run, *_noise(g, i, size), known))
    columns = ("process", "unit", "axis", "run", "in the cycle", "± standard uncertainty", "known of the unit")
    note = "A dash: not observed; “<” is what it stays below (95 %)."
    return Table("Noise of the gyros in the cycle", columns, tuple(rows), note)


def _noise(g: GyroNoise, process: int, size: float) -> tuple[Cell, Cell]:
    value = (g.quantization, g.random_walk, g.bias_instability)[process]
    sd = g.uncertainties[process]
    if value is None:
        limit = g.upper_limits[process]
        return f"– ({'unbounded' if limit is None else f'< {limit / size:.2g}'})", None
    return value / size, None if sd is None else sd / size


def magnitude_table(cycle: ThermalCycle) -> Table:
    """Return the table of |ĝ| over each run, before and after correction."""
    rows = tuple(
        (run.name, before, after, *run.force_m_s2)
        for run, (before, after) in zip(cycle.runs, cycle.magnitude_m_s2, strict=True)
    )
    columns = ("run", "before, m/s²", "after, m/s²", "force x, m/s²", "force y, m/s²", "force z, m/s²")
    source = "the unit's calibration at the reference" if cycle.force_known else "an ideal, level seat"
    return Table(
        "|ĝ| over the cycle, rms about its mean", columns, rows, f"Forces: what {source} gives; the fit takes them."
    )


def evidence_table(cycle: ThermalCycle) -> Table:
    """Return the table of the times at which each leg was reached and soaked."""
    rows = tuple((run.name, i, *_evidence(leg)) for run in cycle.runs for i, leg in enumerate(run.legs, start=1))
    columns = (
        *(
            "run",
            "leg",
            "chamber, °C",
            "ramp, °C/min",
            "began, min",
            "air there, min",
            "soaked since, min",
            "ended, min",
        ),
        *("case, °C", "case slope, °C/min", "converter slope, °C/min"),
    )
    note = "Judged again from the recording, by the same steps as on the bench; times since the recording began."
    return Table("Evidence for each soak", columns, rows, note)


def _evidence(leg: LegEvidence) -> tuple[Cell, ...]:
    moments = (leg.began_s, leg.reached_s, leg.soaked_s, leg.ended_s)
    times = (None if t is None else t / 60.0 for t in moments)
    return leg.target_c, leg.ramp_c_min, *times, leg.case_c, leg.case_slope_c_min, leg.converter_slope_c_min


def regime_table(cycle: ThermalCycle) -> Table:
    """Return the table that compares switching times of the indicator with the commanded ramps."""
    rows = tuple((run.name, i, *_regime(r)) for run in cycle.runs for i, r in enumerate(run.regimes, start=1))
    columns = (
        "run",
        "leg",
        "ramp began, min",
        "ramp ended, min",
        "dynamic at, min",
        "delay, s",
        "static at, min",
        "chatter",
    )
    note = (
        f"The indicator's own delay is {cycle.regime_delay_s:g} s. Chatter: changes to dynamic that no ramp explains."
    )
    return Table("Regimes beside the ramps", columns, rows, note)


def _regime(r: LegRegime) -> tuple[Cell, ...]:
    began, ended, dynamic, static = (
        None if t is None else t / 60.0 for t in (r.ramp_began_s, r.ramp_ended_s, r.dynamic_s, r.static_s)
    )
    return began, ended, dynamic, r.onset_delay_s, static, r.chatter
