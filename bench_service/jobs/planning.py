"""From a request to a plan: parameters complete, stations laid out, worth predicted, before anything moves."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from pydantic import TypeAdapter

from bench_service.jobs.directory import BenchDirectory
from bench_service.jobs.errors import NotFound, NotMounted, NotUnderstood
from bench_service.jobs.job import Job
from bench_service.jobs.store import Stores
from procedures import catalog
from procedures.bench import BenchDescription
from procedures.core.errors import DomainError
from procedures.core.recording import Station
from procedures.core.unit import Unit
from procedures.procedure import Context, Outcome, Parameters, Prediction, Procedure

BYTES_PER_SAMPLE = 2
"""What a stored sample is allowed to weigh (design.md, budgets); a preview says what a plan may need at most."""

TEMPERATURE_CHANNELS = 7
"""Five sensors of the unit and two readings of the chamber, beside the triads where a station wants temperatures."""

CONTEXT = TypeAdapter(Context)

AnyProcedure = Procedure[Parameters, Outcome]


@dataclass(frozen=True)
class Plan:
    """A procedure ready to run."""

    procedure: AnyProcedure
    parameters: Parameters
    context: Context
    stations: tuple[Station, ...]
    prediction: Prediction
    data_bytes: int
    violations: tuple[str, ...]


class Planner:
    """Knows the catalogue and the benches."""

    def __init__(self, stores: Stores, benches: BenchDirectory) -> None:
        self.benches = benches
        self._stores = stores

    @cached_property
    def catalog(self) -> Mapping[str, AnyProcedure]:
        """Every procedure by name; read when it is first wanted, because that imports all of the numerics."""
        return catalog.discover()

    def procedure(self, name: str) -> AnyProcedure:
        """Raises `NotFound`."""
        if name not in self.catalog:
            raise NotFound("procedure", name)
        return self.catalog[name]

    def context(self, unit: str, bench: str | None = None) -> Context:
        """What is known now. Raises `NotFound` for an unknown bench, `NotMounted` for a unit it does not have."""
        description = self.benches.description(self.benches.default() if bench is None else bench)
        return Context(self.unit(unit, description.id), description)

    def unit(self, serial: str, bench: str) -> Unit:
        """A unit that is mounted on a bench, with its current calibration. Raises `NotMounted`, `NotFound`."""
        mounted = {unit.serial: unit for unit in self.benches.mounted(bench, serial)}
        if serial not in mounted:
            raise NotMounted(f"bench {bench!r} has no unit {serial!r}; it has {', '.join(mounted)}")
        try:
            return self._stores.units.unit(serial)
        except NotFound:
            return mounted[serial]

    def plan(self, name: str, unit: str, requested: dict[str, Any], bench: str | None = None) -> Plan:
        """Raises pydantic's `ValidationError`, `DomainError`, `NotFound`, `NotMounted`. Nothing moves."""
        procedure = self.procedure(name)
        context = self.context(unit, bench)
        parameters = procedure.resolve(procedure.params.model_validate(requested), context)
        stations = procedure.schedule(parameters)
        violations = tuple(
            f"station {s.index} ({s.label}): {sentence}" for s in stations for sentence in _violations(s, context.bench)
        )
        prediction = procedure.predict(parameters, context)
        data_bytes = sum(_samples(s, context.unit) for s in stations) * BYTES_PER_SAMPLE
        return Plan(procedure, parameters, context, stations, prediction, data_bytes, violations)

    def refreshed(self, context: Context) -> Context:
        """The same bench, and the unit as it is known now: its noise, and the calibration that is current."""
        return replace(context, unit=self._stores.units.unit(context.unit.serial))


def context_of(job: Job) -> Context:
    """What was known of a job's unit and bench. Raises `NotUnderstood`."""
    try:
        return CONTEXT.validate_python(job.context)
    except (ValueError, DomainError) as error:
        raise NotUnderstood(job.id, job.code_version, error) from error


def _violations(station: Station, bench: BenchDescription) -> tuple[str, ...]:
    """Limits of the bench that a station passes."""
    if station.current_ma is not None:
        return bench.current_violations(station.current_ma, station.profile)
    return () if station.angles is None else bench.violations(station.angles, station.turn, station.profile)


def _samples(station: Station, unit: Unit) -> int:
    """Samples of all channels; of a profile as long as it is expected to take."""
    if station.current_ma is not None:  # a converter alone: three channels and its own sensor, after it has soaked
        return round(station.record_s * (station.sample_rate_hz or unit.sample_rate_hz)) * 4
    seconds = station.record_s if station.profile is None else station.profile.expected_s()
    channels = len(unit.channels) + TEMPERATURE_CHANNELS * station.temperatures
    return round(seconds * (station.sample_rate_hz or unit.sample_rate_hz)) * channels


def register(stores: Stores, unit: Unit) -> None:
    """Remember a unit that is met for the first time."""
    try:
        stores.units.unit(unit.serial)
    except NotFound:
        stores.units.put_unit(unit)
