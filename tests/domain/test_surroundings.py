"""Surroundings of launches at rest: temperatures, vibration, readiness, absence, lines, densities, bands, refusals."""

from dataclasses import replace

import numpy as np
import pytest

from procedures.analysis.allan.sampled import SampledStream
from procedures.analysis.launch.lines import SpectralLine
from procedures.analysis.launch.surroundings import correlations, folded_hz, with_origins
from procedures.catalog import static_run
from procedures.core import units
from procedures.core.errors import BadParameter
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import GYRO, Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.core.unit import TriadRecord, Unit
from procedures.launches import NoiseParameters, NoiseResult, analyse_launches
from procedures.methods import allan_deviation
from procedures.noise_limits import NoiseLimits
from procedures.procedure import Evidence
from procedures.reports.density import density_figure
from procedures.reports.launch import noise_report
from simulators.truth import declared_unit, default_unit
from tests.validation.thermal_rig import flicker

RATE_HZ = 50.0
Q, N = 2e-6, 7e-8
"""Quantization [rad] and random walk [rad/√s]; their lines cross at half a minute."""
WARM = 3.0 * units.DEG_PER_HOUR
CHANNELS = (
    *(Channel(name, Quantity.ANGULAR_RATE, "rad/s") for name in GYRO),
    Channel("temperature_case", Quantity.TEMPERATURE, "degC"),
)
DITHERS = (391.7, 402.9, 413.4)
UNIT = Unit("U-1", RATE_HZ, CHANNELS, gyro=TriadRecord((NoiseCoefficients(Q, N),) * 3, dither_frequency_hz=DITHERS))


def launch(seed: int, seconds: int = 7200) -> MemoryRecording:
    """Gyro x is noise alone; y follows the temperature and has a line; z is shaken at 5 to 15 Hz."""
    rng = np.random.Generator(np.random.PCG64(seed))
    n = int(seconds * RATE_HZ)
    t = (np.arange(n) + 0.5) / RATE_HZ
    noise = Q * RATE_HZ * np.diff(rng.standard_normal((n + 1, 3)), axis=0)
    noise += N * np.sqrt(RATE_HZ) * rng.standard_normal((n, 3))
    temperature = 20.0 + 3.0 * (1.0 - np.exp(-t / 1500.0))
    rates = noise + 1e-5
    rates[:, 1] += 2e-6 * temperature + 2e-4 * np.sin(2.0 * np.pi * folded_hz(DITHERS[0], RATE_HZ) * t)
    shaken = rng.standard_normal(n)
    spectrum = np.fft.rfft(shaken)
    f = np.fft.rfftfreq(n, 1.0 / RATE_HZ)
    spectrum[(f < 5.0) | (f > 15.0)] = 0.0
    shaken = np.fft.irfft(spectrum, n)
    rates[:, 2] += 1e-4 * shaken / shaken.std()
    info = RecordingInfo(f"r{seed}", "U-1", CHANNELS, RATE_HZ, n, launched_s=0.0)
    return MemoryRecording(info, np.column_stack([rates, temperature + 0.03 * rng.standard_normal(n)]))


PARAMS = NoiseParameters(
    trim="none", wavelet="none", noise_limits=NoiseLimits(readiness_s=600.0, absence_level=0.01, vibration_deg_h=10.0)
)


@pytest.fixture(scope="module")
def recordings() -> tuple[MemoryRecording, ...]:
    return launch(1), launch(2)


@pytest.fixture(scope="module")
def result(recordings) -> NoiseResult:
    return analyse_launches(NoiseResult, recordings, PARAMS, UNIT)


def test_an_output_that_follows_the_temperature_is_told_with_an_honest_slope(result: NoiseResult):
    for found in result.launches:
        _, y, z = found.channels
        (t,) = y.temperatures
        assert t.sensor == "temperature_case"
        assert abs(t.slope - 2e-6) < 5.0 * t.slope_sd
        assert t.p_value < 1e-6
        assert z.temperatures[0].p_value > 1e-4


