"""Sound recordings, real and made, are left alone; what real ones do have is told."""

from collections.abc import Callable

import numpy as np
import pytest

from procedures.analysis.fitness.findings import FitnessSettings, Kind
from procedures.analysis.fitness.stream import inspect
from procedures.core.recording import ACCELEROMETER, MemoryRecording, RecordingInfo
from simulators.imu.sensor import TriadSensor
from simulators.truth import default_unit, unit_channels
from tests.domain.fitness_samples import COUNTS, Samples, dithered, found, generator, look, wide
from tests.shared_data import SHARED_DATA

SOUND: dict[str, Callable[[], Samples]] = {
    "wide": wide,
    "dithered": dithered,
    "floats": lambda: generator(5).normal(0.0, 1.0, (50_000, 6)),
    "rare pulses": lambda: (generator(6).random((50_000, 6)) < 1e-3).astype(np.int32),
    "random walk": lambda: np.cumsum(generator(8).normal(0.0, 1.0, (50_000, 6)), axis=0).round().astype(np.int32),
    "a sine's crest": lambda: np.outer(np.sin(np.arange(50_000) * 0.7), [9, 90, 900, 9e3, 9e4, 9e5]).astype(np.int32),
    "large numbers": lambda: (generator(9).normal(0.0, 3e8, (50_000, 6))).astype(np.int32),
}


@pytest.mark.parametrize("kind", SOUND)
def test_sound_recordings_are_left_alone(kind: str) -> None:
    assert not found(look(SOUND[kind]()))


@pytest.mark.parametrize("integer", [True, False])
def test_false_alarms_are_rarer_than_one_channel_in_a_thousand(integer: bool) -> None:
    # None among 3000 channels: with a rate of 1 in 1000 of any kind this would happen once in 20 times (e^-3). Noise of
    # 0.2 … 1000 levels, lengths from 32 to 8000 samples, cut off nowhere.
    rng = generator(11)
    flaws = {}
    for _ in range(500):
        count = int(10 ** rng.uniform(1.5, 3.9))
        means, sds = rng.uniform(-2e4, 2e4, 6), 10 ** rng.uniform(-0.7 if count > 1000 else 0.0, 3.0, 6)
        samples = rng.normal(means, sds, (count, 6))
        flaws.update(found(look(samples.round().astype(np.int32) if integer else samples)))
    assert not flaws


def test_the_simulated_unit_at_rest_is_left_alone() -> None:
    unit = default_unit()
    rest = {"gyro": [5.6e-5, 4.6e-5, 0.0], "accelerometer": [0.0, 0.0, 9.81]}
    sensors = {name: TriadSensor(unit.triad(name), 400.0, (3, 1, name)) for name in rest}
    counts = [sensors[name].feel(0, 40_000, np.array([rest[name]]) / 400.0) for name in rest]
    samples = np.concatenate(counts).T.astype(np.int32)
    info = RecordingInfo("r", unit.serial, unit_channels(unit), 400.0, len(samples))
    # A gyro as good as that is known to read no more than the Earth's rate and its bias, 0.2 deg/h.
    settings = FitnessSettings(gravity_m_s2=9.81, gyro_rest_rad_s=1e-4)
    assert not found(inspect(MemoryRecording(info, samples), settings))


@pytest.mark.shared_data
@pytest.mark.skipif(not SHARED_DATA.is_dir(), reason="the shared recordings are absent")
def test_a_real_static_recording_has_a_coarse_accelerometer_and_nothing_else() -> None:
    path = SHARED_DATA / "mpu6050_static" / "static_449s.csv.gz"
    samples = np.loadtxt(path, delimiter=",", skiprows=5).astype(np.int32)[:, [3, 4, 5, 0, 1, 2]]
    assert np.all(samples[:, 3:] % 4 == 0)
    flaws = found(look(samples))
    assert sorted(flaws) == sorted(ACCELEROMETER)
    assert {f.kind for findings in flaws.values() for f in findings} == {Kind.RESOLUTION}


@pytest.mark.shared_data
@pytest.mark.skipif(not SHARED_DATA.is_dir(), reason="the shared recordings are absent")
def test_a_real_hand_turned_recording_passes_and_another_one_hit_its_rails() -> None:
    folder = SHARED_DATA / "xsens_multi_position"
    parts = [np.loadtxt(folder / f"xsens_{name}.txt.gz")[:, 1:] for name in ("gyro", "acc")]
    assert not found(look(np.hstack(parts).astype(np.int32), at_rest=False))
    turned = np.loadtxt(SHARED_DATA / "mpu6050_static" / "ten_positions.csv.gz", delimiter=",", skiprows=5)
    counts = turned.astype(np.int32)[:, [3, 4, 5, 0, 1, 2]]
    flaws = found(look(counts, at_rest=False))
    railed = {name for name, findings in flaws.items() if any(f.kind is Kind.SATURATED for f in findings)}
    at_rails = np.isin(counts, [32767, -32768]).any(axis=0)
    assert railed == {c.name for c, hit in zip(COUNTS, at_rails, strict=True) if hit} != set()
