"""Results of whole turns for a gyro triad, as plain JSON-ready numbers."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from procedures.analysis.calibration.budget import Budget
from procedures.analysis.calibration.station_means import station_means
from procedures.analysis.calibration.station_noise import triad_covariance
from procedures.analysis.calibration.summary import Coefficient
from procedures.analysis.calibration.table_errors import TableErrors, TableUncertainty
from procedures.analysis.own_axes import axes_answered, wrong_axes
from procedures.analysis.turns.budget import turn_budgets, turn_parts
from procedures.analysis.turns.fit import Term, TurnFit, Turning, fit_turns, turn_flaws, turning
from procedures.analysis.turns.path import as_turned
from procedures.analysis.turns.plan import coefficient_names
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.coefficient_name import CoefficientName
from procedures.core.errors import UnfitRecording
from procedures.core.imu_model import TriadCalibration, triad_calibration
from procedures.core.recording import AXES, Recording, Station
from procedures.core.site import Site
from procedures.core.unit import TriadRecord

PLAUSIBLE = 0.2
"""Relative difference from the turns made beyond which a channel is not that of the turning axis."""
LINEAR = 4
"""Number of each channel's linear parameters, which come first: b and its row of K."""


@dataclass(frozen=True)
class RatePoint:
    """Scale factor of one axis at one rate and direction, as a departure from the fitted K."""

    axis: str
    rate_deg_s: float
    """Signed table rate [deg/s]."""
    turns: int
    departure: float
    """Departure ``(y − b·T − K·E)/(2πn·K·e) − 1``, relative: the sum of asymmetry and nonlinearity."""
    standard_uncertainty: float
    """Standard uncertainty of noise and table at this station alone."""
    modelled: float
    """Departure predicted by the fitted terms."""


@dataclass(frozen=True)
class WholeTurns:
    """Complete results of whole turns for a gyro triad."""

    coefficients: tuple[Coefficient, ...]
    calibration: TriadCalibration
    """b and K with their covariance; the terms beyond the linear ones are not part of it."""
    reference_rate_deg_s: float
    """Rate at which the quadratic and the cubic term have the given sizes."""
    points: tuple[RatePoint, ...]
    condition: float
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None
    noise_known: bool
    budgets: tuple[Budget, ...] = ()
    """Uncertainty budget of each coefficient; empty in results of older versions."""

    def coefficient(self, name: str) -> Coefficient:
        """Return a coefficient by its name without the triad: "K11", "asymmetry_x"."""
        return next(c for c in self.coefficients if c.name.symbol == name)


def analyse_turns(
    recordings: Sequence[Recording],
    site: Site,
    uncertainty: TableUncertainty,
    record: TriadRecord | None,
    terms: Sequence[Term],
    reference_rate_deg_s: float,
) -> WholeTurns:
    """Fit the gyro channels of recordings of whole turns.

    Raises `UnfitRecording` where a recording's station has no turn, where the channels are not in angle units, or where
    a channel did not count the turns made; `MissingChannel`; `Undetermined`. `record`: the gyros' noise; None: the
    residuals stand in.
    """
    means = station_means(recordings, "gyro")
    if means.output_unit != "rad/s":
        raise UnfitRecording(f"the gyro channels are in {means.output_unit}: whole turns need a nominal scale in rad")
    stations = _stations(recordings)
    seconds = means.windows[:, 1] - means.windows[:, 0]
    motion = turning(stations, seconds, site)
    outputs = means.outputs * seconds[:, None]
    require_turns(motion, outputs, means.labels)
    motion = as_turned(motion, recordings, site)
    noise = triad_covariance(record, means.windows)
    reference = reference_rate_deg_s * units.DEG
    flaws = turn_flaws(motion, uncertainty)
    fit = fit_turns(motion, outputs, terms, reference, noise, flaws)
    made = whole_turns(fit, terms, motion, outputs, range(len(outputs)), noise is not None)
    made = with_budgets(made, fit, record, means.windows, flaws)
    return replace(made, reference_rate_deg_s=reference_rate_deg_s)


def whole_turns(
    fit: TurnFit,
    terms: Sequence[Term],
    motion: Turning,
    outputs: Array,
    turning_stations: Sequence[int],
    noise_known: bool,
) -> WholeTurns:
    """Return the numbers of a fit, ready to be stored; the rate points are those of the stations that turn."""
    return WholeTurns(
        _coefficients(fit, terms),
        _calibration(fit),
        float(np.max(np.abs(motion.rate_rad_s))) / units.DEG,
        _points(motion, outputs, fit, turning_stations),
        fit.estimator.condition,
        fit.chi_square,
        fit.degrees_of_freedom,
        fit.p_value,
        noise_known,
    )


