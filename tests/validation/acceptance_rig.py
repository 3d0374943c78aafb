"""The campaign `acceptance` step by step on a simulated bench, without the service: gates, judgement and transitions
are the product's own. Faults are in the truth of the unit or of the table, or in the samples.
"""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any

import numpy as np

from bench_service.campaigns import gates, transitions
from bench_service.campaigns.campaign import Campaign
from bench_service.campaigns.judgement import Judgement
from bench_service.campaigns.run import CampaignRun, StepRun, StepState
from bench_service.campaigns.shipped import shipped
from bench_service.drivers.simulated import SimulatedDriver
from bench_service.model.job import JobState
from procedures import catalog, methods
from procedures.bench import BenchNeeds
from procedures.core.errors import DomainError
from procedures.core.imu_model import TriadCalibration
from procedures.core.limits import Verdict
from procedures.core.recording import MemoryRecording
from procedures.core.unit import Unit
from procedures.inspection import analyse_method, analyse_procedure
from procedures.procedure import Context, DatedCalibration, Evidence, Outcome
from simulators.truth import Array, BenchTruth, UnitTruth, default_bench, default_unit
from simulators.world import WorldConfig, build
from tests.kit.procedures import recorded
from tests.validation import light_bench

AT = datetime(2026, 1, 1, tzinfo=UTC)
SCALED: dict[str, dict[str, Any]] = {
    "static": {"sample_rate_hz": 5.0},
    "converter": {"temperatures_c": [-40.0, -20.0, 0.0, 20.0, 40.0, 60.0], "record_s": 20.0},
    "thermal": {"sample_rate_hz": 1.0},
}
"""Launches and thermal legs as long as they ship, at 5 and 1 Hz, and six soaks of the converter: what limits the
campaign are processes that only hours show."""
USED = {"thermal": "thermal_correction", "converter": "converter"}
"""Corrections that later steps of the campaign use: kind -> field of the unit."""
RATE_HZ = 100.0
"""Sample rate of the light bench's unit; it ships with 400 Hz."""
Truth = Callable[[str, UnitTruth, BenchTruth], tuple[UnitTruth, BenchTruth]]
Samples = Callable[[str, tuple[str, ...], Array], Array]


@dataclass(frozen=True)
class Fault:
    """A fault: its effect on the truth of a step, or on a step's samples (n, channels) by channel names."""

    name: str
    names: tuple[str, ...] = ()
    """Words of which one must be in what the run says, for the fault to be named; empty for no fault."""
    truth: Truth = lambda _step, unit, bench: (unit, bench)
    samples: Samples = lambda _step, _channels, raw: raw
    size: str = ""
    late: bool = False
    """True if it begins with the third launch: the run is sound until then."""
    resolved: bool = True
    """False if the plan cannot find it at any size that the table allows; `size` then says why."""


def scaled() -> Campaign:
    """The shipped campaign with scaled launches and thermal legs."""
    campaign = shipped()["acceptance"]
    steps = [s.model_copy(update={"parameters": {**s.parameters, **SCALED.get(s.name, {})}}) for s in campaign.steps]
    return campaign.model_copy(update={"steps": tuple(steps)})


@dataclass(frozen=True)
class Course:
    """A run on its way: its record, the unit as the steps so far left it, and the calibrations that they made."""

    run: CampaignRun
    unit: Unit
    made: dict[str, tuple[TriadCalibration, ...]]


def begun(campaign: Campaign, unit: Unit) -> Course:
    """A run before its first step."""
    steps = tuple(StepRun(s.name, s.does) for s in campaign.steps)
    return Course(
        CampaignRun("run", campaign, unit.serial, "sim", JobState.RUNNING, AT, steps, simulated=True, seed=0), unit, {}
    )


def course(
    campaign: Campaign,
    seed: int,
    fault: Fault,
    before: Course | None = None,
    until: str = "",
    inspected: bool = True,
) -> Course:
    """Steps up to the one named `until`, or to the verdict; the seed of a step is the run's and the step's number.

    `inspected`: recordings go through the inspection, which is most of an analysis and has a validation of its own.
    """
    driver = SimulatedDriver("sim")
    now = begun(campaign, mounted(driver)) if before is None else before
    while (index := now.run.current) is not None:
        step = campaign.steps[index]
        if step.name == until:
            return now
        if why := gates.closed(now.run, index):
            now = replace(now, run=transitions.left_out(now.run, index, why, AT))
            continue
        try:
            now = _stepped(now, index, seed, fault, driver, inspected)
        except DomainError as error:
            why = f"{type(error).__name__}: {error}"
            now = replace(now, run=transitions.failed(now.run, index, StepState.FAILED, why, AT, final=True))
    return now if now.run.verdict is not None else replace(now, run=transitions.ended(now.run, AT))


