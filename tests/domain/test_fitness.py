"""Each fault that is put into a sound recording is found where it was put, and nothing else is."""

from typing import Any

import numpy as np
import pytest

from procedures.analysis.fitness.findings import Finding, FitnessSettings, Kind, Severity, require_fit
from procedures.analysis.fitness.stream import FitnessStream, inspect
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.recording import ACCELEROMETER, GYRO, Channel, MemoryRecording, Quantity, RecordingInfo
from tests.domain.fitness_samples import COUNTERS, COUNTS, RATE_HZ, SI, Samples, dithered, found, generator, look, wide


def _only(samples: Samples, channel: str, kind: Kind, **settings: Any) -> Finding:
    """The finding of that kind in that channel, which must be all there is."""
    flaws = found(look(samples, **settings))
    assert list(flaws) == [channel], flaws
    assert [f.kind for f in flaws[channel]] == [kind], flaws
    finding = flaws[channel][0]
    assert f"channel {channel}" in finding.sentence
    return finding


def test_a_constant_channel_is_refused() -> None:
    samples = wide()
    samples[:, 1] = 17
    finding = _only(samples, "gyro_y", Kind.CONSTANT)
    assert finding.severity is Severity.REFUSE
    assert "reads 17 throughout all 50000 samples" in finding.sentence


def test_a_silent_counter_may_be_let_through() -> None:
    samples = dithered()
    samples[:, 2] = 0
    assert _only(samples, "gyro_z", Kind.CONSTANT, channels=COUNTERS).severity is Severity.REFUSE
    warned = _only(samples, "gyro_z", Kind.CONSTANT, channels=COUNTERS, counters_may_rest=True)
    assert warned.severity is Severity.WARN
    samples[:, 2] = 32767
    railed = _only(samples, "gyro_z", Kind.CONSTANT, channels=COUNTERS, counters_may_rest=True)
    assert railed.severity is Severity.REFUSE
    assert "the end of its range" in railed.sentence


@pytest.mark.parametrize("n", [0, 1, 10, 19])
def test_too_few_samples_are_counted(n: int) -> None:
    fitness = look(wide(n))
    for channel in fitness:
        assert Kind.TOO_FEW in [f.kind for f in channel.findings]
    with pytest.raises(UnfitRecording, match=rf"recording r: .*{n} samples are too few, at least 20"):
        require_fit("r", fitness)
    assert not found(look(wide(20)))


def test_a_recording_cut_short_is_refused() -> None:
    stream = FitnessStream(COUNTS, RATE_HZ, 60_000)
    stream.add(wide())
    for channel in stream.finish():
        assert [f.kind for f in channel.findings] == [Kind.INCOMPLETE]
        assert "50000 samples where 60000 are announced" in channel.findings[0].sentence


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("index", [0, 16_383, 16_384, 49_999])
def test_a_single_sample_that_is_no_number_is_named(value: float, index: int) -> None:
    samples = wide().astype(np.float64)
    samples[index, 4] = value
    finding = _only(samples, "accelerometer_y", Kind.NOT_FINITE)
    assert (finding.first_index, finding.count, finding.severity) == (index, 1, Severity.REFUSE)
    assert f"sample {index} ({index / RATE_HZ:.6g} s)" in finding.sentence
    assert _only(samples, "accelerometer_y", Kind.NOT_FINITE, gaps="aware").severity is Severity.WARN


def test_a_channel_without_any_number_is_only_that() -> None:
    samples = wide().astype(np.float64)
    samples[:, 0] = np.nan
    assert _only(samples, "gyro_x", Kind.NOT_FINITE).count == 50_000


@pytest.mark.parametrize("end", [1, -1])
@pytest.mark.parametrize("sigmas", [-1.0, 0.0, 1.0, 2.0])
@pytest.mark.parametrize("dtype", [np.int32, np.float64])
def test_a_clipped_channel_is_found(end: int, sigmas: float, dtype: type) -> None:
    samples = wide(sd=30.0).astype(dtype)
    limit = round(-438 + end * sigmas * 30.0)
    samples[:, 0] = np.minimum(samples[:, 0], limit) if end > 0 else np.maximum(samples[:, 0], limit)
    finding = _only(samples, "gyro_x", Kind.SATURATED)
    assert finding.severity is Severity.REFUSE
    assert finding.count == np.count_nonzero(samples[:, 0] == limit)
    assert finding.first_index == np.argmax(samples[:, 0] == limit)
    assert f"at {limit}, the {'largest' if end > 0 else 'smallest'}" in finding.sentence


