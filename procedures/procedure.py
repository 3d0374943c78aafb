"""Interface of a catalogue file: `Procedure` or `Method`, with the values that they take and give."""

from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Generic, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from procedures.analysis.fitness.findings import FitnessSettings
from procedures.analysis.fitness.watched import Inspection
from procedures.bench import Bench, BenchDescription
from procedures.bench.imu import Stream
from procedures.core.errors import BadParameter
from procedures.core.imu_model import TriadCalibration
from procedures.core.limits import Check, OutcomeName, PlannedCheck, Verdict
from procedures.core.mounting import Mounting
from procedures.core.recording import Recording, Station
from procedures.core.report import Report
from procedures.core.unit import Unit
from procedures.core.unit_correction import CorrectionKind, UnitCorrection
from procedures.parameters import JudgedParameters as JudgedParameters
from procedures.parameters import Parameters
from procedures.parameters import RecordedParameters as RecordedParameters


@dataclass(frozen=True)
class Statement:
    """Statement of conformity of a whole result."""

    outcome: OutcomeName
    """The verdict, conditional where some value lies within its expanded uncertainty of the limit."""
    rule: str
    """Decision rule in words."""
    conditional: tuple[str, ...] = ()
    """Checks whose values lie within their expanded uncertainty of the limit."""


_SHOWN_WHERE_MADE = Field(
    exclude_if=lambda found: found is None,
    description="Statement of conformity; null without checks and in results of older versions",
)


class Outcome(BaseModel):
    """Base of every result model: JSON-ready numbers, the checks with their verdict, and warnings to the reader."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Annotated[Statement | None, _SHOWN_WHERE_MADE] = None


@dataclass(frozen=True)
class Estimate:
    """Named number of a result. Limits and trends of campaigns may be about it, as about a check."""

    name: str
    unit: str
    estimate: float
    standard_uncertainty: float


P = TypeVar("P", bound=Parameters)
R = TypeVar("R", bound=Outcome)


@dataclass(frozen=True)
class Context:
    """Known facts when a job is planned or its recordings are analysed: kept with the job as part of its lineage."""

    unit: Unit
    bench: BenchDescription
    """The bench; the azimuth of its site is the mounting's where there is one."""
    mounting: Mounting | None = None
    """The mounting of the unit on the bench; None: nobody has entered one, the bench's declared azimuth counts."""

    def on(self, mounting: Mounting) -> "Context":
        """Return this context with a mounting, whose azimuth and its uncertainty replace those that the bench
        declares.
        """
        azimuth = {"azimuth_deg": mounting.azimuth_deg, "azimuth_sd_arcsec": mounting.azimuth_sd_arcsec}
        return replace(self, bench=replace(self.bench, site=replace(self.bench.site, **azimuth)), mounting=mounting)


@dataclass(frozen=True)
class PredictedUncertainty:
    """Predicted standard uncertainty of a coefficient, and its contributions."""

    name: str
    unit: str
    standard_uncertainty: float
    from_noise: float
    from_table: float = 0.0
    quantity: Annotated[str, Field(exclude=True)] = ""
    """The check or named estimate of the result that this is about, where its name is not `name`; kept out of JSON."""

    def about(self, quantity: str) -> bool:
        """Return whether this is the uncertainty of the quantity with this name."""
        return quantity == (self.quantity or self.name)


@dataclass(frozen=True)
class Prediction:
    """Prediction of a plan: its duration, the uncertainties, and warnings."""

    duration_s: float = 0.0
    uncertainties: tuple[PredictedUncertainty, ...] = ()
    warnings: tuple[str, ...] = ()
    basis: str = ""
    """Basis of the prediction, as text: which calibration, or nominal scale factors where there is none."""


@dataclass(frozen=True)
class DatedCalibration:
    """Stored calibration of a unit: its id, when it was made (ISO 8601), and its triads."""

    id: str
    made_at: str
    triads: tuple[TriadCalibration, ...]
    mounting: str = ""
    """Id of the unit's mounting under which it was made; empty: none is known."""


@dataclass(frozen=True)
class Evidence:
    """Inputs of a method: recordings and calibrations that are stored."""

    recordings: tuple[Recording, ...] = ()
    calibrations: tuple[DatedCalibration, ...] = ()

    def one_each(self) -> dict[str, TriadCalibration]:
        """Return the given calibrations by triad. Raises `BadParameter` where two are of one triad."""
        found: dict[str, TriadCalibration] = {}
        for calibration in (c for dated in self.calibrations for c in dated.triads):
            if calibration.triad in found:
                allowed = f"one of each triad; two are of the {calibration.triad} triad"
                raise BadParameter("calibrations", len(self.calibrations), allowed)
            found[calibration.triad] = calibration
        return found

    def calibrations_of(self, unit: Unit | None, triads: Sequence[str]) -> tuple[dict[str, TriadCalibration], str]:
        """Return the given calibrations by triad, else the unit's current ones, and the basis as a result names it.

        Raises `BadParameter` where one of `triads` has none, and `NoCalibration` as `Unit.calibration`.
        """
        if self.calibrations:
            by_name, basis = self.one_each(), self.calibrations_in_words
        else:
            known = {triad: unit.calibration(triad) for triad in triads} if unit else {}
            by_name = {triad: c for triad, c in known.items() if c is not None}
            basis = f"the unit's current {unit.calibration_in_words(*triads)}" if unit else ""
        for triad in triads:
            if triad not in by_name:
                raise BadParameter("calibrations", len(self.calibrations), f"the {triad} triad has no calibration")
        return by_name, basis

    @property
    def calibrations_in_words(self) -> str:
        """The given calibrations as a result's basis names them: id and time of each."""
        return "calibration " + ", ".join(f"{c.id} of {c.made_at}" for c in self.calibrations)


