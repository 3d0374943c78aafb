"""Samples as a sheet: a column of time and one a channel, with their units, in any format that people's tools read.

Raw samples are those stored. Physical ones are in SI, increments divided by the sample period, if wanted corrected by
calibrations ``v = K⁻¹·(U − b)`` and decimated by means; then a unit is part of a column's name too.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from bench_service.formats.chunk import sample_type
from bench_service.formats.export import Extract, describe
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.imu_model import TriadCalibration
from procedures.core.recording import TRIADS, NominalScale, RawArray

IN_NAMES = {"rad/s": "rad_per_s", "m/s^2": "m_per_s2", "degC": "degC", "rad": "rad", "s": "s", "count": "count"}
"""Unit -> its form in a column's name, which every tool takes as a name."""
LARGEST_FACTOR = 1_000_000


@dataclass(frozen=True)
class Column:
    """A column of a sheet with the attributes that travel with it."""

    name: str
    kind: np.dtype[np.generic]
    attributes: Mapping[str, str]


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


TIME = Column("time_s", np.dtype(np.float64), {"unit": "s", "quantity": "time since the first sample"})


def raw_sheet(part: Extract, blocks: Iterable[RawArray]) -> Sheet:
    """Return samples as a sheet of stored values; scale, offset and unit of each column are its attributes."""
    kind = np.dtype(sample_type(part.dtype))
    columns = tuple(
        Column(
            c.name,
            kind,
            {"quantity": c.quantity.value, "unit": c.unit, "scale": repr(c.scale), "offset": repr(c.offset)},
        )
        for c in part.info.channels
    )
    about = {**describe(part), "values": "raw: value = scale*(raw - offset)"}
    return Sheet((TIME, *columns), about, part.stop - part.start, _timed(part, blocks, 1))


def physical_sheet(part: Extract, blocks: Iterable[RawArray], treatment: Treatment | None = None) -> Sheet:
    """Return samples as a sheet in SI units, corrected and decimated by the `treatment` (None: neither). Raises
    `BadParameter` for a calibration that does not fit the channels.
    """
    asked = treatment or Treatment()
    if not 1 <= asked.decimate <= LARGEST_FACTOR:
        raise BadParameter("decimate", asked.decimate, f"1 … {LARGEST_FACTOR}")
    units = [c.rate_unit for c in part.info.channels]
    about = {**describe(part), "values": "physical", "decimated_by": str(asked.decimate)}
    about["rate_hz"] = repr(part.info.rate_hz / asked.decimate)
    places: list[tuple[list[int], Array, Array]] = []
    for calibration, known in zip(asked.calibrations, asked.calibration_ids, strict=True):
        place = _place(part, calibration)
        inverse = np.asarray(np.linalg.inv(calibration.matrix_array), dtype=np.float64)
        places.append((place, calibration.bias_array, inverse))
        about[f"calibration_{calibration.triad}"] = known
        for index in place:
            units[index] = calibration.input_unit
    columns = tuple(
        Column(
            f"{c.name}_{IN_NAMES[unit]}",
            np.dtype(np.float64),
            {"quantity": c.quantity.value, "unit": unit},
        )
        for c, unit in zip(part.info.channels, units, strict=True)
    )
    scale = NominalScale.of(part.info.channels, part.info.rate_hz)
    values = _means(_corrected(blocks, scale, places), asked.decimate)
    rows = (part.stop - part.start) // asked.decimate
    return Sheet((TIME, *columns), about, rows, _timed(part, values, asked.decimate))


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
    blocks: Iterable[RawArray], scale: NominalScale, places: list[tuple[list[int], Array, Array]]
) -> Iterator[Array]:
    for block in blocks:
        values = scale.rates(np.asarray(block, dtype=np.float64))
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
