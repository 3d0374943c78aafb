"""Stability from launch to launch: how much bias and scale factor differ between calibrations (thesis 5.2, 5.3)."""

from math import sqrt

from pydantic import Field

from procedures.analysis.repeatability.run_to_run import Scatter, run_to_run
from procedures.core import units
from procedures.core.errors import BadParameter
from procedures.core.imu_model import TriadCalibration
from procedures.core.limits import Check, Limit, PlannedCheck, check, verdict
from procedures.core.report import Figure, Report, Series, Table
from procedures.core.unit import Unit
from procedures.parameters import largest
from procedures.procedure import Evidence, JudgedParameters, Method, Outcome, Planned

TRIADS = ("gyro", "accelerometer")
SOURCE = "thesis 4.3, 5.6"
FIELDS = {
    ("gyro", True): "gyro_bias_run_to_run_deg_h",
    ("gyro", False): "gyro_scale_run_to_run_ppm",
    ("accelerometer", True): "accelerometer_bias_run_to_run_m_s2",
    ("accelerometer", False): "accelerometer_scale_run_to_run_ppm",
}
"""Triad, and whether it is the bias -> the field of the limit."""


class Params(JudgedParameters):
    """Requirements on the standard deviation between launches (thesis 4.3, 5.6); None: it is not judged."""

    gyro_bias_run_to_run_deg_h: float | None = Field(0.015, gt=0.0, le=1e6)
    gyro_scale_run_to_run_ppm: float | None = Field(10.0, gt=0.0, le=1e6)
    accelerometer_bias_run_to_run_m_s2: float | None = Field(0.0005, gt=0.0, le=100.0)
    accelerometer_scale_run_to_run_ppm: float | None = Field(200.0, gt=0.0, le=1e6)


class Result(Outcome):
    """Sample standard deviations (n − 1) with their intervals, and the resolution of the calibrations."""

    scatters: tuple[Scatter, ...]


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Return the scatter of all calibrations given, triad by triad. Raises `BadParameter` for fewer than two of a
    triad.
    """
    found: list[Scatter] = []
    for triad in TRIADS:
        of_triad = [c for dated in evidence.calibrations for c in dated.triads if c.triad == triad]
        if len(of_triad) >= 2:
            found += run_to_run(of_triad)
    if not found:
        raise BadParameter("calibrations", len(evidence.calibrations), "at least two of the same triad are needed")
    judged = [(s, _limit(s, params)) for s in found]
    checks = tuple(_check(s, limit) for s, limit in judged if limit is not None)
    warnings = tuple(
        f"{s.triad} {s.name}: the limit cannot be resolved, the calibrations' own uncertainty is "
        f"{_show(s, s.expected_from_measurement)}"
        for s, limit in judged
        if limit is not None and not s.resolves(_si(s, limit))
    )
    unjudged = tuple(
        f"{s.triad} {s.name} is in counts: no limit applies"
        if s.unit == "count"
        else f"{s.triad} {s.name} was not judged: no limit was given"
        for s, limit in judged
        if limit is None
    )
    return Result(checks=checks, verdict=verdict(checks), warnings=(*warnings, *unjudged), scatters=tuple(found))


def report(result: Result) -> Report:
    """Return the report: checks, scatter, and every coefficient over the calibrations."""
    rows = tuple(
        (
            s.triad,
            s.name,
            _display(s)[0],
            s.mean / (1.0 if s.unit == "1" else _display(s)[1]),
            s.sd / _display(s)[1],
            s.low / _display(s)[1],
            s.high / _display(s)[1],
            s.expected_from_measurement / _display(s)[1],
        )
        for s in result.scatters
    )
    columns = ("triad", "coefficient", "unit", "mean", "sd", "95 % from", "95 % to", "of measurement alone")
    table = Table("Scatter between calibrations", columns, rows, "Sample standard deviation with n − 1.")
    return Report(sections=(table, *(_figure(s) for s in result.scatters)))


def _figure(s: Scatter) -> Figure:
    unit, size = ("1", 1.0) if s.unit == "1" else _display(s)
    x = tuple(float(i) for i in range(1, len(s.values) + 1))
    points = Series(s.name, x, tuple(v / size for v in s.values), tuple(e / size for e in s.value_sds), "line_points")
    mean = Series("mean", x, (s.mean / size,) * len(x), style="reference")
    return Figure(f"{s.triad} {s.name}", "calibration", f"{s.name}, {unit}", (points, mean))


def _display(s: Scatter) -> tuple[str, float]:
    return ("ppm", units.PPM) if s.unit == "1" else units.DISPLAY[s.unit]


def _show(s: Scatter, value: float) -> str:
    unit, size = _display(s)
    return f"{value / size:.3g} {unit}"


def _limit(s: Scatter, params: Params) -> Limit | None:
    """Limit in a display unit; None for a bias in counts, and where none was given."""
    return None if s.unit == "count" else _limit_of(s.triad, s.name.startswith("bias"), params, _display(s)[0])


def _limit_of(triad: str, bias: bool, params: Params, unit: str) -> Limit | None:
    """The limit with its source, the thesis or the request; None where there is none."""
    limit = largest(params, FIELDS[triad, bias], unit, SOURCE)
    return None if limit.maximum is None else limit


def _si(s: Scatter, limit: Limit) -> float:
    return (limit.maximum or 0.0) * _display(s)[1]


def _check(s: Scatter, limit: Limit) -> Check:
    size = _display(s)[1]
    note = "" if s.resolves(_si(s, limit)) else "beneath the uncertainty of the calibrations: not resolved"
    standard_uncertainty = s.sd / size / sqrt(2.0 * (len(s.values) - 1))
    return check(f"{s.triad} {s.name} run to run", s.sd / size, limit, standard_uncertainty, note, len(s.values) - 1.0)


def planned_checks(params: Params, unit: Unit, planned: Planned) -> tuple[PlannedCheck, ...]:
    """Return the planned checks of the scatter over calibrations that are planned, by their predicted uncertainties.

    Of a scale factor the nominal one is taken for 1, as in the preview of a unit that has no calibration.
    """
    found: list[PlannedCheck] = []
    for triad in TRIADS:
        names = [(f"bias {axis}", f"{triad}.b_{axis}") for axis in "xyz"]
        names += [(f"scale factor {axis}", f"{triad}.K{k}{k}") for k, axis in enumerate("xyz", start=1)]
        for name, coefficient in names:
            bias = name.startswith("bias")
            own = [p for one in planned for p in one if p.name == coefficient]
            if len(own) < 2:
                continue
            display, size = units.DISPLAY[own[0].unit] if bias else ("ppm", units.PPM)
            limit = _limit_of(triad, bias, params, display)
            if limit is None:
                continue
            record, u = unit.triad(triad), sqrt(sum(p.standard_uncertainty**2 for p in own) / len(own)) / size
            sd = None if record is None else record.bias_run_to_run_sd if bias else record.scale_factor_run_to_run_sd
            expected = None if sd is None else sd / size
            found.append(PlannedCheck(f"{triad} {name} run to run", limit, u, len(own) - 1.0, expected))
    return tuple(found)


def calibrations(result: Result) -> tuple[TriadCalibration, ...]:
    """Return no calibrations: they are the input of this method."""
    return ()


METHOD = Method(
    *("run_to_run", "Stability from launch to launch", "1.1.0"),
    *(Params, Result, analyse, report, calibrations),
    planned_checks=planned_checks,
)
