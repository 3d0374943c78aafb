"""A stop rule of dwells: when it ends them, what guards it, that it does not bias, and refusals."""

import asyncio
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from procedures import catalog
from procedures.analysis.calibration.reference_temperature import LEAST_DWELL_S
from procedures.analysis.recursive_bias.dwell import LiveDwell, expected_s, mean_sd
from procedures.catalog import calibration_12_orientations as calibration
from procedures.catalog import verification_9_orientations as verification
from procedures.catalog.calibration_12_orientations import Params
from procedures.core.errors import BadParameter, MissingChannel
from procedures.core.imu_model import triad_calibration
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import Channel, MemoryRecording, Quantity, RecordingInfo, Station
from procedures.core.stop_rule import ChannelTarget, StopRule
from procedures.procedure import Context
from simulators.truth import declared_unit, default_bench, default_unit
from simulators.world import WorldConfig, build
from tests.correction_samples import thermal

RATE_HZ = 20.0
NOISE = NoiseCoefficients(quantization=2e-6, random_walk=4e-7)
CHANNEL = Channel("gyro_x", Quantity.ANGULAR_RATE, "rad/s")
CONTEXT = Context(declared_unit(default_unit(), sample_rate_hz=RATE_HZ), default_bench().description)


def samples(rng: np.random.Generator, seconds: float, scale: float = 1.0) -> np.ndarray:
    """A rate of 1e-5 rad/s with noise of the declared coefficients, so many times larger, (n, 1)."""
    n = round(seconds * RATE_HZ)
    readings = NOISE.quantization * np.diff(rng.standard_normal(n + 1)) * RATE_HZ
    walk = NOISE.random_walk * np.sqrt(RATE_HZ) * rng.standard_normal(n)
    return (1e-5 + scale * (readings + walk))[:, None]


def rule(target_s: float) -> StopRule:
    """Target that the declared noise reaches after so long."""
    return StopRule((ChannelTarget("gyro_x", mean_sd(NOISE, target_s) * 1.0001, NOISE),))


def dwelt(given: StopRule, record: np.ndarray, block_s: float = 0.7) -> int:
    """Samples that the rule takes of a record, fed in blocks."""
    live, size, taken = LiveDwell(given, (CHANNEL,), RATE_HZ, len(record) / RATE_HZ), round(block_s * RATE_HZ), 0
    for at in range(0, len(record), size):
        last = live.add(record[at : at + size])
        if last is not None:
            return taken + last
        taken += len(record[at : at + size])
    return taken


def test_a_dwell_ends_when_the_declared_noise_has_reached_the_target():
    rng = np.random.Generator(np.random.PCG64(1))
    record = samples(rng, 200.0)
    assert expected_s(rule(60.0), 200.0) == 60.0
    for block_s in (0.05, 0.7, 33.0):
        assert dwelt(rule(60.0), record, block_s) == 60.0 * RATE_HZ
    out_of_reach = StopRule((ChannelTarget("gyro_x", 1e-12, NOISE),))
    assert dwelt(out_of_reach, record) == len(record)
    assert expected_s(out_of_reach, 200.0) == 200.0


def test_noise_that_is_not_the_declared_one_goes_on_to_the_longest_time():
    """None of 40 dwells three times as noisy stops; of 40 sound ones all but a few in a thousand do."""
    rng = np.random.Generator(np.random.PCG64(2))
    noisy = [dwelt(rule(60.0), samples(rng, 120.0, 3.0)) for _ in range(40)]
    sound = [dwelt(rule(60.0), samples(rng, 120.0)) for _ in range(40)]
    assert set(noisy) == {round(120.0 * RATE_HZ)}
    assert sum(n == 60.0 * RATE_HZ for n in sound) >= 38  # twelve looks at a level of 1e-3, correlated


