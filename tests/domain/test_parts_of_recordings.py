"""Some channels of a recording, a stretch of it, and both of a recording whose outliers were mended."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from procedures.analysis.fitness.findings import FitnessSettings
from procedures.analysis.fitness.watched import Inspection, Watched
from procedures.analysis.parts import cut, of_channels
from procedures.core.errors import MissingChannel
from procedures.core.recording import Channel, Quantity, RawArray, Recording, RecordingInfo

CHANNELS = tuple(Channel(f"gyro_{axis}", Quantity.ANGULAR_RATE, "rad/s", 1e-7) for axis in "xyz")


@dataclass(frozen=True)
class Blocks:
    """A recording whose blocks are short."""

    info: RecordingInfo
    raw: NDArray[np.int32]

    def blocks(self) -> Iterator[RawArray]:
        """Yield the samples in seven blocks."""
        yield from np.array_split(self.raw, 7)


def _recording(raw: NDArray[np.int32]) -> Recording:
    return Blocks(RecordingInfo("r", "U", CHANNELS, 100.0, len(raw)), raw)


def _raw() -> NDArray[np.int32]:
    return np.random.Generator(np.random.PCG64(3)).normal(0.0, 40.0, (30_000, 3)).round().astype(np.int32)


def _whole(recording: Recording) -> NDArray[np.int32]:
    return np.concatenate([block.astype(np.int32) for block in recording.blocks()])


def test_channels_come_in_the_order_asked_for_and_a_missing_one_is_named() -> None:
    raw = _raw()
    some = of_channels(_recording(raw), ("gyro_z", "gyro_x"))
    assert [c.name for c in some.info.channels] == ["gyro_z", "gyro_x"]
    assert np.array_equal(_whole(some), raw[:, [2, 0]])
    with pytest.raises(MissingChannel, match="gyro_q"):
        of_channels(_recording(raw), ("gyro_q",))


def test_channels_of_a_stretch_are_the_stretch_of_the_channels() -> None:
    raw = _raw()
    found = of_channels(cut(_recording(raw), 12.5, 200.0), ("gyro_y",))
    assert found.info.count == 18_750
    assert np.array_equal(_whole(found), raw[1250:20_000, [1]])


def test_channels_of_an_inspected_recording_are_mended_as_the_whole_is() -> None:
    raw = _raw()
    raw[17_000, 1], raw[4_000, 2] = 60_000, -50_000
    watched = Watched(_recording(raw), Inspection(FitnessSettings(mends_outliers=True)))
    before = of_channels(watched, ("gyro_z", "gyro_y"))
    assert np.array_equal(_whole(before), raw[:, [2, 1]])
    assert watched.is_read, "the first pass inspects, whatever channels it is for"
    assert watched.has_outliers
    watched.mend()
    mended = _whole(watched)
    assert (np.abs(mended[[17_000, 4_000], [1, 2]]) < 400).all()
    assert np.array_equal(_whole(of_channels(watched, ("gyro_z", "gyro_y"))), mended[:, [2, 1]])
