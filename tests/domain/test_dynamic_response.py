"""Dynamic response: known delays and lags in closed form, misfits that are said, refusals, and a simulated bench."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from procedures.analysis.response.fit import LEVEL, fit_lags, gain_p_value
from procedures.analysis.response.phasors import Response
from procedures.analysis.response.trace import TIME_STEP_S
from procedures.bench.declared_device import DeclaredDevice
from procedures.catalog import discover
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.limits import Verdict
from procedures.core.measured import Measured, MeasuredPace
from procedures.core.recording import AXES, MemoryRecording
from procedures.core.unit import UnitDeclaration
from procedures.procedure import Context
from tests.kit.procedures import parameters_of, require_result, run, simulated_context
from tests.kit.swung_units import SwungUnit, swung

RESPONSE = discover()["dynamic_response"]
FREQUENCIES = (0.5, 1.0, 2.0, 4.0, 8.0)
FEW_SIGMAS = 4.5
"""A fixed seed passes by chance but once in 150 000 for each figure of unit spread."""


@pytest.fixture(scope="module")
def context() -> Context:
    return simulated_context()


def taken(context: Context, unit: SwungUnit, seed: int = 3, **parameters: Any) -> tuple[Any, list[MemoryRecording]]:
    """Parameters, and recordings in closed form of a unit with the noise of the simulated one."""
    given = {"frequencies_hz": FREQUENCIES, "record_s": 4.0, "linearity_ppm": 0.0, "axes": ("x",)} | parameters
    params = parameters_of(RESPONSE, context, **given)
    assert context.unit.gyro is not None
    noise = replace(context.unit.gyro.noise[0], rate_ramp=0.0)
    stations = RESPONSE.schedule(params)
    channels = [AXES.index(s.label[0]) for s in stations]
    return params, swung(replace(unit, noise=noise), stations, channels, seed)


def analysed(context: Context, unit: SwungUnit, seed: int = 3, **parameters: Any) -> Any:
    params, recordings = taken(context, unit, seed, **parameters)
    result = RESPONSE.analyse(recordings, params, context)
    require_result(RESPONSE, result)
    return result


def test_a_known_delay_and_lag_are_found(context: Context) -> None:
    result = analysed(context, SwungUnit(0.98, 1e-3, 5e-3))
    found = result.gyro.channels[0]
    assert result.verdict is Verdict.PASS
    assert result.warnings == ()
    assert abs(found.gain - 0.98) < FEW_SIGMAS * found.gain_standard_uncertainty
    assert abs(found.delay_s - 6e-3) < FEW_SIGMAS * found.delay_standard_uncertainty_s < 1e-5
    assert abs(found.time_constant_s - 5e-3) < FEW_SIGMAS * found.time_constant_standard_uncertainty_s < 1e-4
    bandwidth = 1.0 / (2.0 * np.pi * 5e-3)
    assert abs(found.bandwidth_hz - bandwidth) < FEW_SIGMAS * found.bandwidth_standard_uncertainty_hz
    assert found.extrapolated
    assert abs(found.clock_difference_ppm) < FEW_SIGMAS * found.clock_difference_standard_uncertainty_ppm


def test_a_unit_without_a_lag_has_a_limit_in_place_of_a_bandwidth(context: Context) -> None:
    result = analysed(context, SwungUnit(1.0, -2e-3))
    found = result.gyro.channels[0]
    assert (found.bandwidth_hz, found.time_constant_s) == (None, None)
    assert 100.0 < found.bandwidth_above_hz < 10_000.0
    assert abs(found.delay_s + 2e-3) < FEW_SIGMAS * found.delay_standard_uncertainty_s
    assert "not reached: above" in RESPONSE.report(result).summary


def test_limits_are_judged(context: Context) -> None:
    limits = {"delay_ms": 3.0, "bandwidth_hz": 40.0, "stamp_scatter_ms": 0.1}
    result = analysed(context, SwungUnit(1.0, 1e-3, 5e-3), limits=limits)
    params = parameters_of(RESPONSE, context, frequencies_hz=FREQUENCIES, axes=("x",), limits=limits)
    assert RESPONSE.quantities is not None
    assert tuple(c.name for c in result.checks) == RESPONSE.quantities(params, context)
    assert {c.name: c.passed for c in result.checks} == {
        "gyro x delay": False,
        "gyro x bandwidth": False,
        "gyro x residuals, p-value of chi-square": True,
        "scatter of the stamps": True,
    }


def test_stamps_that_scatter_are_said_and_widen_the_delay(context: Context) -> None:
    result = analysed(context, SwungUnit(1.0, 2e-3, stamp_sd_s=1e-3), axes=AXES, limits={"stamp_scatter_ms": 0.1})
    # The mean square of 15 recordings less 3 means: s²·χ²(12)/12, within 0.35 … 2.0 of s but once in 10⁴.
    assert 0.35e-3 < result.gyro.stamp_scatter_s < 2.0e-3
    assert "the delay differs from recording to recording" in " ".join(result.warnings)
    for found in result.gyro.channels:
        assert abs(found.delay_s - 2e-3) < 6.0 * found.delay_standard_uncertainty_s  # Student's t of 12
        assert found.delay_degrees_of_freedom == 12
    assert result.verdict is Verdict.FAIL


def answers(gains: Any, phases: Any, frequencies: Any = FREQUENCIES, sd: float = 1e-4) -> list[Response]:
    """Responses with given ln gains and phases [rad], known to `sd` each."""
    values = np.exp(np.asarray(gains) + 1j * np.asarray(phases))
    return [
        Response(f"x {f:g} Hz", f, 0.01, complex(v), sd, sd, 1.0, 0.0, 0.0, 0.0, 0.0)
        for f, v in zip(frequencies, values, strict=True)
    ]


def test_gains_that_misfit_make_no_scatter_of_the_stamps() -> None:
    """Phases of pure noise show a scatter once in 1000 trials: three of 40 come by chance but once in 10⁵."""
    rng, sd = np.random.default_rng(8), 1e-4
    found = [
        fit_lags({"gyro_x": answers(1e-3 * rng.standard_normal(5), sd * rng.standard_normal(5), sd=sd)}, 0.0)
        for _ in range(40)
    ]
    assert sum(lags.scatter_s > 0.0 for lags in found) < 3
    p_values = [p for lags in found if (p := gain_p_value(lags.lags[0])) is not None]
    assert len(p_values) == 40
    assert np.median(p_values) < LEVEL


def test_phases_that_misfit_are_found_beside_good_gains() -> None:
    """At a scatter of 1 ms phases misfit by up to 0.05 rad, 500 times their noise; gains are the model's."""
    rng = np.random.default_rng(9)
    omega = 2.0 * np.pi * np.array(FREQUENCIES)
    lags = fit_lags({"gyro_x": answers(np.zeros(5), omega * 1e-3 * rng.standard_normal(5))}, 0.0)
    # s²·χ²(4)/4 lies within 0.15 … 2.5 of s but once in 10⁴.
    assert 0.15e-3 < lags.scatter_s < 2.5e-3
    assert lags.p_value_without is not None
    assert lags.p_value_without < LEVEL