def test_an_optional_stop_does_not_bias_the_mean():
    """Mean of 400 stopped dwells over its standard error, and their spread over the claim: 4 sigma, and 4·1/√800."""
    rng, errors = np.random.Generator(np.random.PCG64(3)), []
    for _ in range(400):
        record = samples(rng, 90.0)
        errors.append(record[: dwelt(rule(40.0), record)].mean() - 1e-5)
    errors = np.array(errors) / mean_sd(NOISE, 40.0)
    assert abs(errors.mean()) * np.sqrt(len(errors)) < 4.0
    assert abs(errors.std() - 1.0) < 4.0 / np.sqrt(2.0 * len(errors))


def recorded(procedure: Any, stations: Sequence[Station]) -> list[MemoryRecording]:
    """Recordings of the simulated bench, each as long as its dwell was."""

    async def run() -> list[MemoryRecording]:
        bench, found = build(WorldConfig(default_unit(), default_bench(), 5, RATE_HZ)), []
        async for stream in procedure.acquire(bench, stations):
            raw = np.concatenate([block async for block in stream.blocks])
            info = RecordingInfo(f"r{len(found)}", "u", stream.channels, stream.rate_hz, len(raw), stream.start_s)
            found.append(MemoryRecording(replace(info, station=stream.station, launched_s=0.0), raw))
        await bench.make_safe()
        return found

    return asyncio.run(run())


@pytest.mark.parametrize("name", ["verification_9_orientations", "multi_position_calibration"])
def test_the_same_rule_ends_the_dwells_of_every_procedure_that_takes_means(name: str):
    """One rule, one plan: what is predicted and claimed is that of a fixed dwell as long as the rule makes it."""
    procedure = catalog.discover()[name]
    truth = default_unit()
    known = tuple(
        triad_calibration(t, u, u, np.column_stack([truth.triad(t).bias, truth.triad(t).matrix]), 1e-16 * np.eye(12))
        for t, u in (("gyro", "rad/s"), ("accelerometer", "m/s^2"))
    )
    context = replace(CONTEXT, unit=replace(CONTEXT.unit, calibrations=known))
    given = {"dwell_s": 100.0, "stop_at": {"gyro_deg_h": 0.03}}
    params = procedure.resolve(procedure.params.model_validate(given), context)
    expected = expected_s(params.stop_at.rule, 100.0)
    stations = procedure.schedule(params)
    assert {s.until for s in stations} == {params.stop_at.rule}
    result = procedure.analyse(recorded(procedure, stations), params, context)
    assert {d.duration_s for d in result.dwells.dwells} == {expected}
    assert all(d.by_rule for d in result.dwells.dwells)
    assert any(s.title == "Dwells" for s in procedure.report(result).sections)
    fixed = procedure.resolve(procedure.params.model_validate({"dwell_s": expected}), context)
    planned, whole = procedure.predict(params, context), procedure.predict(fixed, context)
    assert planned.duration_s == pytest.approx(whole.duration_s)
    assert planned.uncertainties == whole.uncertainties
    assert planned.duration_s < 0.8 * procedure.predict(params.model_copy(update={"stop_at": None}), context).duration_s
    hard = procedure.params.model_validate({"dwell_s": 60.0, "stop_at": {"gyro_deg_h": 1e-6}})
    assert any("no dwell will end before" in w for w in procedure.predict(hard, context).warnings)


def test_a_calibration_ends_its_dwells_and_tells_what_it_saved():
    params = calibration.resolve(
        Params.model_validate({"dwell_s": 200.0, "stop_at": {"gyro_deg_h": 0.03}, "scalar_check": False}), CONTEXT
    )
    assert params.stop_at is not None
    assert params.stop_at.rule is not None
    expected = expected_s(params.stop_at.rule, 200.0)
    assert 5.0 <= expected < 150.0
    stations = calibration.schedule(params)
    assert {s.record_s for s in stations} == {200.0}

    result = calibration.analyse(recorded(calibration, stations), params, CONTEXT)
    saved = result.dwells
    assert saved is not None
    assert [d.duration_s for d in saved.dwells] == [expected] * 12
    assert all(d.by_rule for d in saved.dwells)
    assert saved.saved_s == pytest.approx(12 * (200.0 - expected))
    assert any(s.title == "Dwells" for s in calibration.report(result).sections)
    planned = calibration.predict(params, CONTEXT)
    whole = calibration.predict(params.model_copy(update={"stop_at": None}), CONTEXT)
    assert planned.duration_s == pytest.approx(whole.duration_s - saved.saved_s)
    # The prediction is that of the dwells as they will be.
    claimed = np.sqrt(np.diag(np.array(result.triads[0].calibration.covariance)))[0]
    predicted = next(u for u in planned.uncertainties if u.name == "gyro.b_x")
    assert claimed == pytest.approx(predicted.standard_uncertainty, rel=0.2)


