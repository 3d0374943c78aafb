"""Turns a request into a plan before anything moves: complete parameters, stations, and the predicted uncertainty."""

from dataclasses import dataclass, replace
from typing import Any

from bench_service.bench.directory import BenchDirectory
from bench_service.bench.mountings import MountingStore
from bench_service.evidence.catalogue import AnyProcedure, Catalogue
from bench_service.evidence.units import UnitStore
from bench_service.jobs.procedure_calls import planned_checks_of, predicted, quantities_of, resolved, stations_of
from bench_service.model.errors import NotFound, NotMounted
from bench_service.model.mountings import StoredMounting
from bench_service.wall_clock import now
from procedures.analysis.response.trace import ENCODER_CHANNELS
from procedures.bench import BenchDescription
from procedures.core.errors import BadParameter
from procedures.core.recording import Station
from procedures.core.unit import Unit
from procedures.procedure import Context, JudgedParameters, Parameters, Prediction

BYTES_PER_SAMPLE = 2
"""Bytes that a stored sample may take; a preview gives the room that a plan may need at most."""

TEMPERATURE_CHANNELS = 7
"""Five sensors of the unit and two readings of the chamber, added to the triads where a station wants temperatures."""


@dataclass(frozen=True)
class Plan:
    """A job that is planned in full: procedure, complete parameters, context, stations, prediction, size of its data,
    violated limits.
    """

    procedure: AnyProcedure
    parameters: Parameters
    context: Context
    stations: tuple[Station, ...]
    prediction: Prediction
    data_bytes: int
    violations: tuple[str, ...]


class Planner:
    """Makes plans of jobs, from the catalogue of procedures, the known benches and the stored units. Changes
    nothing.
    """

    def __init__(
        self, units: UnitStore, benches: BenchDirectory, catalogue: Catalogue, mountings: MountingStore | None = None
    ) -> None:
        """Set up with `mountings` of units; None: none is known."""
        self.benches = benches
        self.catalogue = catalogue
        self._units = units
        self._mountings = mountings

    def context(self, unit: str, bench: str | None = None, mounting: str | None = None) -> Context:
        """Return the unit with its current data, the bench and the mounting. Raises `NotFound` for an unknown bench,
        `NotMounted` for its unit.

        `mounting`: the id of the unit's mounting; None: the one that stands on that bench, if any. Raises
        `BadParameter` for one that does not stand there.
        """
        description = self.benches.description(self.benches.default() if bench is None else bench)
        context = Context(self.unit(unit, description.id), description)
        stands = self.mounting(unit, description.id)
        if mounting is not None and (stands is None or stands.id != mounting):
            there = "none stands there" if stands is None else f"there stands {stands.id}"
            raise BadParameter(
                "mounting", mounting, f"one of unit {unit} that stands on bench {description.id}: {there}"
            )
        return context if stands is None else context.on(stands.for_context())

    def mounting(self, unit: str, bench: str) -> StoredMounting | None:
        """Return the mounting of a unit that stands on a bench now; None where there is none."""
        return None if self._mountings is None else self._mountings.standing(unit, bench)

    def unit(self, serial: str, bench: str) -> Unit:
        """Return a unit that is mounted on a bench, with its current calibration. Raises `NotMounted`, `NotFound`."""
        mounted = {unit.serial: unit for unit in self.benches.mounted(bench, serial)}
        if serial not in mounted:
            raise NotMounted(f"bench {bench!r} has no unit {serial!r}; it has {', '.join(mounted)}")
        try:
            return self._units.unit(serial)
        except NotFound:
            return mounted[serial]

    def plan(
        self,
        name: str,
        unit: str,
        requested: dict[str, Any],
        bench: str | None = None,
        mounting: str | None = None,
    ) -> Plan:
        """Return the plan of a job; nothing moves or is stored. Raises pydantic's `ValidationError`, `DomainError`,
        `NotFound`, `NotMounted`.

        `bench` None: the default one. `mounting` as in `context`.
        """
        self.catalogue.procedure(name)  # an unknown procedure is said before an unknown unit
        return self.plan_in(self.context(unit, bench, mounting), name, requested)

    def plan_in(self, context: Context, name: str, requested: dict[str, Any]) -> Plan:
        """Return the plan of a job in a context that is known; raises as `plan`, except for the context."""
        procedure = self.catalogue.procedure(name)
        parameters = resolved(procedure, requested, context)
        stations = stations_of(procedure, parameters)
        overdue = context.bench.overdue(now().date().isoformat())
        refused = overdue if context.bench.expired_certificates == "refuse" else ()
        violations = refused + tuple(
            f"station {s.index} ({s.label}): {sentence}" for s in stations for sentence in _violations(s, context.bench)
        )
        prediction = predicted(procedure, parameters, context)
        _require_rules(procedure, parameters, context)
        if overdue and not refused:
            prediction = replace(prediction, warnings=(*prediction.warnings, *overdue))
        data_bytes = sum(_samples(s, context.unit) for s in stations) * BYTES_PER_SAMPLE
        return Plan(procedure, parameters, context, stations, prediction, data_bytes, violations)

    def refreshed(self, context: Context) -> Context:
        """Return the context with the unit's present noise and current calibration; bench and mounting stay the
        same.
        """
        return replace(context, unit=self._units.unit(context.unit.serial))


def _require_rules(procedure: AnyProcedure, parameters: Parameters, context: Context) -> None:
    """Refuse a decision rule for a check that the result will not have, where its names are known beforehand."""
    rules = parameters.decision if isinstance(parameters, JudgedParameters) else None
    if rules is not None and rules.by_check:
        planned = [one.check for one in planned_checks_of(procedure, parameters, context)]
        rules.require_known([*dict.fromkeys((*planned, *(quantities_of(procedure, parameters, context) or ())))])


def _violations(station: Station, bench: BenchDescription) -> tuple[str, ...]:
    """The bench's limits that a station exceeds, as sentences."""
    if station.temperatures and bench.no_thermal_jobs:
        return (bench.no_thermal_jobs,)
    if station.supply_voltage_v is not None:
        if bench.supply is None:
            return (f"supply_voltage_v = {station.supply_voltage_v:g}: the supply of bench {bench.id} only switches",)
        if found := bench.supply.violations(station.supply_voltage_v):
            return found
    if station.current_ma is not None:
        return bench.current_violations(station.current_ma, station.profile)
    return bench.motion_violations(station)


def _samples(station: Station, unit: Unit) -> int:
    """Number of samples of all channels; a profile counts for its expected time."""
    if station.current_ma is not None:  # a converter alone: three channels and its own sensor, after its soak
        return round(station.record_s * (station.sample_rate_hz or unit.sample_rate_hz)) * 4
    seconds = station.record_s if station.profile is None else station.profile.expected_s()
    channels = len(unit.channels) + TEMPERATURE_CHANNELS * station.temperatures
    channels += len(ENCODER_CHANNELS) * (station.sinusoid is not None)
    return round(seconds * (station.sample_rate_hz or unit.sample_rate_hz)) * channels