def mounted(driver: SimulatedDriver) -> Unit:
    """The default unit, at the rate that its truth has here."""
    return replace(driver.mounted()[0], sample_rate_hz=truth_of_unit().sample_rate_hz)


def truth_of_unit() -> UnitTruth:
    """The default unit's truth, at the rate of the light bench where that is in use."""
    return replace(default_unit(), sample_rate_hz=RATE_HZ) if light_bench.in_use() else default_unit()


def _stepped(now: Course, index: int, seed: int, fault: Fault, driver: SimulatedDriver, inspected: bool) -> Course:
    step, unit, made = now.run.campaign.steps[index], now.unit, now.made
    if step.method is not None:
        of = [c for name in step.calibrations_of for c in made[name]]
        outcome = _compared(step.does, step.parameters, of, unit)
    else:
        context = Context(unit, driver.description)
        outcome, unit, found = _measured(step.name, step.does, step.parameters, seed + index, fault, context, inspected)
        made = {**made, step.name: tuple(found)}
    judgement = Judgement(outcome.verdict, outcome.checks, outcome.warnings)
    return Course(transitions.judged(now.run, index, judgement, step.name, AT), unit, made)


def _compared(name: str, parameters: dict[str, Any], calibrations: list[TriadCalibration], unit: Unit) -> Outcome:
    method = methods.discover()[name]
    dated = tuple(DatedCalibration(str(k), "", (c,)) for k, c in enumerate(calibrations))
    return analyse_method(method, Evidence(calibrations=dated), method.params.model_validate(parameters), unit)


def _measured(
    step: str, name: str, parameters: dict[str, Any], seed: int, fault: Fault, context: Context, inspected: bool
) -> tuple[Outcome, Unit, list[TriadCalibration]]:
    """A procedure's outcome, and the unit as its result leaves it where it passes."""
    procedure = catalog.discover()[name]
    params = procedure.resolve(procedure.params.model_validate(parameters), context)
    recordings = asyncio.run(_recorded(procedure, procedure.schedule(params), step, seed, fault))
    judge = analyse_procedure if inspected else _uninspected
    outcome = judge(procedure, recordings, params, context)
    unit, calibrations = context.unit, list(procedure.calibrations(outcome))
    if outcome.verdict is Verdict.PASS:
        known = {c.triad: c for c in (*unit.calibrations, *calibrations)}
        unit = replace(unit, calibrations=tuple(known.values()))
        for correction in procedure.corrections(outcome):
            if correction.kind in USED:
                unit = replace(unit, **{USED[correction.kind]: correction.value})
    return outcome, procedure.learns(outcome, unit, step), calibrations


def _uninspected(procedure: Any, recordings: list[MemoryRecording], params: Any, context: Context) -> Outcome:
    return procedure.analyse(recordings, params, context)


async def _recorded(procedure: Any, stations: Any, step: str, seed: int, fault: Fault) -> list[MemoryRecording]:
    needs = BenchNeeds.of(stations)
    unit, bench = fault.truth(step, truth_of_unit(), default_bench())
    world = WorldConfig(unit, bench, seed, needs.sample_rate_hz, thermal=needs.temperatures, currents=needs.currents)
    devices = build(world)
    found: list[MemoryRecording] = []
    async for stream in procedure.acquire(devices, stations):
        raw = np.concatenate([block async for block in stream.blocks])
        raw = fault.samples(step, tuple(c.name for c in stream.channels), raw)
        found.append(recorded(stream, raw, len(found), unit.serial))
    await devices.make_safe()
    return found


def told(run: CampaignRun) -> list[str]:
    """All failed checks, and reasons of steps in error, of a run."""
    failed = [f"{s.name}: {c.name} {c.note}" for s in run.steps for c in s.checks if not c.passed]
    return failed + [f"{s.name}: {s.reason}" for s in run.steps if s.verdict is Verdict.ERROR]