@pytest.mark.parametrize("rail", [32767, -32768, 65535, 2**31 - 1, -(2**31)])
def test_the_end_of_a_converters_range_needs_no_pile(rail: int) -> None:
    samples = wide()
    samples[20_000, 0] = rail
    warned = [f for f in found(look(samples))["gyro_x"] if f.kind is Kind.SATURATED]
    assert [(f.severity, f.first_index, f.count) for f in warned] == [(Severity.WARN, 20_000, 1)]
    samples[20_001, 0] = rail
    refused = [f for f in found(look(samples))["gyro_x"] if f.kind is Kind.SATURATED]
    assert [(f.severity, f.count) for f in refused] == [(Severity.REFUSE, 2)]


@pytest.mark.parametrize("bit", [1, 2, 3, 4])
@pytest.mark.parametrize("value", [0, 1])
def test_a_stuck_bit_is_found(bit: int, value: int) -> None:
    # The least of the noise's spreads is 20 counts, so that bit 5, of 32, still has bits above it that change.
    samples = wide(sd=40.0)
    samples[:, 2] = samples[:, 2] | (1 << bit) if value else samples[:, 2] & ~(1 << bit)
    finding = _only(samples, "gyro_z", Kind.STUCK_BIT)
    assert finding.severity is Severity.REFUSE
    assert f"bit {bit} (of {1 << bit} counts) is stuck at {value}" in finding.sentence


@pytest.mark.parametrize("shift", [1, 3])
@pytest.mark.parametrize("rest", [0, 1])
def test_values_that_share_a_factor_have_a_coarse_resolution(shift: int, rest: int) -> None:
    samples = wide()
    samples[:, 3] = (samples[:, 3] << shift) + rest
    finding = _only(samples, "accelerometer_x", Kind.RESOLUTION)
    assert finding.severity is Severity.WARN
    assert f"its resolution is {1 << shift} counts" in finding.sentence


def test_a_hung_data_link_is_found() -> None:
    samples = dithered()
    # A row of six dithered channels repeats the one before about once in a hundred, 60 repeats are beyond all chance.
    samples[16_350:16_410] = samples[16_349]
    fitness = look(samples, COUNTERS)
    kinds = {f.kind for c in fitness for f in c.findings}
    assert kinds == {Kind.REPEATED}
    finding = fitness[3].findings[0]
    assert finding.severity is Severity.REFUSE
    assert abs((finding.first_index or 0) - 16_350) <= 1
    assert 60 <= finding.count <= 62  # its neighbours may be equal by chance


def converters(seed: int, sd: float = 0.33, n: int = 6000) -> np.ndarray:
    """Codes of three converters of one current, whose noise of `sd` codes moves all of them at once."""
    rng = np.random.default_rng(seed)
    common = sd * rng.standard_normal(n)
    own = 0.02 * rng.standard_normal((n, 3))
    return np.round(common[:, None] + own + rng.uniform() + [5.0, -3.0, 8.0]).astype(np.int32)


CONVERTERS = COUNTS[3:6]


def test_codes_that_a_common_noise_moves_repeat_together_without_a_fault() -> None:
    """Seen: a sound converter was refused for 20 equal rows of 6000, since channels were taken for independent."""
    seen = [look(converters(seed), CONVERTERS, reads_gravity=False) for seed in range(100)]
    assert not [f.sentence for fitness in seen for c in fitness for f in c.findings]


def test_a_hung_link_is_found_where_a_common_noise_moves_the_codes() -> None:
    samples = converters(3, sd=0.7)
    # A code repeats with a chance of about 0.4: 0.4^L · 6000 < 1e-9 from 33 on (from 0.6 on it would be no evidence).
    samples[2000:2100] = samples[1999]
    fitness = look(samples, CONVERTERS, reads_gravity=False)
    assert {(f.kind, f.severity) for c in fitness for f in c.findings} == {(Kind.REPEATED, Severity.REFUSE)}