def test_stamps_that_scatter_by_seconds_are_refused_with_the_channel() -> None:
    slow = (0.01, 0.013, 0.017, 0.02, 0.025)
    late = 2.0 * np.pi * np.array(slow) * np.array([6.0, -6.0, 6.0, -6.0, 6.0])
    with pytest.raises(UnfitRecording, match=r"gyro_y: the delay differs .* by more than 1 s"):
        fit_lags({"gyro_x": answers(np.zeros(5), np.zeros(5), slow), "gyro_y": answers(np.zeros(5), late, slow)}, 0.0)


def test_another_clock_is_said(context: Context) -> None:
    result = analysed(context, SwungUnit(clock_ppm=80.0))
    found = result.gyro.channels[0]
    off = found.clock_difference_ppm - 80.0
    assert abs(off) < FEW_SIGMAS * found.clock_difference_standard_uncertainty_ppm
    assert "the unit's clock differs from the bench's" in " ".join(result.warnings)


def _parted(recording: MemoryRecording, samples: int, at: float) -> MemoryRecording:
    """The recording without some samples at a share of its length: those after them come too early for the encoder."""
    raw = recording.raw.astype(np.float64)
    first, count = round(at * len(raw)), len(raw) - samples
    raw[first:count, :3] = raw[first + samples :, :3]
    return MemoryRecording(replace(recording.info, count=count), raw[:count])