def test_no_dwell_ends_before_what_is_read_with_it_needs():
    """A target that a second reaches, looked at every 0.12 s, which whole samples at 20 Hz make 0.1 s."""
    record = samples(np.random.Generator(np.random.PCG64(3)), 30.0)
    quick = replace(rule(1.0), check_s=0.12)
    assert expected_s(quick, 30.0) < 2.0
    assert dwelt(quick, record) < 2.0 * RATE_HZ
    held = replace(quick, least_s=10.0)
    assert 10.0 <= expected_s(held, 30.0) < 10.2
    assert dwelt(held, record) == 10.0 * RATE_HZ
    with pytest.raises(BadParameter, match="least_s"):
        replace(quick, least_s=-1.0)


@pytest.mark.parametrize("procedure", [calibration, verification], ids=lambda p: p.PROCEDURE.name)
def test_dwells_with_temperatures_are_at_least_as_long_as_their_line(procedure):
    """Accelerometers alone reach such a target within a second, and their temperatures were refused after the job."""
    warm = replace(CONTEXT, unit=replace(CONTEXT.unit, thermal_correction=thermal(1).thermal))
    asked = {"dwell_s": 60.0, "stop_at": {"accelerometer_m_s2": 0.1, "check_s": 0.5}}
    plain = procedure.resolve(procedure.Params.model_validate(asked), warm)
    assert expected_s(plain.stop_at.rule, 60.0) == 0.5
    params = procedure.resolve(procedure.Params.model_validate({**asked, "thermal_correction": "current"}), warm)
    assert {s.until.least_s for s in procedure.schedule(params)} == {LEAST_DWELL_S}
    assert expected_s(params.stop_at.rule, 60.0) == LEAST_DWELL_S
    again = {**asked["stop_at"], "rule": plain.stop_at.rule}
    given = procedure.Params.model_validate({**asked, "stop_at": again, "thermal_correction": "current"})
    assert expected_s(procedure.resolve(given, warm).stop_at.rule, 60.0) == LEAST_DWELL_S


def test_without_a_rule_nothing_changes():
    full = calibration.resolve(Params(), CONTEXT)
    assert all(s.until is None for s in calibration.schedule(full))


def test_bad_targets_are_named_with_a_way_out():
    with pytest.raises(ValidationError, match="without a target nothing ends a dwell"):
        Params.model_validate({"stop_at": {}})
    unknown = replace(CONTEXT, unit=replace(CONTEXT.unit, gyro=None))
    with pytest.raises(BadParameter, match="a static_run finds it") as refused:
        calibration.resolve(Params.model_validate({"stop_at": {"gyro_deg_h": 0.01}}), unknown)
    assert refused.value.field == "stop_at.gyro_deg_h"
    hard = Params.model_validate({"dwell_s": 60.0, "stop_at": {"gyro_deg_h": 1e-6}})
    assert any("no dwell will end before" in w for w in calibration.predict(hard, CONTEXT).warnings)
    with pytest.raises(MissingChannel, match="gyro_x"):
        LiveDwell(rule(60.0), (replace(CHANNEL, name="gyro_y"),), RATE_HZ, 100.0)
    with pytest.raises(BadParameter, match="check_s"):
        StopRule((ChannelTarget("gyro_x", 1e-6, NOISE),), check_s=0.0)
