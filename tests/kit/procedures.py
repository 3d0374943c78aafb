"""Test kit for a procedure: its form, a run on the simulated bench without a service, and its claim over many units.

    six_faces = discover()["six_faces"]
    context = simulated_context()
    require_form(six_faces, context, dwell_s=20.0)
    result = run(six_faces, seed=3, dwell_s=20.0)

Recordings whose truth is known, without a simulator: `tests.kit.forward_model`.
"""

import asyncio
import inspect
from collections.abc import AsyncIterator, Sequence
from math import isfinite
from typing import Any

import numpy as np

from bench_service.drivers.simulated import SimulatedDriver
from bench_service.evidence.documents import document_of, require_storable
from procedures.bench import BenchNeeds
from procedures.bench.imu import Stream
from procedures.core.recording import MemoryRecording, RawArray, RecordingInfo, Station
from procedures.core.report import Figure, Report, Table
from procedures.procedure import Context, Method, Outcome, Parameters, Procedure

AnyProcedure = Procedure[Any, Any]


def simulated_context(unit: str = "SIM-0001") -> Context:
    """Context of the simulated bench and of its unit, or of a drawn one such as "RANDOM-7"."""
    driver = SimulatedDriver("sim")
    return Context(next(one for one in driver.mounted(unit) if one.serial == unit), driver.description)


def require_form(procedure: AnyProcedure, context: Context, **parameters: object) -> None:
    """Check the rules for every procedure, see docs/add-a-procedure.md. Fails with the name of the broken rule."""
    assert inspect.isasyncgenfunction(procedure.acquire), "`acquire` must be an async generator"
    params = procedure.params.model_validate(parameters)
    resolved = procedure.resolve(params, context)
    assert procedure.resolve(resolved, context) == resolved, "`resolve` must change nothing the second time"
    again = procedure.params.model_validate_json(resolved.model_dump_json())
    assert again == resolved, "parameters must survive JSON: they are stored with the job"
    stations = procedure.schedule(resolved)
    assert [s.index for s in stations] == list(range(len(stations))), "stations must be numbered from 0, in order"
    assert procedure.schedule(resolved) == stations, "`schedule` must be pure"
    prediction = procedure.predict(resolved, context)
    recorded_s = sum(s.record_s + s.settle_s + s.power_off_s for s in stations if s.profile is None)
    assert prediction.duration_s >= recorded_s - 1e-6, "the predicted duration must hold the stations, and the moves"


def acquired(
    procedure: AnyProcedure, stations: Sequence[Station], seed: int = 1, unit: str = "SIM-0001"
) -> list[MemoryRecording]:
    """The recordings of these stations on the simulated bench, in bench time, which passes at once.

    Fails where the procedure does not give one stream for each station, in order.
    """
    return asyncio.run(_acquired(procedure, stations, seed, unit))


async def _acquired(
    procedure: AnyProcedure, stations: Sequence[Station], seed: int, unit: str
) -> list[MemoryRecording]:
    bench = SimulatedDriver("sim").open(unit, seed, None, BenchNeeds.of(stations))
    streams: AsyncIterator[Stream] = procedure.acquire(bench, stations)
    found: list[MemoryRecording] = []
    async for stream in streams:
        assert len(found) < len(stations), "`acquire` gives more streams than there are stations"
        assert stream.station == stations[len(found)], "`acquire` must give the stations' streams in order"
        raw = np.concatenate([block async for block in stream.blocks])
        found.append(recorded(stream, raw, len(found), unit))
    assert len(found) == len(stations), "`acquire` gives fewer streams than there are stations"
    await bench.make_safe()
    return found


def recorded(stream: Stream, raw: RawArray, number: int, unit: str) -> MemoryRecording:
    """A stream's samples as the recording of a station, as the service would describe it."""
    info = RecordingInfo(
        f"station {number}",
        unit,
        stream.channels,
        stream.rate_hz,
        len(raw),
        stream.start_s,
        stream.station,
        simulated=True,
        launched_s=stream.launched_s,
    )
    return MemoryRecording(info, raw)


def run(procedure: AnyProcedure, seed: int = 1, unit: str = "SIM-0001", **parameters: object) -> Any:
    """Plan, record and analyse on the simulated bench; the result, which is required to be fit for storing.

    The same seed and parameters give the numbers of a job: `bench run <name> --seed <seed>`.
    """
    context = simulated_context(unit)
    resolved = procedure.resolve(procedure.params.model_validate(parameters), context)
    result = procedure.analyse(acquired(procedure, procedure.schedule(resolved), seed, unit), resolved, context)
    require_result(procedure, result)
    return result


def require_result(entry: AnyProcedure | Method[Any, Any], result: Outcome) -> None:
    """Require that a result is finite, survives JSON, and has a report whose parts fit together."""
    assert isinstance(result, entry.result), f"the result must be a {entry.result.__name__}"
    assert entry.result.model_validate(document_of(result)) == result, "a result must survive JSON"
    require_storable(entry.calibrations(result), entry.corrections(result))
    require_report(entry.report(result))


def require_report(report: Report) -> None:
    """Rows as long as their columns, series as long on both axes, every number finite."""
    for section in report.sections:
        if isinstance(section, Table):
            assert {len(row) for row in section.rows} <= {len(section.columns)}, f"{section.title}: rows and columns"
        if isinstance(section, Figure):
            for one in section.series:
                lengths = {len(values) for values in (one.x, one.y, one.error, one.upper) if values}
                assert len(lengths) <= 1, f"{section.title}, {one.name}: x, y, error and upper must be as long"
                assert all(map(isfinite, (*one.x, *one.y, *one.error, *one.upper))), f"{section.title}, {one.name}"


def parameters_of(procedure: AnyProcedure, context: Context, **parameters: object) -> Parameters:
    """Return the parameters with every default filled."""
    return procedure.resolve(procedure.params.model_validate(parameters), context)
