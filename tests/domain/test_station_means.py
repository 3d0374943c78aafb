"""Recordings in, means out, and the recordings that are refused."""

from itertools import pairwise

import numpy as np
import pytest

from procedures.analysis.calibration.station_means import station_means
from procedures.core.errors import MissingChannel, UnfitRecording
from procedures.core.recording import ACCELEROMETER, GYRO, Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.core.units import ARCSEC

COUNTS = tuple(Channel(name, Quantity.ANGLE_INCREMENT, "rad", 2 * ARCSEC) for name in GYRO)


class InBlocks(MemoryRecording):
    def blocks(self):
        edges = [0, 1, 40, 40, 333, len(self.raw)]
        return (self.raw[a:b] for a, b in pairwise(edges))


def recording(raw: np.ndarray, channels: tuple[Channel, ...] = COUNTS, name: str = "r", kind: type = MemoryRecording):
    return kind(RecordingInfo(name, "S-1", channels, 10.0, len(raw), 5.0), raw)


def counts(seed: int, n: int = 997) -> np.ndarray:
    return np.random.default_rng(seed).integers(-3, 9, size=(n, 3)).astype(np.int32)


def test_increments_become_mean_rates_in_si():
    raw = np.tile(np.array([[1, 2, 3], [3, 2, 4]], dtype=np.int32), (50, 1))
    means = station_means([recording(raw)], "gyro")
    assert means.outputs[0] == pytest.approx(np.array([2.0, 2.0, 3.5]) * 2 * ARCSEC * 10.0)
    assert means.windows == pytest.approx(np.array([[5.0, 15.0]]))
    assert means.output_unit == "rad/s"


def test_block_boundaries_do_not_matter():
    whole, cut = (station_means([recording(counts(1), kind=k)], "gyro") for k in (MemoryRecording, InBlocks))
    assert cut.outputs == pytest.approx(whole.outputs, rel=1e-14)
    assert cut.mean_sd == pytest.approx(whole.mean_sd, rel=1e-9)
    assert whole.scatter_sd[0] == pytest.approx(counts(1).std(axis=0, ddof=1) * 2 * ARCSEC * 10.0)


def test_the_scatter_of_batches_gives_the_uncertainty_of_the_mean():
    raw = np.random.default_rng(2).normal(size=(20_000, 3))
    channels = tuple(Channel(name, Quantity.ANGULAR_RATE, "rad/s") for name in GYRO)
    sd = station_means([recording(raw, channels)], "gyro").mean_sd[0]
    assert sd == pytest.approx(np.full(3, 1 / np.sqrt(20_000)), rel=4 / np.sqrt(2 * 19))  # 20 batches


def test_a_gyro_without_pulses_through_one_station_is_no_fault():
    silent = counts(3)
    silent[:, 1] = 0
    assert station_means([recording(silent), recording(counts(4))], "gyro").outputs[0, 1] == 0.0


@pytest.mark.parametrize(("value", "stations"), [(0, 12), (5, 2)])
def test_a_dead_channel_is_refused(value: int, stations: int):
    raws = [counts(i) for i in range(stations)]
    for raw in raws:
        raw[:, 2] = value
    with pytest.raises(UnfitRecording, match=r"gyro_z reads .* stuck"):
        station_means([recording(raw) for raw in raws], "gyro")


def test_a_stuck_or_saturated_channel_is_refused():
    stuck = counts(5)
    stuck[:, 0] = 32767
    with pytest.raises(UnfitRecording, match="recording bad: channel gyro_x is stuck at 32767"):
        station_means([recording(counts(6)), recording(stuck, name="bad")], "gyro")


def test_a_counter_at_the_same_number_in_two_of_several_stations_is_stuck():
    raws = [counts(i) for i in range(4)]
    raws[1][:, 0] = raws[3][:, 0] = 10
    with pytest.raises(UnfitRecording, match="channel gyro_x is stuck at 10"):
        station_means([recording(raw) for raw in raws], "gyro")


def test_a_quiet_counter_that_gives_whole_pulses_through_one_station_is_no_fault():
    """Ten pulses a sample, to a part in a hundred thousand: seen on an accelerometer of the default unit."""
    even = counts(3)
    even[:, 1] = 10
    rate = station_means([recording(even), recording(counts(4))], "gyro").outputs[0, 1]
    assert rate == pytest.approx(10 * 2 * ARCSEC * 10.0)


def test_a_sampled_rate_that_never_changes_through_one_station_is_stuck():
    channels = tuple(Channel(name, Quantity.ANGULAR_RATE, "count") for name in GYRO)
    stuck = counts(5)
    stuck[:, 0] = 10
    with pytest.raises(UnfitRecording, match="channel gyro_x is stuck at 10"):
        station_means([recording(counts(6), channels), recording(stuck, channels)], "gyro")


def test_samples_that_are_no_numbers_are_refused():
    raw = counts(7).astype(np.float64)
    raw[500, 1] = np.nan
    with pytest.raises(UnfitRecording, match="recording r: channel gyro_y"):
        station_means([recording(raw)], "gyro")


def test_what_else_is_refused():
    with pytest.raises(MissingChannel, match=ACCELEROMETER[0]):
        station_means([recording(counts(8))], "accelerometer")
    with pytest.raises(UnfitRecording, match="too few"):
        station_means([recording(counts(8, 5))], "gyro")
    with pytest.raises(UnfitRecording, match="no recording"):
        station_means([], "gyro")
    mixed = (*COUNTS[:2], Channel("gyro_z", Quantity.ANGLE_INCREMENT, "count"))
    with pytest.raises(UnfitRecording, match="different units"):
        station_means([recording(counts(8), mixed)], "gyro")