@pytest.mark.parametrize("times", [2, 10])
def test_rows_sent_more_than_once_are_found(times: int) -> None:
    fitness = look(np.repeat(wide(20_000), times, axis=0))
    for channel in fitness:
        assert [f.kind for f in channel.findings] == [Kind.REPEATED]
        assert channel.findings[0].count == pytest.approx(20_000 * (times - 1), abs=2)


@pytest.mark.parametrize("index", [8, 16_383, 16_384, 16_392, 32_770, 49_990])
def test_an_outlier_and_a_step_are_told_apart(index: int) -> None:
    samples = wide()
    samples[index, 5] += 900
    outlier = _only(samples, "accelerometer_z", Kind.OUTLIER)
    assert (outlier.first_index, outlier.count, outlier.severity) == (index, 1, Severity.WARN)
    samples = wide()
    samples[index:, 5] += 900
    step = _only(samples, "accelerometer_z", Kind.STEP)
    assert (step.first_index, step.count, step.severity) == (index, 1, Severity.WARN)
    assert not found(look(samples, at_rest=False))


def _resting() -> Samples:
    """A good unit at rest, x up, in SI: Earth rate with a little noise, gravity."""
    rest = np.array([5.6e-5, 4.6e-5, 0.0, 9.81, 0.02, -0.03])
    return rest + generator(3).normal(0.0, 1.0, (2000, 6)) * ([1e-6] * 3 + [1e-3] * 3)


@pytest.mark.parametrize(
    ("factor", "words"),
    [(1 / 9.80665, "looks like g"), (1000 / 9.80665, "looks like mg"), (100.0, "cm/s²"), (1 / RATE_HZ, "increments")],
)
def test_gravity_in_another_unit_is_recognised(factor: float, words: str) -> None:
    samples = _resting()
    samples[:, 3:] *= factor
    flaws = found(look(samples, SI))
    assert sorted(flaws) == sorted(ACCELEROMETER)
    (finding,) = flaws["accelerometer_x"]
    assert (finding.kind, finding.severity) == (Kind.WRONG_UNIT, Severity.REFUSE)
    assert words in finding.sentence
    assert f"together read {9.81 * factor:.4g} m/s^2" in finding.sentence


def test_an_unknown_factor_of_gravity_is_only_warned_of() -> None:
    samples = _resting()
    samples[:, 3:] *= 5.0
    (finding,) = found(look(samples, SI, gravity_m_s2=9.8155))["accelerometer_x"]
    assert finding.severity is Severity.WARN
    assert "49.05 m/s^2 where gravity, 9.8155 m/s² ± 30 % was expected" in finding.sentence


def test_a_good_gyro_shows_degrees() -> None:
    assert not found(look(_resting(), SI, gyro_rest_rad_s=1e-4))
    for factor, words in ((180 / np.pi, "deg/s"), (3600 * 180 / np.pi, "deg/h")):
        samples = _resting()
        samples[:, :3] *= factor
        flaws = found(look(samples, SI, gyro_rest_rad_s=1e-4))
        assert sorted(flaws) == sorted(GYRO)
        assert words in flaws["gyro_x"][0].sentence
        assert flaws["gyro_x"][0].severity is Severity.REFUSE


def test_a_poor_gyro_shows_no_more_than_that_something_is_wrong() -> None:
    samples = _resting()
    samples[:, 0] += 3.3
    (finding,) = found(look(samples, SI))["gyro_x"]
    assert finding.severity is Severity.WARN
    assert "less than 0.5 rad/s at rest" in finding.sentence


def test_kelvins_are_recognised() -> None:
    channels = (Channel("case", Quantity.TEMPERATURE, "degC"),)
    readings = generator().normal(22.0, 0.01, (1000, 1))
    assert not found(look(readings, channels))
    assert "kelvins" in found(look(readings + 273.15, channels))["case"][0].sentence


@pytest.mark.parametrize("cut", [1, 17, 16_384, 40_000])
def test_blocks_do_not_matter(cut: int) -> None:
    samples = wide(40_000, sd=40.0).astype(np.float64)
    samples[16_400, 0] = np.nan
    samples[16_384:, 1] += 5000.0
    samples[:, 2] = np.minimum(samples[:, 2], -60.0)
    samples[16_380:16_390] = samples[16_380]
    assert look(samples, cut=cut) == look(samples)


