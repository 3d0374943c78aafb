"""Calls of a procedure's own functions while a job is planned: what they give is checked before anything moves."""

from collections.abc import Mapping
from typing import Any

from pydantic_core import to_jsonable_python

from bench_service.evidence.catalogue import AnyProcedure
from bench_service.formats.plain_json import faults
from bench_service.telemetry.defects import author_is_named
from procedures.core.errors import ProcedureDefect
from procedures.core.limits import PlannedCheck
from procedures.core.recording import Station
from procedures.procedure import Context, Parameters, Prediction


def resolved(procedure: AnyProcedure, requested: Mapping[str, Any], context: Context) -> Parameters:
    """Return the complete parameters of a request. Raises pydantic's `ValidationError`, `DomainError`; a
    `ProcedureDefect` where `resolve` fails or gives something else.
    """
    given = procedure.params.model_validate(requested)
    with author_is_named(procedure.name, "resolve"):
        parameters = procedure.resolve(given, context)
    _require_kind(procedure, "resolve", parameters, procedure.params)
    return parameters


def stations_of(procedure: AnyProcedure, parameters: Parameters) -> tuple[Station, ...]:
    """Return the stations of complete parameters. Raises `ProcedureDefect` where they are not numbered 0, 1, 2, … in
    order, or where a number of theirs is not finite or a time is negative.

    Recordings are found by these numbers after a crash, so a job with others would lose stations.
    """
    with author_is_named(procedure.name, "schedule"):
        stations = tuple(procedure.schedule(parameters))
    for station in stations:
        _require_kind(procedure, "schedule", station, Station)
    numbers = [station.index for station in stations]
    if numbers != list(range(len(stations))):
        found = ", ".join(map(str, numbers[:8])) + (", …" if len(numbers) > 8 else "")
        raise ProcedureDefect(
            f"procedure {procedure.name} numbers its {len(stations)} stations {found}: `schedule` must number them "
            "from 0, in order: 0, 1, 2, …"
        )
    _require_finite(procedure, "schedule", stations, "stations")
    for station in stations:
        for name in ("settle_s", "record_s", "power_off_s"):
            if (seconds := getattr(station, name)) < 0.0:
                raise ProcedureDefect(
                    f"`schedule` of procedure {procedure.name} gave stations.{station.index}.{name} = {seconds}: "
                    "a time from 0 s on is expected"
                )
    return stations


def predicted(procedure: AnyProcedure, parameters: Parameters, context: Context) -> Prediction:
    """Return the prediction of a plan. Raises `DomainError` where the plan is worth nothing, `ProcedureDefect` where
    `predict` fails or a number of the prediction is not finite.
    """
    with author_is_named(procedure.name, "predict"):
        prediction = procedure.predict(parameters, context)
    _require_kind(procedure, "predict", prediction, Prediction)
    _require_finite(procedure, "predict", prediction, "prediction")
    return prediction


def quantities_of(procedure: AnyProcedure, parameters: Parameters, context: Context) -> tuple[str, ...] | None:
    """Return the names of checks and estimates that the result will have; None where the procedure names none."""
    if procedure.quantities is None:
        return None
    with author_is_named(procedure.name, "quantities"):
        return tuple(procedure.quantities(parameters, context))


def planned_checks_of(procedure: AnyProcedure, parameters: Parameters, context: Context) -> tuple[PlannedCheck, ...]:
    """Return the checks that the result will have, as far as the plan predicts them. Raises `ProcedureDefect`."""
    with author_is_named(procedure.name, "planned_checks"):
        return tuple(procedure.planned_checks(parameters, context))


def expected_averaging_time_of(procedure: AnyProcedure, parameters: Parameters, context: Context) -> float | None:
    """Return the averaging time that the result is expected to give the unit's record [s]; None where it gives none.
    Raises `ProcedureDefect`.
    """
    with author_is_named(procedure.name, "expected_averaging_time"):
        return procedure.expected_averaging_time(parameters, context)


def _require_kind(procedure: AnyProcedure, function: str, given: object, kind: type) -> None:
    if not isinstance(given, kind):
        raise ProcedureDefect(
            f"`{function}` of procedure {procedure.name} gave a {type(given).__name__}, not a {kind.__name__}"
        )


def _require_finite(procedure: AnyProcedure, function: str, given: object, name: str) -> None:
    """Refuse NaN and infinity, which the stores could not keep, and texts that they could not give back."""
    document = to_jsonable_python(given, inf_nan_mode="constants")
    fault = next(faults(document), None)
    if fault is not None:
        place = ".".join(map(str, (name, *fault.path)))
        raise ProcedureDefect(
            f"`{function}` of procedure {procedure.name} gave {place} = {fault.value!r}: {fault.allowed}"
        )
