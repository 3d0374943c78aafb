"""Models of a converter alone from its recordings: currents of both signs at each soak (thesis 3.8–3.17; paper C).

The two stations of a soak are minutes apart, so the sensor does not read quite the same at both. Codes are brought to
the mean of the two readings with the model itself, which is fitted again; the drift within a soak being small, it has
settled after `PASSES`. The order of each function is the highest whose last term an F test finds (`LEVEL`): with the
ten or so values that a bench gives, the Bayesian criterion took an order too many in a quarter of the functions.

The source's errors are constant over the job: a gain g and a zero z make ``K0·(1 + g)`` and ``N0 + K0·z`` of the model,
and leave Fc and the change Fs as they are. So its declared accuracy adds to the variances of K0 and N0 alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from procedures.analysis.cells import cell_means
from procedures.analysis.thermal.converter import ZeroAndScale, zero_and_scale
from procedures.analysis.thermal.normalised import fit_normalised
from procedures.analysis.thermal.order import f_test
from procedures.core.arrays import Array
from procedures.core.converter import ConverterModel, Normalised
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.recording import AXES, Recording

SENSOR = "temperature_converter"
CHANNELS = tuple(f"converter_{axis}" for axis in AXES)
PASSES = 3
FOLLOWS = 0.5
"""Least change of the sensor from one soak to the next, relative to the chamber's."""


@dataclass(frozen=True)
class ConverterSoaks:
    """Means of n soaks, in the order that they were measured."""

    target_c: Array
    """Target temperatures of the chamber, (n,)."""
    sensor_c: Array
    """Converter's own sensor at +I and at −I, (n, 2)."""
    codes: Array
    """Mean codes a cycle at +I and at −I of x, y, z, (n, 2, 3)."""


@dataclass(frozen=True)
class Fitted:
    """Normalised function of a channel, and the tests that chose its order."""

    value: Normalised
    bic: tuple[float, ...]
    """Bayesian criterion of orders 1, 2, …, for comparison."""
    p_values: tuple[float, ...]
    """F tests of order 2 against 1, of 3 against 2: the chance of as much gain from noise alone."""


@dataclass(frozen=True)
class FittedChannel:
    """Model of one channel with the data that it was fitted to, (n,) each."""

    scale: Fitted
    zero: Fitted
    sensor_c: Array
    scale_code_per_ma: Array
    zero_code: Array
    zero_ma: Array

    @property
    def model(self) -> ConverterModel:
        return ConverterModel(self.scale.value, self.zero.value)