def test_the_p_value_allows_for_a_slow_noise():
    """A hundred launches of flicker beside one temperature: alarms at 5 % are those of a test at 5 %, or fewer.

    Binomial of 100 and 0.05 passes 16 once in 30 000. As independent cells they would alarm in most launches.
    """
    rng = np.random.Generator(np.random.PCG64(7))
    temperature = 20.0 + 3.0 * (1.0 - np.exp(-np.arange(7200.0) / 1500.0))
    p_values, naive = [], []
    for _ in range(34):
        for row in flicker(rng, 7200).T:
            (found,) = correlations(row, {"t": temperature}, 1.0)
            p_values.append(found.p_value)
            naive.append(abs(np.corrcoef(row, temperature)[0, 1]) * np.sqrt(7200.0) > 2.0)
    assert np.sum(np.array(p_values) < 0.05) <= 16
    assert np.mean(naive) > 0.5


def test_base_vibration_is_what_the_noise_does_not_explain(result: NoiseResult):
    """1e-4 rad/s of 5 to 15 Hz on z; on x nothing beyond readings that are 1.4e-4 rad/s rms themselves."""
    x, y, z = (c.vibration for c in result.launches[0].channels)
    assert x is not None
    assert y is not None
    assert z is not None
    assert x.vibration < 0.3 * x.own_noise
    # A line of 2e-4 is 1.41e-4 rms.
    assert y.lines == pytest.approx(2e-4 / np.sqrt(2.0), rel=0.05)
    assert np.hypot(z.vibration, 0.0) == pytest.approx(1e-4, rel=0.35)
    by_name = {c.name: c for c in result.checks}
    assert not by_name["gyro_z base vibration, rms"].passed


def test_lines_are_matched_to_the_dithers_of_the_unit(result: NoiseResult):
    (line,) = [x for x in result.launches[0].channels[1].lines if x.amplitude > 1e-4]
    assert line.origin == "the dither of gyro_x (391.7 Hz, folded)"
    given = [SpectralLine(folded_hz(402.9, 400.0), 1.0), SpectralLine(2 * 8.3, 1.0), SpectralLine(50.0, 1.0)]
    own, twice, none = with_origins(given, "gyro_y", DITHERS, 400.0)
    assert own.origin == "its own dither (402.9 Hz, folded)"
    assert twice.origin == "the dither of gyro_x (391.7 Hz, 2 times its frequency, folded)"
    assert none.origin == "no dither of the unit"
    declared = declared_unit(default_unit())
    assert declared.gyro is not None
    assert declared.gyro.dither_frequency_hz == DITHERS
    with pytest.raises(BadParameter, match=r"dither_frequency_hz\.y"):
        TriadRecord((NoiseCoefficients(),) * 3, dither_frequency_hz=(1.0, -2.0, 3.0))


def test_readiness_is_held_against_its_limit(recordings):
    params = PARAMS.model_copy(update={"trim": "gyros"})
    raw = recordings[0].raw.copy()
    raw[:, 0] += WARM * np.exp(-np.arange(len(raw)) / RATE_HZ / 300.0)
    warm = [MemoryRecording(recordings[0].info, raw)]
    found = analyse_launches(NoiseResult, warm, params, UNIT)
    checks = {c.name: c for c in found.checks}
    warm_up = found.launches[0].channels[0].warm_up
    assert warm_up is not None
    ready = checks["gyro_x readiness time"]
    assert ready.value == warm_up.end_s
    assert ready.passed == (warm_up.end_s <= 600.0)
    assert checks["gyro_z readiness time"].passed
    slow = params.model_copy(update={"noise_limits": NoiseLimits(readiness_s=100.0)})
    late = {c.name: c for c in analyse_launches(NoiseResult, warm, slow, UNIT).checks}
    assert not late["gyro_x readiness time"].passed


def test_a_ramp_is_no_sign_of_quality(result: NoiseResult, recordings):
    checks = {c.name: c for c in result.checks}
    assert checks["gyro_z rate ramp absent, p-value"].passed
    raw = recordings[0].raw.copy()
    raw[:, 2] += 1e-8 * np.arange(len(raw)) / RATE_HZ
    drifting = analyse_launches(NoiseResult, [MemoryRecording(recordings[0].info, raw)], PARAMS, UNIT)
    absent = [c for c in drifting.checks if c.name.startswith("gyro_z rate") and "absent" in c.name]
    assert not all(c.passed for c in absent)


