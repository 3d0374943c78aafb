"""Samples as a sheet: a column of time and one a channel, with their units, in any format that people's tools read.

Raw samples are those stored. Physical ones are in SI, increments divided by the sample period, if wanted corrected by
calibrations ``v = K⁻¹·(U − b)`` and decimated by means; then a unit is part of a column's name too.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bench_service.formats.chunk import sample_type
from bench_service.formats.export import Extract, describe
from bench_service.formats.samples_out.distinct_names import distinct
from bench_service.formats.samples_out.temperature import (
    SENSORS_AS_READ,
    Stage,
    corrected_channels,
    fitted_range,
    stages,
)
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.imu_model import TriadCalibration
from procedures.core.recording import TRIADS, NominalScale, Quantity, RawArray
from procedures.core.unit_correction import UnitCorrection

IN_NAMES = {"rad/s": "rad_per_s", "m/s^2": "m_per_s2", "degC": "degC", "rad": "rad", "s": "s", "count": "count"}
"""Unit -> its form in a column's name, which every tool takes as a name."""
RATE_OF = {Quantity.ANGLE_INCREMENT: Quantity.ANGULAR_RATE, Quantity.VELOCITY_INCREMENT: Quantity.SPECIFIC_FORCE}
"""Quantity of an increment over the sample period."""
CALIBRATION, CORRECTION = "calibration_", "correction_"
"""Begin of the facts, by triad, that name the calibration by which samples are corrected, and give its formula."""
TEMPERATURE = "temperature_"
"""Begin of the facts, by kind, that name the temperature corrections by which samples are corrected."""
LARGEST_FACTOR = 1_000_000


@dataclass(frozen=True)
class Column:
    """A column of a sheet with the attributes that travel with it."""

    name: str
    kind: np.dtype[np.generic]
    attributes: Mapping[str, str]

    @property
    def unit_of_numbers(self) -> str:
        """Unit of the numbers in the column as they are; "count" where ``scale·(raw − offset)`` has another one."""
        said = self.attributes
        plain = float(said.get("scale", "1")) == 1.0 and float(said.get("offset", "0")) == 0.0
        return said["unit"] if plain else "count"


@dataclass(frozen=True)
class Sheet:
    """Table of samples: columns of equal length, whose rows come in blocks, one array a column each time."""

    columns: tuple[Column, ...]
    about: Mapping[str, str]
    rows: int
    blocks: Iterable[tuple[np.ndarray, ...]]


@dataclass(frozen=True)
class Treatment:
    """Treatment of raw samples before they go out."""

    calibrations: tuple[TriadCalibration, ...] = ()
    """At most one a triad."""
    calibration_ids: tuple[str, ...] = ()
    decimate: int = 1
    """Samples that one mean is taken over; a rest at the end is left out."""
    corrections: tuple[UnitCorrection, ...] = ()
    """Temperature corrections, at most one of each kind; they come before the calibrations."""
    correction_ids: tuple[str, ...] = ()


TIME = Column("time_s", np.dtype(np.float64), {"unit": "s", "quantity": "time since the first sample"})


def raw_sheet(part: Extract, blocks: Iterable[RawArray]) -> Sheet:
    """Return samples as a sheet of stored values; scale, offset and unit of each column are its attributes."""
    kind = np.dtype(sample_type(part.dtype))
    names = distinct([TIME.name, *(c.name for c in part.info.channels)])[1:]
    columns = tuple(
        Column(
            name,
            kind,
            {
                "channel": c.name,
                "quantity": c.quantity.value,
                "unit": c.unit,
                "scale": repr(float(c.scale)),
                "offset": repr(float(c.offset)),
            },
        )
        for name, c in zip(names, part.info.channels, strict=True)
    )
    about = {**_described(part), "values": "raw: value = scale*(raw - offset)"}
    return Sheet((TIME, *columns), about, part.stop - part.start, _timed(part, blocks, 1))


def _described(part: Extract) -> dict[str, str]:
    """Facts of a recording for the reader of a sheet, with the bench time at which its column of time is zero."""
    return {
        **describe(part),
        "time_s_counts_from": "the first sample of the whole recording",
        "bench_time_of_time_s_0": repr(float(part.info.start_s)),
    }


