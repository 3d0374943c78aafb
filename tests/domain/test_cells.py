"""Cell means against numpy on the whole array, however the blocks are cut."""

from dataclasses import replace

import numpy as np
import pytest

from procedures.analysis.cells import cell_means
from procedures.core.errors import BadParameter, MissingChannel, UnfitRecording
from procedures.core.recording import Channel, MemoryRecording, Quantity, RecordingInfo, rates

CHANNELS = (
    Channel("gyro_x", Quantity.ANGLE_INCREMENT, "rad", 2e-6),
    Channel("accelerometer_y", Quantity.SPECIFIC_FORCE, "m/s^2", 0.5, 100.0),
)
INFO = RecordingInfo("r", "u", CHANNELS, 100.0, 1050, 12.5, launched_s=2.0)
RAW = np.random.default_rng(4).integers(-(2**30), 2**30, (1050, 2)).astype(np.int32)


class Cut(MemoryRecording):
    """The same samples in blocks of uneven lengths, one of them empty."""

    def blocks(self):
        yield from np.split(self.raw, [1, 1, 7, 300, 311, 999])


@pytest.mark.parametrize("kind", [MemoryRecording, Cut])
def test_cells_are_means_of_the_nominal_rates(kind: type[MemoryRecording]) -> None:
    recording = kind(INFO, RAW)
    cells = cell_means(recording, ("accelerometer_y", "gyro_x"), 0.2)
    values = rates(recording, ("accelerometer_y", "gyro_x"))
    wanted = values[:1040].reshape(52, 20, 2).mean(axis=1).T
    np.testing.assert_allclose(cells.rates, wanted, rtol=1e-12)
    assert (cells.cell_s, cells.since_launch_s) == (0.2, 10.5)


def test_a_cell_shorter_than_a_sample_is_one_sample() -> None:
    cells = cell_means(MemoryRecording(INFO, RAW), ("gyro_x",), 1e-6)
    assert cells.rates.shape == (1, 1050)
    assert cells.cell_s == 0.01


def test_refusals() -> None:
    recording = MemoryRecording(INFO, RAW)
    with pytest.raises(UnfitRecording, match=r"1050 samples are less than one cell of 11 s"):
        cell_means(recording, ("gyro_x",), 11.0)
    with pytest.raises(BadParameter, match="cell_s"):
        cell_means(recording, ("gyro_x",), float("nan"))
    with pytest.raises(MissingChannel, match="gyro_z"):
        cell_means(recording, ("gyro_z",), 1.0)
    with pytest.raises(UnfitRecording, match=r"1050 samples where 2000 are announced"):
        cell_means(MemoryRecording(replace(INFO, count=2000), RAW), ("gyro_x",), 1.0)