def test_the_static_run_names_its_checks_beforehand_and_asks_for_temperatures():
    params = static_run.Params(temperatures=True)
    assert params.noise_limits.readiness_s == 600.0
    assert all(s.temperatures for s in static_run.schedule(params))
    assert not any(s.temperatures for s in static_run.schedule(static_run.Params()))


def test_the_launch_that_is_drawn_is_chosen(result: NoiseResult, recordings):
    with pytest.raises(BadParameter, match="the launches that there are"):
        analyse_launches(NoiseResult, recordings, PARAMS.model_copy(update={"band_launch": 3}))
    report = noise_report(result.launches, result.channels, None, 2)
    titles = [s.title for s in report.sections]
    assert {"Outputs at rest against temperature", "Base vibration", "Spectral lines"} <= set(titles)
    first = next(s for s in report.sections if s.title == "Allan deviation of gyro_x")
    assert first.series[2].y == tuple(
        v / units.DEG_PER_HOUR for v in result.launches[1].channels[0].analysed.curve.deviation
    )


def test_the_quantization_line_lies_on_the_density(result: NoiseResult):
    """Above 5 Hz the density of x is that of its readings: 8Q²sin²(πfΔt)/Δt, by the mean over forty bins."""
    channel = result.launches[0].channels[0]
    figure = density_figure([channel], ["launch"])
    assert figure is not None
    assert channel.density is not None
    (line,) = [s for s in figure.series if s.name == "quantization"]
    known = dict(zip(channel.density.frequency_hz, channel.density.density, strict=True))
    ratio = [known[f] / units.DEG_PER_HOUR**2 / y for f, y in zip(line.x, line.y, strict=True) if f > 5.0]
    assert np.mean(ratio) == pytest.approx(1.0, rel=0.05)


def test_density_and_bands_stand_beside_every_allan_plot(recordings):
    def found(**changes) -> allan_deviation.Result:
        params = allan_deviation.Params(channels=("gyro_x",), points=20).model_copy(update=changes)
        return allan_deviation.analyse(Evidence(recordings[:1]), params, None)

    plain = found()
    (curve,) = plain.curves
    assert curve.density is not None
    top = np.array(curve.density.density)[np.array(curve.density.frequency_hz) > 20.0]
    assert np.mean(top) == pytest.approx(8.0 * Q**2 * RATE_HZ, rel=0.15)
    assert [s.title for s in allan_deviation.report(plain).sections][-1].startswith("Power spectral density of gyro_x")
    assert found(density=False).curves[0].density is None
    band = found(band="all_starts", band_step_decades=0.1).curves[0].band
    assert band is not None
    assert all(a <= b <= c for a, b, c in zip(band.least, band.mean, band.greatest, strict=True))
    sampled = found(band="sampled_intervals", intervals=3000, band_step_decades=0.25).curves[0].band
    assert sampled is not None
    at = np.interp(np.log(sampled.tau_s), np.log(band.tau_s), np.log(band.mean))
    # 3000 intervals: 1/√6000 = 1.3 % a τ; four of them, where that many fit without overlapping much.
    few = np.array(sampled.tau_s) < 2.0
    assert np.abs(np.log(np.array(sampled.mean))[few] - at[few]).max() < 0.06
    with pytest.raises(BadParameter, match="a band needs every sample"):
        found(band="all_starts", gaps="leave_out")
    short = replace(recordings[0].info, count=200)
    told = allan_deviation.analyse(
        Evidence((MemoryRecording(short, recordings[0].raw[:200]),)), allan_deviation.Params(channels=("gyro_x",)), None
    )
    assert told.curves[0].density is None
    assert not told.warnings, "a short recording is no flaw"


def test_sampled_intervals_claim_the_spread_that_they_have():
    """White noise of unit density: deviation 1/√τ; 40 records, errors over claims have the spread of one."""
    rng, errors = np.random.Generator(np.random.PCG64(3)), []
    for _ in range(40):
        stream = SampledStream(1.0, 60_000, [1, 10, 60])
        stream.add(rng.standard_normal(60_000))
        found = stream.finish()
        assert found.intervals.tolist() == [300, 300, 300]
        errors.append((found.deviation - found.tau_s**-0.5) / found.standard_uncertainty)
    spread = np.std(errors, axis=0)
    # Standard deviation of 40: 11 %; four of them, and claims that scatter by some 8 % themselves.
    assert np.all(np.abs(spread - 1.0) < 0.55), spread
