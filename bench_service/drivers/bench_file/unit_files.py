"""Declared units of a laboratory: one file ``units/<serial>.toml`` each, next to the bench file."""

from datetime import date
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from bench_service.drivers.bench_file.reading import document_of, text_of, validated
from bench_service.drivers.interface.sections import Finite, NonNegative, Positive, Section
from bench_service.model.errors import Misconfigured
from procedures.core import units
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import Channel, Quantity
from procedures.core.unit import SERIAL, CoefficientsAt, TriadRecord, Unit, UnitDeclaration

Three = tuple[NonNegative, NonNegative, NonNegative]
PerAxis = NonNegative | Three
"""One number for x, y and z, or three."""
GYRO_SCALES = {
    "quantization_arcsec": units.ARCSEC,
    "random_walk_deg_sqrt_h": units.DEG_PER_SQRT_HOUR,
    "bias_instability_deg_h": units.DEG_PER_HOUR,
    "rate_random_walk_deg_h_sqrt_h": units.DEG_PER_HOUR_PER_SQRT_HOUR,
}
ACCELEROMETER_SCALES = {
    "quantization_ug_s": units.MICRO_G,
    "random_walk_ug_sqrt_s": units.MICRO_G,
    "bias_instability_ug": units.MICRO_G,
    "rate_random_walk_ug_per_sqrt_s": units.MICRO_G,
}
"""Key of a noise coefficient -> its unit in SI; in the order of `NoiseCoefficients`."""


class ChannelTable(Section):
    """Table ``[[channels]]``: one channel as the unit sends it."""

    name: str = Field(pattern=r"^[a-z][a-z0-9_]{0,63}$")
    quantity: Quantity
    unit: str
    scale: Finite = 1.0
    """Scale factor of the data sheet: value of a count in `unit`."""
    offset: Finite = 0.0
    lag_s: Annotated[float, Field(ge=-1.0, le=10.0)] = 0.0
    """Delay of the channel's samples against their stamps, by the data sheet."""
    range: tuple[Finite, Finite] | None = None
    """Smallest and largest value that the unit measures, in `unit`."""

    @model_validator(mode="after")
    def _is_a_channel(self) -> "ChannelTable":
        Channel(self.name, self.quantity, self.unit, self.scale, self.offset)
        if self.range is not None and not self.range[0] < self.range[1]:
            raise ValueError(f"range = {list(self.range)} must go from the smaller to the larger value")
        return self


class GyroNoise(Section):
    """Table ``[gyro]``: noise and stability by the data sheet."""

    quantization_arcsec: PerAxis = 0.0
    random_walk_deg_sqrt_h: PerAxis = 0.0
    bias_instability_deg_h: PerAxis = 0.0
    rate_random_walk_deg_h_sqrt_h: PerAxis = 0.0
    bias_run_to_run_sd_deg_h: NonNegative = 0.0
    scale_factor_run_to_run_sd_ppm: NonNegative = 0.0


class AccelerometerNoise(Section):
    """Table ``[accelerometer]``: noise and stability by the data sheet."""

    quantization_ug_s: PerAxis = 0.0
    random_walk_ug_sqrt_s: PerAxis = 0.0
    bias_instability_ug: PerAxis = 0.0
    rate_random_walk_ug_per_sqrt_s: PerAxis = 0.0
    bias_run_to_run_sd_ug: NonNegative = 0.0
    scale_factor_run_to_run_sd_ppm: NonNegative = 0.0


Row = tuple[Finite, Finite, Finite]


class TriadTable(Section):
    """Coefficients of a triad: ``U = bias + matrix·v`` in the rate unit of its channels."""

    bias: Row
    matrix: tuple[Row, Row, Row]


class CoefficientsTable(Section):
    """Table ``[[coefficients]]``: coefficients of a unit as it was found, or left, at a calibration."""

    state: Literal["as found", "as left"]
    day: date
    certificate: str = ""
    gyro: TriadTable | None = None
    accelerometer: TriadTable | None = None


class UnitFile(Section):
    """File of one declared unit: identity, channels, noise, and coefficients of earlier calibrations."""

    serial: str = Field(pattern=SERIAL)
    model: str = ""
    part: str = ""
    firmware: str = ""
    sample_rate_hz: Positive
    averaging_time_s: Annotated[float, Field(ge=1.0, le=1e5)] = 70.0
    channels: tuple[ChannelTable, ...] = Field(min_length=1)
    gyro: GyroNoise | None = None
    accelerometer: AccelerometerNoise | None = None
    coefficients: tuple[CoefficientsTable, ...] = ()

    @model_validator(mode="after")
    def _names_each_channel_once(self) -> "UnitFile":
        names = [channel.name for channel in self.channels]
        if twice := next((name for name in names if names.count(name) > 1), None):
            raise ValueError(f"channel {twice!r} is listed twice")
        return self


def read_units(folder: Path) -> tuple[Unit, ...]:
    """Return the units of every ``*.toml`` of a folder, in the order of their names; none where there is no folder.

    Raises `Misconfigured` with file, line and field, and for a file whose name is not its unit's serial.
    """
    return tuple(read_unit(path) for path in sorted(folder.glob("*.toml")))


def read_unit(path: Path) -> Unit:
    """Return the unit that a file declares. Raises `Misconfigured` with file, line and field."""
    text = text_of(path)
    given = validated(UnitFile, document_of(path, text), path, text)
    if path.stem != given.serial:
        raise Misconfigured(f"{path}: the unit is {given.serial!r}, so its file is {given.serial}.toml")
    return _unit(given)


def _unit(given: UnitFile) -> Unit:
    declaration = UnitDeclaration(
        given.model,
        given.part,
        given.firmware,
        {channel.name: channel.lag_s for channel in given.channels},
        {channel.name: channel.range for channel in given.channels if channel.range is not None},
        tuple(
            CoefficientsAt(c.state, c.day.isoformat(), c.certificate, triad, table.bias, table.matrix)
            for c in given.coefficients
            for triad, table in (("gyro", c.gyro), ("accelerometer", c.accelerometer))
            if table is not None
        ),
    )
    return Unit(
        given.serial,
        given.sample_rate_hz,
        tuple(Channel(c.name, c.quantity, c.unit, c.scale, c.offset) for c in given.channels),
        None if given.gyro is None else _gyro(given.gyro),
        None if given.accelerometer is None else _accelerometer(given.accelerometer),
        given.averaging_time_s,
        declaration=declaration,
    )


def _gyro(given: GyroNoise) -> TriadRecord:
    bias = given.bias_run_to_run_sd_deg_h * units.DEG_PER_HOUR
    return _record(given, GYRO_SCALES, bias, given.scale_factor_run_to_run_sd_ppm)


def _accelerometer(given: AccelerometerNoise) -> TriadRecord:
    bias = given.bias_run_to_run_sd_ug * units.MICRO_G
    return _record(given, ACCELEROMETER_SCALES, bias, given.scale_factor_run_to_run_sd_ppm)


def _record(given: Any, scales: dict[str, float], bias_sd: float, scale_factor_sd_ppm: float) -> TriadRecord:
    columns = [[value * scale for value in _three(getattr(given, name))] for name, scale in scales.items()]
    x, y, z = (NoiseCoefficients(*values) for values in zip(*columns, strict=True))
    return TriadRecord((x, y, z), bias_sd, scale_factor_sd_ppm * units.PPM)


def _three(value: float | tuple[float, float, float]) -> tuple[float, float, float]:
    return value if isinstance(value, tuple) else (value, value, value)