@pytest.mark.parametrize("at", [0.2, 0.5, 0.8])
def test_clocks_that_part_within_a_recording_give_no_delay(context: Context, at: float) -> None:
    """Four samples of 2.5 ms: a thousand times what the delay would be claimed with."""
    params, recordings = taken(context, SwungUnit(1.0, 2e-3))
    spoilt = [_parted(r, 4, at) for r in recordings]
    with pytest.raises(
        UnfitRecording, match=r"(changes|part) by .* within the recording: samples were lost, .* fell behind"
    ):
        RESPONSE.analyse(spoilt, params, context)


@pytest.mark.parametrize("ppm", [3_000.0, 30_000.0, -5_000.0])
def test_a_world_that_falls_behind_all_the_time_gives_no_delay(context: Context, ppm: float) -> None:
    params, recordings = taken(context, SwungUnit(1.0, 2e-3, clock_ppm=ppm))
    with pytest.raises(UnfitRecording, match=r"the unit's samples and the bench's clock part by -?\d"):
        RESPONSE.analyse(recordings, params, context)


def test_a_pace_that_was_measured_otherwise_is_refused_before_anything_is_fitted(context: Context) -> None:
    params, recordings = taken(context, SwungUnit(1.0, 2e-3))
    for behind_s, scatter_s, words in ((0.5, 0.01, "fell behind"), (-0.5, 0.01, "were ahead of"), (0.5, 0.3, "")):
        pace = Measured(pace=MeasuredPace(behind_s, scatter_s))
        made = [MemoryRecording(replace(r.info, measured=pace), r.raw) for r in recordings]
        if not words:
            assert RESPONSE.analyse(made, params, context).verdict is Verdict.PASS
            continue
        with pytest.raises(UnfitRecording, match=f"the unit's samples {words} the bench's clock by 0.5 s within"):
            RESPONSE.analyse(made, params, context)


def test_a_clock_within_a_quartz_counts_in_the_delays_uncertainty(context: Context) -> None:
    params, recordings = taken(context, SwungUnit(1.0, 2e-3, clock_ppm=200.0))
    found = RESPONSE.analyse(recordings, params, context).gyro.channels[0]
    mean_s = np.mean([r.info.count / r.info.rate_hz for r in recordings])
    assert found.delay_from_clock_s == pytest.approx(200e-6 * mean_s / np.sqrt(12.0), rel=0.05)
    # The delay of a recording's middle is off by 200 ppm of half its length, 0.4 to 2 ms: it is claimed no better.
    assert abs(found.delay_s - 2e-3) < 3.0 * found.delay_standard_uncertainty_s


def test_more_noise_than_the_record_has_is_said(context: Context) -> None:
    params, recordings = taken(context, SwungUnit())
    assert context.unit.gyro is not None
    few = tuple(replace(n, random_walk=n.random_walk / 10, quantization=0.0) for n in context.unit.gyro.noise)
    quieter = replace(context, unit=replace(context.unit, gyro=replace(context.unit.gyro, noise=few)))
    result = RESPONSE.analyse(recordings, params, quieter)
    assert "times the power that the unit's record" in " ".join(result.warnings)
    usual = RESPONSE.analyse(recordings, params, context).gyro.channels[0]
    noisy = result.gyro.channels[0]
    assert noisy.delay_standard_uncertainty_s > 0.4 * usual.delay_standard_uncertainty_s