def physical_sheet(part: Extract, blocks: Iterable[RawArray], treatment: Treatment | None = None) -> Sheet:
    """Return samples as a sheet in SI units, corrected and decimated by the `treatment` (None: neither). Raises
    `BadParameter` for a calibration that does not fit the channels.
    """
    asked = treatment or Treatment()
    if not 1 <= asked.decimate <= LARGEST_FACTOR:
        raise BadParameter("decimate", asked.decimate, f"1 … {LARGEST_FACTOR}")
    rows = (part.stop - part.start) // asked.decimate
    if not rows and part.stop > part.start:
        allowed = f"1 … {part.stop - part.start}: recording {part.info.id} has no more samples there"
        raise BadParameter("decimate", asked.decimate, allowed)
    units = [c.rate_unit for c in part.info.channels]
    about = {**_described(part), "values": "physical", "decimated_by": str(asked.decimate)}
    about["rate_hz"] = repr(part.info.rate_hz / asked.decimate)
    places: list[tuple[list[int], Array, Array]] = []
    for calibration, known in zip(asked.calibrations, asked.calibration_ids, strict=True):
        place = _place(part, calibration)
        inverse = np.asarray(np.linalg.inv(calibration.matrix_array), dtype=np.float64)
        places.append((place, calibration.bias_array, inverse))
        about[f"{CALIBRATION}{calibration.triad}"] = known
        about[f"{CORRECTION}{calibration.triad}"] = _formula(calibration)
        for index in place:
            units[index] = calibration.input_unit
    by_temperature = stages(part, asked.corrections)
    columns = _physical_columns(part, units, about, asked)
    for correction, known in zip(asked.corrections, asked.correction_ids, strict=True):
        about |= {f"{TEMPERATURE}{correction.kind}": known, f"fitted_range_{correction.kind}": fitted_range(correction)}
        about["sensors"] = SENSORS_AS_READ
    scale = NominalScale.of(part.info.channels, part.info.rate_hz)
    values = _means(_corrected(blocks, scale, by_temperature, places), asked.decimate)
    return Sheet((TIME, *columns), about, rows, _timed(part, values, asked.decimate))


def _physical_columns(
    part: Extract, units: list[str], about: Mapping[str, str], asked: Treatment
) -> tuple[Column, ...]:
    """Columns in SI: the quantity is that of the numbers, a rate where the channel gives increments."""
    wanted = [f"{c.name}_{IN_NAMES[unit]}" for c, unit in zip(part.info.channels, units, strict=True)]
    columns: list[Column] = []
    for name, channel, unit in zip(distinct([TIME.name, *wanted])[1:], part.info.channels, units, strict=True):
        quantity = RATE_OF.get(channel.quantity, channel.quantity)
        said = {"channel": channel.name, "quantity": quantity.value, "unit": unit}
        triad = next((t for t, axes in TRIADS.items() if channel.name in axes), "")
        pairs = zip(asked.corrections, asked.correction_ids, strict=True)
        by = [known for one, known in pairs if channel.name in corrected_channels(one)]
        if by := [*by, *([about[f"{CALIBRATION}{triad}"]] if f"{CALIBRATION}{triad}" in about else [])]:
            said["corrected_by"] = ", ".join(by)
        columns.append(Column(name, np.dtype(np.float64), said))
    return tuple(columns)


def _formula(calibration: TriadCalibration) -> str:
    return f"v = inv(K)*(u - b), b = {list(calibration.bias)}, K = {[list(row) for row in calibration.matrix]}"


def _place(part: Extract, calibration: TriadCalibration) -> list[int]:
    """Columns of a triad x, y, z. Raises `BadParameter` where they are absent or in another unit."""
    names = [c.name for c in part.info.channels]
    missing = [name for name in TRIADS[calibration.triad] if name not in names]
    if missing:
        allowed = f"calibrations of triads that are exported whole: {', '.join(missing)} not among the channels"
        raise BadParameter("corrected_by", calibration.triad, allowed)
    place = [names.index(name) for name in TRIADS[calibration.triad]]
    found = {part.info.channels[index].rate_unit for index in place}
    if found != {calibration.output_unit}:
        allowed = f"a calibration of outputs in {', '.join(sorted(found))}; this one is of outputs in "
        raise BadParameter("corrected_by", calibration.triad, allowed + calibration.output_unit)
    return place


def _corrected(
    blocks: Iterable[RawArray],
    scale: NominalScale,
    by_temperature: Sequence[Stage],
    places: list[tuple[list[int], Array, Array]],
) -> Iterator[Array]:
    for block in blocks:
        values = scale.rates(np.asarray(block, dtype=np.float64))
        read = values.copy() if by_temperature else values
        for stage in by_temperature:
            stage(values, read)
        for place, bias, inverse in places:
            values[:, place] = (values[:, place] - bias) @ inverse.T
        yield values


def _means(blocks: Iterable[Array], factor: int) -> Iterator[Array]:
    """Means of `factor` rows each, across the borders of blocks; a missing sample makes its mean missing."""
    if factor == 1:
        yield from blocks
        return
    rest: Array | None = None
    for block in blocks:
        rows = block if rest is None else np.concatenate([rest, block])
        whole = len(rows) // factor * factor
        rest = rows[whole:].copy()
        if whole:
            yield rows[:whole].reshape(-1, factor, rows.shape[1]).mean(axis=1)


def _timed(part: Extract, blocks: Iterable[np.ndarray], factor: int) -> Iterator[tuple[np.ndarray, ...]]:
    """Rows with their times: of a sample its beginning, of a mean that of its samples' times."""
    done = 0
    for block in blocks:
        number = part.start + (np.arange(done, done + len(block)) * factor) + (factor - 1) / 2
        yield (number / part.info.rate_hz, *(np.ascontiguousarray(column) for column in block.T))
        done += len(block)