def test_a_recording_is_inspected_and_warnings_are_handed_on() -> None:
    samples = wide()
    samples[100, 0] += 2000
    recording = MemoryRecording(RecordingInfo("r", "U", COUNTS, RATE_HZ, len(samples)), samples)
    (sentence,) = require_fit("r", inspect(recording))
    assert "channel gyro_x: 1 of 50000 samples far from both neighbours; the first is sample 100 (1 s)" in sentence


def test_what_cannot_be_inspected_is_named() -> None:
    stream = FitnessStream(COUNTS, RATE_HZ)
    with pytest.raises(BadParameter, match=r"must be of shape \(n, 6\)"):
        stream.add(np.zeros((5, 3)))
    stream.add(wide(10))
    with pytest.raises(BadParameter, match="of one type, int32"):
        stream.add(np.zeros((5, 6)))
    with pytest.raises(BadParameter, match="rate_hz"):
        FitnessStream(COUNTS, 0.0)
    with pytest.raises(BadParameter, match="gravity_m_s2"):
        FitnessSettings(gravity_m_s2=1.0)


@pytest.mark.parametrize("factor", [1.0, -1.0, 57.29578])
@pytest.mark.parametrize("n", [2000, 40_000])
def test_a_channel_that_repeats_another_is_named(factor: float, n: int) -> None:
    samples = generator(12).normal([1e-4, -2e-4, 3e-4, 9.8, 0.1, 0.2], [1e-6] * 3 + [0.01] * 3, (n, 6))
    assert not found(look(samples, SI))
    samples[:, 2] = 5e-5 + factor * (samples[:, 0] - 1e-4)
    finding = _only(samples, "gyro_z", Kind.TWIN, channels=SI)
    assert finding.severity is Severity.WARN
    words = {1.0: "gyro_z repeats channel gyro_x sample", -1.0: "gyro_x negated", 57.29578: "gyro_x × 57.2958"}
    assert words[factor] in finding.sentence


def test_counts_that_are_copied_are_named_and_those_of_one_motion_are_not() -> None:
    samples = wide(5000)
    samples[:, 1] = -samples[:, 0]
    assert "negated" in _only(samples, "gyro_y", Kind.TWIN).sentence
    samples[2500, 1] += 1
    assert not found(look(samples))


@pytest.mark.parametrize("steps", [1, 4])
@pytest.mark.parametrize("dtype", [np.int32, np.float64])
def test_a_channel_that_only_steps_is_dead(steps: int, dtype: type) -> None:
    samples = wide(30_000).astype(dtype)
    samples[:, 4] = np.arange(30_000) // (30_000 // (steps + 1)) * 40
    finding = _only(samples, "accelerometer_y", Kind.CONSTANT)
    assert finding.severity is Severity.REFUSE
    told = "one change" if steps == 1 else "4 changes"
    assert f"stands still but for {told} within 0 … {40 * steps}" in finding.sentence
    assert f"at sample {30_000 // (steps + 1)} " in finding.sentence
    # A counter across the Earth's rate gives a pulse now and then, and a dwell of a coarse channel is as quiet.
    counter = (generator(3).random((30_000, 6)) < 1e-3).astype(np.int32)
    counter[:, 4] = 0
    counter[1000, 4] = 1
    assert not found(look(counter, COUNTERS))
    assert Kind.CONSTANT not in [f.kind for f in found(look(samples, beside_others=True)).get("accelerometer_y", [])]


@pytest.mark.parametrize(("factor", "words"), [(1000.0, "mg declared as g"), (1000 / 9.80665, "looks like mg")])
def test_a_single_accelerometer_reads_no_more_than_gravity(factor: float, words: str) -> None:
    for columns in ([5], [3, 5]):
        channels = tuple(SI[c] for c in columns)
        samples = generator(4).normal(9.8, 0.01, (3000, len(columns)))
        assert not found(look(samples, channels))
        (finding,) = found(look(samples * factor, channels))["accelerometer_z"]
        assert (finding.kind, finding.severity) == (Kind.WRONG_UNIT, Severity.REFUSE)
        assert words in finding.sentence
    (finding,) = found(look(samples * 1.5, channels))["accelerometer_z"]
    assert finding.severity is Severity.WARN
    assert "14.7 m/s^2 where at most gravity, 9.8066 m/s² + 30 %, was expected" in finding.sentence