def with_budgets(
    found: WholeTurns, fit: TurnFit, record: TriadRecord | None, windows: Array, flaws: TableErrors
) -> WholeTurns:
    """Return the result with the budget of each coefficient; `windows` (n, 2) of the recordings, `flaws` of the table.
    `record` None: the noise is that of the residuals.
    """
    parts = turn_parts(record if found.noise_known else None, windows)
    return replace(found, budgets=turn_budgets(fit, [c.name for c in found.coefficients], parts, flaws))


def _stations(recordings: Sequence[Recording]) -> list[Station]:
    stations = [r.info.station for r in recordings]
    for recording, station in zip(recordings, stations, strict=True):
        if station is None or station.turn is None or station.angles is None:
            raise UnfitRecording(f"recording {recording.info.id}: its station has no whole turns")
    return [s for s in stations if s is not None]


def require_turns(motion: Turning, outputs: Array, labels: Sequence[str]) -> None:
    """Check that each station's own channel counted about the turns that were made, in their direction. Raises
    `UnfitRecording`.
    """
    for i, channel in enumerate(motion.channels):
        made = motion.angle_rad[i] * np.sign(motion.axis_b[i, channel])
        if not abs(outputs[i, channel] / made - 1.0) < PLAUSIBLE:
            exchanged = _exchanged(motion, outputs)
            raise UnfitRecording(
                f"station {labels[i]}: gyro_{AXES[channel]} counted {outputs[i, channel] / (2.0 * np.pi):.4g} turns "
                f"where {made / (2.0 * np.pi):.4g} were made{f': {exchanged}' if exchanged else ''}"
            )


def _exchanged(motion: Turning, outputs: Array) -> str:
    """Name exchanged, reversed and dead channels by the turns that each counted about each axis.

    Empty where not every axis was turned: a channel that counted nothing may be that of an axis that stood still.
    """
    counted = np.zeros((3, 3))
    for axis in range(3):
        of = [i for i, channel in enumerate(motion.channels) if channel == axis]
        if not of:
            return ""
        made = motion.angle_rad[of] * np.sign(motion.axis_b[of, axis])
        counted[:, axis] = np.mean(outputs[of] / made[:, None], axis=0)
    return wrong_axes("gyro", axes_answered(counted))


def _coefficients(fit: TurnFit, terms: Sequence[Term]) -> tuple[Coefficient, ...]:
    names = coefficient_names(terms)
    total, noise = np.sqrt(np.diagonal(fit.covariance)), np.sqrt(np.diagonal(fit.noise_covariance))
    table = np.sqrt(np.sum(fit.estimator.table_per_sd**2, axis=1))
    seen = [s for s in dict.fromkeys(fit.estimator.source) if np.any(fit.estimator.of_source(s) > 0.0)]
    names_of = dict.fromkeys(("orthogonality", "pointing", *seen))
    sources = {s: fit.estimator.of_source(s) for s in names_of}
    values = fit.parameters.ravel()
    return tuple(
        Coefficient(
            CoefficientName("gyro", name),
            "rad/s" if name.startswith("b_") else "1",
            float(values[i]),
            float(total[i]),
            float(noise[i]),
            float(table[i]),
            {source: float(part[i]) for source, part in sources.items()},
        )
        for i, name in enumerate(names)
    )


def _calibration(fit: TurnFit) -> TriadCalibration:
    per_channel = fit.parameters.shape[1]
    linear = [c * per_channel + i for c in range(3) for i in range(LINEAR)]
    covariance = fit.covariance[np.ix_(linear, linear)]
    return triad_calibration("gyro", "rad/s", "rad/s", fit.parameters[:, :LINEAR], covariance)


def _points(motion: Turning, outputs: Array, fit: TurnFit, stations: Sequence[int]) -> tuple[RatePoint, ...]:
    bias, matrix = fit.parameters[:, 0], fit.parameters[:, 1:LINEAR]
    known = motion.seconds[:, None] * bias + motion.earth_rad @ matrix.T
    turned = motion.turned_b @ matrix.T
    points: list[RatePoint] = []
    for i in stations:
        c = motion.channels[i]
        departure = (outputs[i, c] - known[i, c]) / turned[i, c] - 1.0
        direction = float(np.sign(motion.axis_b[i, c]))
        points.append(
            RatePoint(
                AXES[c],
                float(motion.rate_rad_s[i]) / units.DEG * direction,
                round(float(motion.angle_rad[i]) * direction / (2.0 * np.pi)),
                float(departure),
                float(fit.output_sd[i, c] / abs(turned[i, c])),
                float(departure - fit.residuals[i, c] / turned[i, c]),
            )
        )
    return tuple(points)
