"""From a request to a plan: parameters complete, stations laid out, worth predicted, before anything moves."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from pydantic import TypeAdapter

from bench_service.jobs.driver import BenchDriver
from bench_service.jobs.errors import NotFound, NotMounted
from bench_service.jobs.store import Stores
from procedures import catalog
from procedures.core.recording import Station
from procedures.core.unit import Unit
from procedures.procedure import Context, Outcome, Parameters, Prediction, Procedure

BYTES_PER_SAMPLE = 2
"""What a stored sample is allowed to weigh (design.md, budgets); a preview says what a plan may need at most."""

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
    """Knows the catalogue and the one bench of this process."""

    def __init__(self, stores: Stores, driver: BenchDriver) -> None:
        self._stores = stores
        self._driver = driver

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
        description = self._driver.description
        if bench is not None and bench != description.id:
            raise NotFound("bench", bench)
        return Context(self.unit(unit), description)

    def unit(self, serial: str) -> Unit:
        """A unit that is mounted on the bench, with its current calibration. Raises `NotMounted`."""
        mounted = {unit.serial: unit for unit in self._driver.mounted(serial)}
        if serial not in mounted:
            raise NotMounted(
                f"bench {self._driver.description.id!r} has no unit {serial!r}; it has {', '.join(mounted)}"
            )
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
            f"station {s.index} ({s.label}): {sentence}"
            for s in stations
            if s.angles is not None
            for sentence in context.bench.violations(s.angles, s.turn)
        )
        prediction = procedure.predict(parameters, context)
        samples = sum(round(s.record_s * (s.sample_rate_hz or context.unit.sample_rate_hz)) for s in stations)
        data_bytes = samples * len(context.unit.channels) * BYTES_PER_SAMPLE
        return Plan(procedure, parameters, context, stations, prediction, data_bytes, violations)

    def refreshed(self, context: Context) -> Context:
        """The same bench, and the unit as it is known now: its noise, and the calibration that is current."""
        return replace(context, unit=self._stores.units.unit(context.unit.serial))


def register(stores: Stores, unit: Unit) -> None:
    """Remember a unit that is met for the first time."""
    try:
        stores.units.unit(unit.serial)
    except NotFound:
        stores.units.put_unit(unit)