def test_two_lags_in_a_row_are_no_single_one(context: Context) -> None:
    """The gains of two equal lags T fall as 1/(1 + ω²T²): at 8 Hz and 20 ms no single lag's do, by parts of a tenth."""
    params, recordings = taken(context, SwungUnit(time_constant_s=20e-3))
    twice: list[MemoryRecording] = []
    for r in recordings:
        assert r.info.station is not None
        assert r.info.station.sinusoid is not None
        omega = 2.0 * np.pi * r.info.station.sinusoid.frequency_hz
        raw = r.raw.astype(np.float64)
        raw[:, 0] /= np.sqrt(1.0 + (omega * 20e-3) ** 2)  # the gain of the second; its phase acts as a delay nearly
        twice.append(MemoryRecording(r.info, raw))
    result = RESPONSE.analyse(twice, params, context)
    assert result.verdict is Verdict.FAIL
    assert "the gains are not those of one lag" in " ".join(result.warnings)


def test_a_delay_that_is_not_the_data_sheets_is_said(context: Context) -> None:
    declared = replace(context, unit=replace(context.unit, declaration=UnitDeclaration(lags_s={"gyro_x": 4e-3})))
    params, recordings = taken(context, SwungUnit(1.0, 2e-3))
    result = RESPONSE.analyse(recordings, params, declared)
    assert "is not the data sheet's 4 ms" in " ".join(result.warnings)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda raw: raw * np.array([-1.0, 1, 1, 1, 1, 1, 1, 1]), "opposite sign"),
        (lambda raw: raw * np.array([0.0, 1, 1, 1, 1, 1, 1, 1]), "the channel is dead"),
        (lambda raw: raw * np.array([1.0, 1, 1, 0, 0, 0, 1, 1]), "the encoder shows no sinusoid"),
        (lambda raw: np.where(np.arange(8) == 6, -1.0, raw), "0 readings of the encoder"),
    ],
)
def test_recordings_that_show_no_response_are_refused(context: Context, change: Any, words: str) -> None:
    params, recordings = taken(context, SwungUnit())
    spoilt = [MemoryRecording(r.info, change(r.raw.astype(np.float64))) for r in recordings]
    with pytest.raises(UnfitRecording, match=words):
        RESPONSE.analyse(spoilt, params, context)


def test_recordings_of_another_kind_are_refused(context: Context) -> None:
    params, recordings = taken(context, SwungUnit())
    info = recordings[0].info
    station = info.station
    assert station is not None
    assert station.sinusoid is not None
    counted = replace(info.channels[0], unit="count", scale=1.0)
    slow = replace(station, sinusoid=replace(station.sinusoid, frequency_hz=1e-5))
    for other, words in (
        (replace(info, channels=(counted, *info.channels[1:])), "gyro_x is in count: a response needs a nominal scale"),
        (replace(info, station=replace(station, sinusoid=None)), "its station has no sinusoid of the outer axis"),
        (replace(info, station=slow), "cannot tell a sinusoid of 1e-05 Hz from a drift"),
    ):
        with pytest.raises(UnfitRecording, match=words):
            RESPONSE.analyse([MemoryRecording(other, recordings[0].raw), *recordings[1:]], params, context)


def test_three_recordings_at_two_frequencies_are_refused(context: Context) -> None:
    params, recordings = taken(context, SwungUnit())
    with pytest.raises(UnfitRecording, match="gyro_x: a delay and a lag need 3 frequencies, there are 2"):
        RESPONSE.analyse([*recordings[:2], recordings[1]], params, context)


