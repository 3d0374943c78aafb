"""Samples of a made recording as sheets, with their physical values worked by hand."""

from collections.abc import Iterator

import numpy as np

from bench_service.formats.export import Extract, extract
from bench_service.formats.samples_out.sheet import Sheet, Treatment, physical_sheet
from procedures.core.recording import ACCELEROMETER, GYRO, Channel, Quantity, RawArray, RecordingInfo

RATE = 400.0


CHANNELS = (
    *(Channel(name, Quantity.ANGLE_INCREMENT, "rad", 1e-8) for name in GYRO),
    *(Channel(name, Quantity.VELOCITY_INCREMENT, "m/s", 1e-6, 3.0) for name in ACCELEROMETER),
    Channel("temperature_case", Quantity.TEMPERATURE, "degC", 0.01),
)


INFO = RecordingInfo("r-1", "U-1", CHANNELS, RATE, 1000, 12.5, None, "f00d", True)


RAW: RawArray = np.random.Generator(np.random.PCG64(3)).integers(-5000, 5000, (1000, 7)).astype(np.int32)


def values() -> np.ndarray:
    """The physical values by hand: (raw − offset)·scale, times the rate for increments."""
    return np.column_stack([RAW[:, :3] * 1e-8 * RATE, (RAW[:, 3:6] - 3.0) * 1e-6 * RATE, RAW[:, 6:] * 0.01])


def part_of(start: int = 0, stop: int = 1000, channels: list[str] | None = None) -> Extract:
    return extract(INFO, "int32", channels, start / RATE, stop / RATE)


def blocks(part: Extract) -> Iterator[RawArray]:
    columns = [INFO.column(c.name) for c in part.info.channels]
    for start in range(part.start, part.stop, 137):
        yield RAW[start : min(start + 137, part.stop), columns]


def sheet(treatment: Treatment | None = None, **part: int) -> Sheet:
    chosen = part_of(**part)
    return physical_sheet(chosen, blocks(chosen), treatment)