def read_soaks(recordings: Sequence[Recording], current_ma: float) -> ConverterSoaks:
    """Means of recordings at +I, −I, +I, … with the stations' currents and profiles.

    Raises `UnfitRecording` where a pair is not complete or the sensor does not follow the chamber, `MissingChannel`.
    """
    targets: list[float] = []
    sensor, codes = np.empty((len(recordings) // 2, 2)), np.empty((len(recordings) // 2, 2, 3))
    if len(recordings) % 2:
        raise UnfitRecording(f"{len(recordings)} recordings: both currents are needed at every soak")
    for k, recording in enumerate(recordings):
        info = recording.info
        wanted = current_ma if k % 2 == 0 else -current_ma
        station = info.station
        if station is None or station.current_ma != wanted or station.temperature_c is None:
            raise UnfitRecording(f"recording {info.id} is not that of a soak at {wanted:g} mA")
        mean = cell_means(recording, (*CHANNELS, SENSOR), info.duration_s).rates[:, 0]
        sensor[k // 2, k % 2], codes[k // 2, k % 2] = mean[3], mean[:3]
        if k % 2 == 0:
            targets.append(station.temperature_c)
    found = ConverterSoaks(np.array(targets), sensor, codes)
    moved, asked = np.diff(sensor.mean(axis=1)), np.diff(found.target_c)
    lazy = np.flatnonzero(np.abs(moved) < FOLLOWS * np.abs(asked))
    if lazy.size:
        k = int(lazy[0])
        raise UnfitRecording(
            f"{SENSOR} went by {moved[k]:.2f} °C from the soak at {targets[k]:g} °C to that at {targets[k + 1]:g} °C: "
            "it is stuck, or the converter had not soaked"
        )
    return found


def fit_channels(
    soaks: ConverterSoaks,
    current_ma: float,
    reference_c: float,
    order: int | None,
    gain_sd_ppm: float = 0.0,
    zero_sd_ma: float = 0.0,
) -> tuple[FittedChannel, FittedChannel, FittedChannel]:
    """Return the models of x, y, z; `order` None: chosen for each function. Raises as `zero_and_scale` and
    `fit_normalised`.
    """
    x, y, z = (
        _channel(soaks.codes[:, :, axis], soaks.sensor_c, current_ma, reference_c, order, gain_sd_ppm, zero_sd_ma)
        for axis in range(3)
    )
    return x, y, z


def _channel(
    codes: Array,
    sensor_c: Array,
    current_ma: float,
    reference_c: float,
    order: int | None,
    gain_sd_ppm: float,
    zero_sd_ma: float,
) -> FittedChannel:
    mean_c = sensor_c.mean(axis=1)

    def fitted(brought: Array) -> tuple[ZeroAndScale, Fitted, Fitted]:
        found = zero_and_scale(current_ma, brought[:, 0], brought[:, 1])
        scale = _fitted(mean_c, found.scale_code_per_ma, reference_c, order, relative=True)
        return found, scale, _fitted(mean_c, found.zero_code, reference_c, order, relative=False)

    found, scale, zero = fitted(codes)
    for _ in range(PASSES):
        model = ConverterModel(scale.value, zero.value)
        signed = (current_ma, -current_ma)
        drift = [model.code(i, sensor_c[:, s]) - model.code(i, mean_c) for s, i in enumerate(signed)]
        found, scale, zero = fitted(codes - np.column_stack(drift))
    k0 = scale.value.at_reference
    return FittedChannel(
        replace(scale, value=_with_source(scale.value, 1e-6 * gain_sd_ppm * k0)),
        replace(zero, value=_with_source(zero.value, k0 * zero_sd_ma)),
        mean_c,
        found.scale_code_per_ma,
        found.zero_code,
        found.zero_ma,
    )


def _with_source(found: Normalised, sd: float) -> Normalised:
    """The function with the source's standard uncertainty in the variance of its value at the reference."""
    covariance = np.array(found.covariance)
    covariance[0, 0] += sd**2
    return replace(found, covariance=tuple(tuple(row) for row in covariance.tolist()))


LARGEST_ORDER = 3
LEAST_FREE = 3
"""Degrees of freedom that a chosen order must leave: with fewer a small residual is often chance."""
LEVEL = 0.01
"""Significance level of the test that adds an order."""


def _fitted(sensor_c: Array, values: Array, reference_c: float, order: int | None, relative: bool) -> Fitted:
    count = len(values)
    orders = [q for q in range(1, LARGEST_ORDER + 1) if count >= q + 1 + LEAST_FREE]
    if not orders:
        raise BadParameter("temperatures_c", count, f"at least {2 + LEAST_FREE} soaks")
    fits = [fit_normalised(sensor_c, values, reference_c, q, relative) for q in orders]
    left = [_squares(fit.residual_sd, count, q) for fit, q in zip(fits, orders, strict=True)]
    bic = tuple(_criterion(rss, count, q) for rss, q in zip(left, orders, strict=True))
    p_values = tuple(f_test(left[q - 1], left[q], q + 1, q + 2, count) for q in orders[:-1])
    chosen = max((q + 1 for q, p in zip(orders, p_values, strict=False) if p <= LEVEL), default=1)
    if order is not None:
        chosen = order
    value = fits[chosen - 1] if chosen in orders else fit_normalised(sensor_c, values, reference_c, chosen, relative)
    return Fitted(value, bic, p_values)


def _squares(residual_sd: float, count: int, order: int) -> float:
    """Sum of the squared residuals, of a fit without any 1e-300."""
    return max(residual_sd**2 * (count - order - 1), 1e-300)


def _criterion(rss: float, count: int, order: int) -> float:
    """Bayesian information criterion ``n·ln(rss/n) + k·ln n``."""
    return count * float(np.log(rss / count)) + (order + 1) * float(np.log(count))