@pytest.mark.parametrize(
    ("parameters", "field", "words"),
    [
        ({"frequencies_hz": (1.0, 2.0, 300.0)}, "frequencies_hz", "of the unit's sample rate of 400 Hz"),
        ({"frequencies_hz": (2.0, 1.0, 3.0)}, "frequencies_hz", "rising, each once"),
        ({"amplitudes_deg": (1.0,)}, "amplitudes_deg", "one amplitude for each of the 6 frequencies"),
        ({"amplitudes_deg": (5.0,) * 6}, "amplitudes_deg", "acceleration of .* is above"),
        ({"axes": ("x", "x")}, "axes", "each axis once"),
    ],
)
def test_what_cannot_be_swung_or_seen_is_refused_beforehand(
    context: Context, parameters: Any, field: str, words: str
) -> None:
    with pytest.raises(BadParameter, match=words) as refused:
        RESPONSE.predict(RESPONSE.params.model_validate(parameters), context)
    assert refused.value.field == field


def test_the_preview_has_the_interval_of_each_reading_as_the_result_has(context: Context) -> None:
    """Half an interval of 5 ms, a rectangle's 5/√3 ms of delay: a thousand times the share of noise."""
    params, recordings = taken(context, SwungUnit(), encoder_within_s=5e-3)
    within = np.where(np.arange(8) == 7, 5e-3 / TIME_STEP_S, 0.0)
    read = [MemoryRecording(r.info, r.raw.astype(np.float64) + within) for r in recordings]
    found = RESPONSE.analyse(read, params, context).gyro.channels[0].delay_standard_uncertainty_s
    promised = {u.name: u.standard_uncertainty for u in RESPONSE.predict(params, context).uncertainties}
    assert promised["gyro.delay_x"] == pytest.approx(found, rel=1e-3)
    assert found == pytest.approx(5e-3 / np.sqrt(3.0), rel=1e-3)


def test_the_interval_of_a_reading_is_that_of_its_rate_over_a_line_alone(context: Context) -> None:
    table = DeclaredDevice("turntable", False, "acutrol", "tcp://127.0.0.1:5025")
    wired = replace(context, bench=replace(context.bench, devices=(table,)))
    params = RESPONSE.params(encoder_rate_hz=80.0)
    assert RESPONSE.resolve(params, wired).encoder_within_s == pytest.approx(6.25e-3)
    assert RESPONSE.resolve(params, context).encoder_within_s == 0.0
    predicted = RESPONSE.predict(params, wired)
    assert min(u.standard_uncertainty for u in predicted.uncertainties if "delay" in u.name) > 6.2e-3 / np.sqrt(3.0)
    assert "each reading taken within ±6.25 ms" in predicted.basis


def test_a_table_that_follows_no_sinusoid_is_said(context: Context) -> None:
    still = replace(context, bench=replace(context.bench, sinusoidal=False))
    with pytest.raises(BadParameter, match="does not follow sinusoids"):
        RESPONSE.predict(RESPONSE.params(), still)


def test_on_the_simulated_bench_the_stamps_are_right_and_the_preview_holds(context: Context) -> None:
    """With x upwards the inner axis is parallel to the outer one, which shakes it: both encoders count."""
    given: dict[str, Any] = {"frequencies_hz": (1.0, 3.0, 6.0), "record_s": 2.0, "axes": ("x",), "slack_s": 0.5}
    result = run(RESPONSE, seed=4, **given)
    found = result.gyro.channels[0]
    assert abs(found.delay_s) < FEW_SIGMAS * found.delay_standard_uncertainty_s < 1e-5
    assert found.bandwidth_hz is None
    assert result.verdict is Verdict.PASS, result.checks
    promised = {
        u.name: u.standard_uncertainty for u in RESPONSE.predict(RESPONSE.params(**given), context).uncertainties
    }
    # The preview's encoder reads 0.1″ fifty times a second, the simulated one without noise at each sample.
    assert 0.5 < found.delay_standard_uncertainty_s / promised["gyro.delay_x"] < 1.2
