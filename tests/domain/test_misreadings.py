"""Readings of a thermometer that are no temperatures: found, named and not used; temperatures that jump are kept."""

import numpy as np
import pytest

from procedures.analysis.fitness.findings import Finding, Kind, Severity
from procedures.analysis.fitness.stream import inspect
from procedures.core.errors import UnfitRecording
from procedures.core.recording import Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.inspection import analyse_method
from procedures.methods import noise_analysis, temperature_dependence
from procedures.procedure import Evidence

SLOPE = 2.4e-5
"""Gyro x by its temperature [rad/s a kelvin]."""
SECONDS, NOISE = 7200, 3e-5
TEMPERATURE = 20.0 + 40.0 * (1.0 - np.abs(np.linspace(-1.0, 1.0, SECONDS)))
EVERY_100_S = np.arange(0, SECONDS, 100)


def recording(seen: np.ndarray, seed: int = 1, rate_hz: float = 1.0, name: str = "temperature_x") -> MemoryRecording:
    channels = (
        Channel("gyro_x", Quantity.ANGULAR_RATE, "rad/s"),
        Channel(name, Quantity.TEMPERATURE, "degC"),
    )
    true = np.interp(np.linspace(0.0, 1.0, len(seen)), np.linspace(0.0, 1.0, SECONDS), TEMPERATURE)
    rate = SLOPE * (true - 20.0) + NOISE * np.random.default_rng(seed).standard_normal(len(seen))
    return MemoryRecording(RecordingInfo("r", "U", channels, rate_hz, len(seen)), np.column_stack([rate, seen]))


def with_code(code: float, at: np.ndarray, temperature: np.ndarray = TEMPERATURE) -> np.ndarray:
    seen = temperature.copy()
    seen[at] = code
    return seen


def misread(seen: np.ndarray, rate_hz: float = 1.0) -> list[Finding]:
    return [f for f in inspect(recording(seen, rate_hz=rate_hz))[1].findings if f.kind is Kind.MISREAD]


@pytest.mark.parametrize("code", [-127.0, 85.0, -273.15, 327.67])
def test_an_error_code_of_the_sensor_does_not_move_the_dependence(code: float) -> None:
    """Seen: 5.04 ± 0.014 for 5 and "independent of temperature, p = 1", for −127 °C every 100 s."""
    evidence = Evidence((recording(with_code(code, EVERY_100_S)),))
    params = temperature_dependence.Params.model_validate({"soaks": False})
    result = analyse_method(temperature_dependence.METHOD, evidence, params, None)
    (channel,) = result.channels
    sd = channel.covariance[0][0] ** 0.5
    assert abs(channel.coefficients[0] - SLOPE) < 4.4 * sd  # 1e-5
    assert channel.p_value < 1e-6
    assert result.range_c[0] > 19.9
    assert result.range_c[1] < 60.1
    assert any(f"72 of 7200 samples (1 %) are no temperature, {code:g} °C (72 times)" in w for w in result.warnings)


def test_the_noise_analysis_does_not_use_them_either() -> None:
    seen = with_code(-127.0, np.arange(0, SECONDS // 4, 100), TEMPERATURE[::4])
    evidence = Evidence((recording(seen),))
    params = noise_analysis.Params.model_validate({})
    (channel,) = analyse_method(noise_analysis.METHOD, evidence, params, None).launches[0].channels
    assert channel.temperature is not None
    assert abs(channel.temperature.slope - SLOPE) < 4.4 * channel.temperature.standard_uncertainty
    assert abs(channel.temperatures[0].r) > 0.99


def test_a_run_of_codes_and_one_at_either_end_are_found_whatever_the_blocks_are() -> None:
    at = np.concatenate([np.arange(3), np.arange(400, 430), [SECONDS - 1]])
    (finding,) = misread(with_code(85.0, at))
    assert (finding.severity, finding.first_index, finding.count) == (Severity.WARN, 0, 34)


def test_a_sensor_that_hardly_reads_is_refused_where_its_temperature_is_needed() -> None:
    at = np.flatnonzero(np.arange(SECONDS) % 10 < 3)
    evidence = Evidence((recording(with_code(-127.0, at)),))
    with pytest.raises(UnfitRecording, match="correct the column, or analyse without this channel"):
        analyse_method(
            temperature_dependence.METHOD,
            evidence,
            temperature_dependence.Params.model_validate({"soaks": False}),
            None,
        )
    short = Evidence((recording(with_code(-127.0, at)[: SECONDS // 4]),))
    result = analyse_method(noise_analysis.METHOD, short, noise_analysis.Params.model_validate({"trim": "none"}), None)
    assert any("too many to do without" in w for w in result.warnings)


@pytest.mark.parametrize("rounded", [0.0625, 0.5, 1.0])
def test_temperatures_that_are_rounded_are_no_misreadings(rounded: float) -> None:
    assert not misread(np.round(TEMPERATURE / rounded) * rounded)


def test_a_set_point_that_jumps_and_a_noisy_sensor_are_no_misreadings() -> None:
    profile = np.repeat([20.0, 60.0, 20.0, -40.0, 85.0, -40.0], 1200)
    assert not misread(profile)
    profile[:30] = 60.0  # a step in the first and in the last minute
    profile[-30:] = 20.0
    assert not misread(profile)
    assert not misread(TEMPERATURE + 3.0 * np.random.default_rng(2).standard_normal(SECONDS))


def test_a_door_that_is_opened_between_readings_a_minute_apart_is_no_misreading() -> None:
    air = TEMPERATURE[::60].copy()
    air[50] -= 25.0
    assert not misread(air, rate_hz=1.0 / 60.0)
    assert misread(with_code(-127.0, np.array([50]), TEMPERATURE[::60]), rate_hz=1.0 / 60.0)