@pytest.mark.parametrize("scale", [1e-100, 1e200])
def test_a_scale_beyond_reason_is_refused(scale: float) -> None:
    samples = generator(5).normal(0.0, 1.0, (3000, 1)) * scale
    finding = _only(samples, "gyro_x", Kind.WRONG_UNIT, channels=SI[:1])
    assert finding.severity is Severity.REFUSE
    assert "channel gyro_x" in finding.sentence
    assert "scale" in finding.sentence


@pytest.mark.parametrize("step", [1e-7, -1e-7])
def test_a_counter_in_place_of_a_sensor_is_refused(step: float) -> None:
    samples = generator(5).normal([1e-4, 1e-4, 1e-4, 9.8, 0.1, 0.1], [1e-6] * 3 + [1e-3] * 3, (3000, 6))
    samples[:, 1] = step * np.arange(3000)
    finding = _only(samples, "gyro_y", Kind.EVEN_STEPS, channels=SI)
    assert finding.severity is Severity.REFUSE
    assert "is this the right column?" in finding.sentence
    packets = wide(3000)
    packets[:, 3] = np.arange(3000) % 256
    assert "grows by 1 count" in _only(packets, "accelerometer_x", Kind.EVEN_STEPS).sentence
    samples[:, 1] = 1e-7 * np.arange(3000) + generator(6).normal(0.0, 3e-8, 3000)
    assert not any(f.kind is Kind.EVEN_STEPS for fs in found(look(samples, SI)).values() for f in fs)


def test_a_dead_band_is_no_row_sent_twice() -> None:
    rate = generator(8).normal(0.0, 1e-4, (30_000, 1))
    finding = _only(np.where(np.abs(rate) < 1.5e-4, 0.0, rate), "gyro_x", Kind.REPEATED, channels=SI[:1])
    assert "nearly all of them at 0: a dead band or a threshold" in finding.sentence
    filtered = np.median(np.lib.stride_tricks.sliding_window_view(rate[:, 0], 5), axis=1)[:, None]
    finding = _only(filtered, "gyro_x", Kind.REPEATED, channels=SI[:1])
    assert "rows seem to be sent more than once" in finding.sentence
    assert "a filter, such as a median, holds values" in finding.sentence


def test_pulses_of_one_weight_are_not_saturated() -> None:
    weight = 1.11 * np.pi / 180 / 3600
    angle = np.cumsum(generator(9).normal(2.4e-5 / RATE_HZ, 1e-8, 60_000))
    # Differences of a floating angle: each count comes out in several roundings.
    steps = np.diff(np.round(angle / weight) * weight, prepend=0.0)[:, None]
    assert len(np.unique(steps)) > 8
    channel = (Channel("gyro_x", Quantity.ANGLE_INCREMENT, "rad"),)
    assert not [f for fs in found(look(steps, channel)).values() for f in fs if f.kind is Kind.SATURATED]


def test_zeros_for_lost_samples_are_suspected() -> None:
    samples = wide(30_000).astype(np.float64)
    samples[::500, 3] = 0.0
    (finding,) = found(look(samples))["accelerometer_x"]
    assert finding.severity is Severity.REFUSE
    assert "zeros seem to stand for lost samples" in finding.sentence


@pytest.mark.parametrize("times", [2, 3])
@pytest.mark.parametrize("integer", [True, False])
def test_a_file_joined_with_itself_is_refused(times: int, integer: bool) -> None:
    samples = wide(20_000).astype(np.int32 if integer else np.float64)
    flaws = found(look(np.vstack([samples] * times)))
    assert sorted(flaws) == sorted(c.name for c in COUNTS)
    (finding,) = flaws["gyro_x"]
    assert (finding.kind, finding.severity) == (Kind.REPEATED, Severity.REFUSE)
    assert f"hold itself {times} times" in finding.sentence
    assert "One part is 200 s long (stop_s)" in finding.sentence


def test_missing_samples_name_the_ways_out() -> None:
    samples = wide(2000).astype(np.float64)
    samples[1200:, :] = np.nan
    assert "a stretch without them (start_s and stop_s)" in found(look(samples))["gyro_x"][0].sentence
    samples[:, 1] = np.nan
    assert "leave the channel out (channels)" in found(look(samples))["gyro_y"][0].sentence