def _no_calibrations(_: Any) -> tuple[TriadCalibration, ...]:
    return ()


def _no_corrections(_: Any) -> tuple[UnitCorrection, ...]:
    return ()


def _uses_none(_: Any) -> tuple[CorrectionKind, ...]:
    return ()


STATIONS = Inspection(
    FitnessSettings(least_samples=1, counters_may_rest=True, beside_others=True, means_only=True, seeks_scale=True)
)
"""Stations at rest whose means are taken, as most procedures record them. Turning stations need another one."""


def _stations(_: Any) -> Inspection:
    return STATIONS


def _at_rest(_params: Any, count: int) -> Inspection:
    return Inspection(FitnessSettings(least_samples=1)) if count == 1 else STATIONS


Planned = Sequence[tuple[PredictedUncertainty, ...]]
"""The predicted coefficients of several calibrations, calibration by calibration."""


def _no_checks(_params: Any, _context: Context) -> tuple[PlannedCheck, ...]:
    return ()


def _no_checks_of_method(_params: Any, _unit: Unit, _planned: Planned) -> tuple[PlannedCheck, ...]:
    return ()


def _nothing_learnt(_: Any, unit: Unit, _origin: str) -> Unit:
    return unit


def _no_averaging_time(_params: Any, _context: Context) -> float | None:
    return None


@dataclass(frozen=True)
class Procedure(Generic[P, R]):
    """A test procedure: the actions on the bench, and the analysis of the recordings.

    `resolve` fills defaults that depend on the unit or the bench (the dwell from the averaging time);
    `schedule` is pure and gives the stations; `predict` gives the plan's uncertainties, or raises `DomainError` where
    the plan is useless; `acquire` may begin at any station and yields one stream per station, in order; `analyse` is
    pure and can be run again on stored recordings. Storage, progress, cancelling and making safe are the executor's.
    """

    name: str
    title: str
    version: str
    params: type[P]
    result: type[R]
    resolve: Callable[[P, Context], P]
    schedule: Callable[[P], tuple[Station, ...]]
    predict: Callable[[P, Context], Prediction]
    acquire: Callable[[Bench, Sequence[Station]], AsyncIterator[Stream]]
    analyse: Callable[[Sequence[Recording], P, Context], R]
    report: Callable[[R], Report]
    calibrations: Callable[[R], tuple[TriadCalibration, ...]] = _no_calibrations
    uses_calibration: tuple[str, ...] = ()
    """Triads whose current calibrations the result rests on; those that there are then belong to its lineage."""
    corrections: Callable[[R], tuple[UnitCorrection, ...]] = _no_corrections
    """The correction sets that a result gives: at most one of a kind."""
    uses_corrections: Callable[[P], tuple[CorrectionKind, ...]] = _uses_none
    """Kinds of the unit's current corrections that the result rests on; those it has then belong to its lineage."""
    learns: Callable[[R, Unit, str], Unit] = _nothing_learnt
    """Function that updates the unit's record from a job's result; the text names that result as its origin."""
    expected_averaging_time: Callable[[P, Context], float | None] = _no_averaging_time
    """Averaging time that `learns` is expected to give the unit's record, for previews of what comes after [s]; None:
    the present one stays, or nothing is known."""
    quantities: Callable[[P, Context], tuple[str, ...]] | None = None
    """Names of the checks and of the named estimates that a result will have; None: not known before the job."""
    planned_checks: Callable[[P, Context], tuple[PlannedCheck, ...]] = _no_checks
    """Checks that a result will have, with the uncertainty of the plan; those that a plan can predict."""
    inspection: Callable[[P], Inspection] = _stations
    """Inspection of the recordings before the analysis; see `procedures.inspection`."""


@dataclass(frozen=True)
class Method(Generic[P, R]):
    """A method of analysing existing recordings or calibrations; needs no bench: its parameters, its functions, its
    version.
    """

    name: str
    title: str
    version: str
    params: type[P]
    result: type[R]
    analyse: Callable[[Evidence, P, Unit | None], R]
    report: Callable[[R], Report]
    calibrations: Callable[[R], tuple[TriadCalibration, ...]] = _no_calibrations
    corrections: Callable[[R], tuple[UnitCorrection, ...]] = _no_corrections
    """The correction sets that a result gives: at most one of a kind."""
    uses_corrections: Callable[[R], tuple[CorrectionKind, ...]] = _uses_none
    """Kinds of the unit's current corrections that were applied for a result; they then belong to its lineage."""
    planned_checks: Callable[[P, Unit, Planned], tuple[PlannedCheck, ...]] = _no_checks_of_method
    """Checks that a result will have, from the plans of the calibrations that it is to work on."""
    inspection: Callable[[P, int], Inspection] = _at_rest
    """Inspection of a number of recordings before the analysis; see `procedures.inspection`."""
