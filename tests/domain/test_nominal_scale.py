"""Counts to nominal values and rates by hand, and the refusals of samples that are not numbers or too few."""

from dataclasses import replace

import numpy as np
import pytest

from procedures.analysis.cells import cell_means
from procedures.analysis.recursive_bias.window_noise import window_means
from procedures.core.errors import MissingChannel, UnfitRecording
from procedures.core.recording import Channel, MemoryRecording, NominalScale, Quantity, RecordingInfo, rates

CHANNELS = (
    Channel("gyro_x", Quantity.ANGLE_INCREMENT, "rad", 0.25),
    Channel("temperature_case", Quantity.TEMPERATURE, "degC", 0.5, 40.0),
    Channel("accelerometer_y", Quantity.SPECIFIC_FORCE, "m/s^2", -2.0, -1.0),
)
INFO = RecordingInfo("r", "u", CHANNELS, 8.0, 400)


def test_values_and_rates_by_hand() -> None:
    gyro, case, force = CHANNELS
    assert (gyro.value(6.0), case.value(44.0), force.value(4.0)) == (1.5, 2.0, -10.0)
    raw = np.array([[6.0, 44.0, 4.0], [-2.0, 40.0, -1.0]])
    wanted = [[12.0, 2.0, -10.0], [-4.0, 0.0, 0.0]]  # increments of 1/8 s: eight times as much a second
    scale = NominalScale.of(CHANNELS, 8.0)
    assert scale.rates(raw).tolist() == wanted
    assert scale.rates(np.stack([raw, raw])).tolist() == [wanted, wanted]
    rows = raw.T.copy()
    scale.convert_rows(rows)
    assert rows.T.tolist() == wanted
    assert case.value(np.array([44.0, 40.0])).tolist() == [2.0, 0.0]


def test_a_recording_names_its_scale_by_channels() -> None:
    raw = np.random.default_rng(1).integers(-1000, 1000, (400, 3)).astype(np.int32)
    recording = MemoryRecording(INFO, raw)
    swapped = rates(recording, ("accelerometer_y", "gyro_x"))
    assert swapped[:, 0].tolist() == (-2.0 * (raw[:, 2] + 1.0)).tolist()
    assert swapped[:, 1].tolist() == (2.0 * raw[:, 0]).tolist()
    with pytest.raises(MissingChannel, match="gyro_z"):
        INFO.nominal_scale(("gyro_z",))


@pytest.mark.parametrize("means", [lambda r: cell_means(r, ("gyro_x", "accelerometer_y"), 1.0), None])
def test_means_refuse_what_is_no_number_or_not_all_there(means) -> None:
    means = means or (lambda r: window_means(r, ("gyro_x", "accelerometer_y"), 1.0))
    samples = np.ones((400, 3))
    means(MemoryRecording(INFO, samples))
    with pytest.raises(UnfitRecording, match=r"recording r: 400 samples where 480 are announced"):
        means(MemoryRecording(replace(INFO, count=480), samples))
    samples[17, 1] = np.nan  # a channel that is not asked for
    means(MemoryRecording(INFO, samples))
    samples[399, 2] = np.inf
    with pytest.raises(UnfitRecording, match="recording r: channel accelerometer_y holds samples that are not numbers"):
        means(MemoryRecording(INFO, samples))
