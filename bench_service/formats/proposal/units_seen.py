"""Units and scales compared with what a unit at rest must show: |f| near g."""

from collections.abc import Sequence
from dataclasses import replace
from math import sqrt

import numpy as np

from bench_service.formats.input_units import stored_channel
from bench_service.formats.logs.table import LogColumn
from bench_service.formats.proposal.inspection import Values
from procedures.core.recording import ACCELEROMETER, GYRO, Quantity
from procedures.core.units import STANDARD_GRAVITY

_FORCE_UNITS = {"m/s^2": STANDARD_GRAVITY, "g": 1.0, "mg": 1e3, "mm/s^2": 1e3 * STANDARD_GRAVITY}
"""Size of gravity in each unit."""
_NEAR = 0.1
FACTORS = (0.5, 2.0, 4.0, 5.0, 10.0)
"""Factors by which a wrong rate, or a wrong number of summed samples, changes increments."""
_FASTEST_RAD_S = 40.0


def with_units(
    columns: Sequence[LogColumn], values: Values, rate_hz: float | None
) -> tuple[list[LogColumn], list[str], list[str]]:
    """Return the columns, those without a unit with the likely one; sentences on what is not known; and notes."""
    asks: list[str] = []
    notes: list[str] = []
    found = list(columns)
    for kind, names in (("gyros", GYRO), ("accelerometers", ACCELEROMETER)):
        places = [i for i, c in enumerate(found) if c.channel in names and c.unit is None]
        if not places:
            continue
        quantity = found[places[0]].quantity
        if counts := _counts(found, places, values):
            unit, sure, why = "count", False, counts
        elif quantity is Quantity.SPECIFIC_FORCE:
            unit, sure, why = _force_unit(found, places, values)
        elif quantity is Quantity.VELOCITY_INCREMENT:
            unit, sure, why = "m/s", False, "increments"
        elif quantity is Quantity.ANGLE_INCREMENT:
            unit, sure, why = "rad", False, "increments"
        else:
            most = float(max(values.largest[i] * abs(found[i].scale) for i in places))
            unit = "deg/s" if most > _FASTEST_RAD_S else "rad/s"
            sure, why = False, f"the largest value is {most:.4g}"
        named = [found[i].name for i in places]
        words = f"the unit of the {kind} ({', '.join(named)}) is not said; taken as {unit} ({why})"
        (notes if sure else asks).append(words)
        for i in places:
            source = f"{found[i].source}, the unit a guess"
            found[i] = replace(found[i], unit=unit, source=source, unit_doubt="" if sure else words)
    for i, column in enumerate(found):
        if column.unit is None and column.quantity is Quantity.TEMPERATURE:
            words = f"the unit of {column.name} is not said; taken as degC"
            source = f"{column.source}, the unit a guess"
            found[i] = replace(column, unit="degC", source=source, unit_doubt=words)
            asks.append(words)
    return found, asks, notes


def _counts(columns: Sequence[LogColumn], places: Sequence[int], values: Values) -> str:
    """Say why columns are taken for counts: whole numbers whose unit gravity does not tell; empty: they are not."""
    whole = all(values.whole[i] and columns[i].scale == 1.0 for i in places)
    if not whole or not any(values.largest[i] > 1.0 for i in places):
        return ""
    if columns[places[0]].quantity is Quantity.SPECIFIC_FORCE and _force_unit(columns, places, values)[1]:
        return ""
    return "whole numbers, as a converter gives them; give unit and scale, or leave the counts to a calibration"


def _force_unit(columns: Sequence[LogColumn], places: Sequence[int], values: Values) -> tuple[str, bool, str]:
    size = sqrt(sum((columns[i].scale * float(values.means[i])) ** 2 for i in places))
    for unit, gravity in _FORCE_UNITS.items():
        if len(places) == 3 and abs(size / gravity - 1.0) < _NEAR:
            return unit, True, f"the mean of |f| is {size:.4g}, as of a unit at rest"
    return "m/s^2", False, f"the mean of |f| is {size:.4g}, which is near gravity in no unit"


def suspicions(columns: Sequence[LogColumn], values: Values, rate_hz: float | None) -> list[str]:
    """Return sentences about values that no unit of these scales at rest has, and about channels that do not move.
    `rate_hz` None: not known; increments are then not compared with gravity.
    """
    found = [
        f"channel {c.channel} ({c.name}) has one value throughout: {values.means[i]:.6g}"
        for i, c in enumerate(columns)
        if values.rows > 1 and values.deviations[i] == 0.0 and c.quantity is not Quantity.TEMPERATURE
    ]
    found += [
        f"channel {c.channel} ({c.name}) has {int(values.rows - values.finite[i])} rows without a finite value"
        for i, c in enumerate(columns)
        if values.finite[i] < values.rows
    ]
    size = _gravity_seen(columns, values, rate_hz)
    if size is not None and abs(size / STANDARD_GRAVITY - 1.0) > 3.0 * _NEAR:
        found.append(_gravity_words(size, any(c.quantity is Quantity.VELOCITY_INCREMENT for c in columns)))
    return found


def _gravity_seen(columns: Sequence[LogColumn], values: Values, rate_hz: float | None) -> float | None:
    """Mean specific force [m/s²] over all three axes; None: it cannot be computed."""
    square = 0.0
    axes = 0
    for i, column in enumerate(columns):
        if column.channel not in ACCELEROMETER or not isinstance(column.quantity, Quantity):
            continue
        channel = stored_channel("f", column.quantity, column.unit or "count", column.scale, column.offset)
        if channel.unit == "count" or not np.isfinite(values.means[i]):
            return None
        value = float(channel.value(float(values.means[i])))
        if column.quantity is Quantity.VELOCITY_INCREMENT:
            if rate_hz is None:
                return None
            value *= rate_hz
        square += value**2
        axes += 1
    return sqrt(square) if axes == 3 else None


def _gravity_words(size: float, increments: bool) -> str:
    ratio = size / STANDARD_GRAVITY
    words = f"the mean specific force is {size:.4g} m/s², {ratio:.3g} of gravity"
    if ratio < 0.05:
        return f"{words}: gravity seems to be taken off, or the scale is far too small"
    near = [f for f in FACTORS for r in (ratio * f,) if abs(r - 1.0) < _NEAR] + [
        1.0 / f for f in FACTORS if abs(ratio / f - 1.0) < _NEAR
    ]
    if near and increments:
        return f"{words}: off by a factor of {1.0 / near[0]:g}: the rate, or the number of samples summed, is wrong"
    return f"{words}: the unit moved all the time, or scale or unit are wrong" + (
        f" (a factor of {1.0 / near[0]:g})" if near else ""
    )
