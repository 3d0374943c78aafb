"""Results of a dynamic response, as plain JSON-ready numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp, hypot, isfinite, sqrt

import numpy as np

from procedures.analysis.least_squares.chi_square import tail_probability
from procedures.analysis.response.fit import LEVEL, PARAMETERS, Lag, Lags, fit_lags, gain_p_value, model, unwrapped
from procedures.analysis.response.pace import CLOCK_SIGMAS, require_measured_pace, require_pace
from procedures.analysis.response.phasors import Response, response
from procedures.analysis.response.trace import samples_of
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.frames import table_rotation
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import GYRO, Recording
from procedures.core.table_angles import TableAngles

MORE_NOISE = 1e-4
"""Probability below which the noise beside a sinusoid is more than the record's: then it counts in its place."""


@dataclass(frozen=True)
class ResponsePoint:
    """Response at one frequency, with its standard uncertainties and the fitted model."""

    frequency_hz: float
    amplitude_deg: float
    """Amplitude by the encoder."""
    gain: float
    """Rate by the gyro over rate by the encoder, nominal scale factor."""
    gain_sd: float
    phase_deg: float
    """Phase of the gyro before the encoder: negative where it is late."""
    phase_sd_deg: float
    modelled_gain: float
    modelled_phase_deg: float
    noise_ratio: float
    """Power of the noise beside the sinusoid over that of the unit's record and of the encoder's scatter."""


@dataclass(frozen=True)
class ChannelResponse:
    """Delay and bandwidth of one gyro channel against the encoder."""

    channel: str
    gain: float
    """Gain of slow motion by the nominal scale factor."""
    gain_standard_uncertainty: float
    delay_s: float
    """Delay of the samples against their stamps, of slow motion: pure delay and lag together [s]."""
    delay_standard_uncertainty_s: float
    delay_from_noise_s: float
    """Part of that uncertainty by noise, and by stamps that scatter from recording to recording."""
    delay_from_encoder_s: float
    """Part of that uncertainty by the time of the encoder's readings."""
    delay_from_clock_s: float
    """Part of that uncertainty by the unit's clock, where that differs from the bench's: the delay is another at each
    moment of a recording, from its begin to its end by ``drift·T``, and counts as a rectangle's ``drift·T/√12``."""
    delay_degrees_of_freedom: int | None
    """Degrees of freedom of the uncertainty where the stamps' scatter was estimated; None: so many that none counts."""
    time_constant_s: float | None
    """Time constant of a first-order lag [s]; None: none shows."""
    time_constant_standard_uncertainty_s: float | None
    bandwidth_hz: float | None
    """Frequency of −3 dB by the fitted lag [Hz]; None: not reached, above `bandwidth_above_hz`."""
    bandwidth_standard_uncertainty_hz: float | None
    bandwidth_above_hz: float
    """Frequency above which the bandwidth lies with 95 % [Hz]."""
    extrapolated: bool
    """True where the bandwidth lies beyond the highest frequency, so that it rests on the model of one lag."""
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None
    gain_p_value: float | None
    """Chance of the gains' residuals alone: small where the response is not that of one lag."""
    clock_difference_ppm: float
    """The unit's clock against the bench's, by the drift of the phases; positive: the unit falls behind."""
    clock_difference_standard_uncertainty_ppm: float
    points: tuple[ResponsePoint, ...]


@dataclass(frozen=True)
class DynamicResponse:
    """Results of a dynamic response for all channels, with the scatter of the stamps and warnings."""

    channels: tuple[ChannelResponse, ...]
    stamp_scatter_s: float
    """Standard deviation of the delay from recording to recording beyond the noise [s]; 0: none shows."""
    p_value_without_scatter: float | None
    encoder_within_s: float
    """Mean of half the intervals in which the encoder was read [s]."""
    warnings: tuple[str, ...]


def analyse_response(
    recordings: Sequence[Recording],
    noise: Mapping[str, NoiseCoefficients],
    linearity: float,
    encoder_time_sd_s: float,
) -> DynamicResponse:
    """Responses of the gyro channel along each station's axis. `noise` by channel; one that lacks: not known.

    Raises `UnfitRecording`, `MissingChannel`.
    """
    by_channel: dict[str, list[Response]] = {}
    warnings: list[str] = []
    for recording in recordings:
        channel, directions, frequency_hz = _swung(recording)
        require_measured_pace(recording.info)
        samples = samples_of(recording, channel, directions)
        found = response(samples, frequency_hz, noise.get(channel))
        require_pace(samples, found)
        by_channel.setdefault(channel, []).append(_with_its_noise(found, warnings))
    for channel, responses in by_channel.items():
        if (count := len({r.frequency_hz for r in responses})) < PARAMETERS:
            raise UnfitRecording(f"{channel}: a delay and a lag need {PARAMETERS} frequencies, there are {count}")
    lags = fit_lags(by_channel, linearity)
    within = float(np.mean([r.within_s for responses in by_channel.values() for r in responses]))
    encoder_sd = hypot(within / sqrt(3.0), encoder_time_sd_s)
    freedom = sum(lag.phase_freedom for lag in lags.lags)
    pairs = zip(by_channel.items(), lags.lags, strict=True)
    channels = tuple(
        _channel(name, responses, lag, encoder_sd, lags.scatter_s, freedom) for (name, responses), lag in pairs
    )
    warnings += _of_scatter(lags) + [w for c in channels for w in _of_channel(c)]
    return DynamicResponse(channels, lags.scatter_s, lags.p_value_without, within, tuple(warnings))


def _swung(recording: Recording) -> tuple[str, list[float], float]:
    """The gyro channel nearest to the outer axis, the parts of the table's axes along it, and the frequency [Hz]."""
    station = recording.info.station
    if station is None or station.sinusoid is None or station.angles is None or station.sinusoid.axis != "outer":
        raise UnfitRecording(f"recording {recording.info.id}: its station has no sinusoid of the outer axis")
    axes_b = table_axes_b(station.angles)
    nearest = int(np.argmax(np.abs(axes_b[0])))
    return GYRO[nearest], axes_b[:, nearest].tolist(), station.sinusoid.frequency_hz


def table_axes_b(angles: TableAngles) -> Array:
    """Return the directions of outer, middle and inner axis in the unit's axes, a row each, (3, 3); see
    `core.frames.table_rotation`.
    """
    within_middle = table_rotation(TableAngles(0.0, 0.0, angles.inner_deg)).inv()
    outer = table_rotation(angles).inv().apply(np.array([0.0, 1.0, 0.0]))
    return np.array([outer, within_middle.apply(np.array([0.0, 0.0, 1.0])), [1.0, 0.0, 0.0]])


def _with_its_noise(found: Response, warnings: list[str]) -> Response:
    """The response with the noise that is beside it, where the record's does not explain that."""
    degrees = round(found.noise_degrees)
    if degrees == 0 or tail_probability(found.noise_ratio * degrees, degrees) >= MORE_NOISE:
        return found
    warnings.append(
        f"station {found.label}: the noise beside the sinusoid has {found.noise_ratio:.3g} times the power that the "
        "unit's record and the encoder's scatter let expect; it counts in their place"
    )
    factor = sqrt(found.noise_ratio)
    more = {name: factor * getattr(found, name) for name in ("gain_sd", "phase_sd", "drift_sd")}
    return replace(found, **more)


def _of_scatter(lags: Lags) -> list[str]:
    if lags.scatter_s == 0.0:
        return []
    return [
        f"the delay differs from recording to recording by {1e3 * lags.scatter_s:.3g} ms beyond the noise: the stamps "
        "of the unit's samples are no better than that, and the uncertainties allow for it"
    ]


def _of_channel(c: ChannelResponse) -> list[str]:
    found: list[str] = []
    if c.gain_p_value is not None and c.gain_p_value < LEVEL:
        found.append(
            f"{c.channel}: the gains are not those of one lag (p = {c.gain_p_value:.2g}): delay and bandwidth are "
            "what that model makes of them"
        )
    ppm, sd = c.clock_difference_ppm, c.clock_difference_standard_uncertainty_ppm
    if abs(ppm) > CLOCK_SIGMAS * sd:
        found.append(
            f"{c.channel}: the unit's clock differs from the bench's by {ppm:.4g} ± {sd:.2g} ppm; the delay is that "
            "of the recordings' middles, and its uncertainty allows for the others"
        )
    return found


def _channel(
    name: str, responses: Sequence[Response], lag: Lag, encoder_sd_s: float, scatter_s: float, freedom: int
) -> ChannelResponse:
    gain = exp(lag.log_gain)
    constant_s, constant_sd_s = lag.time_constant_s or (None, None)
    bandwidth_hz, bandwidth_sd_hz = lag.bandwidth_hz or (None, None)
    highest = max(r.frequency_hz for r in responses)
    drift, drift_sd = _clock(responses)
    differs = abs(drift) > CLOCK_SIGMAS * drift_sd
    clock_sd_s = abs(drift) * float(np.mean([r.length_s for r in responses])) / sqrt(12.0) if differs else 0.0
    return ChannelResponse(
        channel=name,
        gain=gain,
        gain_standard_uncertainty=gain * sqrt(float(lag.covariance[0, 0])),
        delay_s=lag.delay_s,
        delay_standard_uncertainty_s=hypot(lag.delay_sd_s, encoder_sd_s, clock_sd_s),
        delay_from_noise_s=lag.delay_sd_s,
        delay_from_encoder_s=encoder_sd_s,
        delay_from_clock_s=clock_sd_s,
        delay_degrees_of_freedom=freedom if scatter_s > 0.0 else None,
        time_constant_s=constant_s,
        time_constant_standard_uncertainty_s=constant_sd_s,
        bandwidth_hz=bandwidth_hz,
        bandwidth_standard_uncertainty_hz=bandwidth_sd_hz,
        bandwidth_above_hz=lag.bandwidth_above_hz,
        extrapolated=bandwidth_hz is not None and bandwidth_hz > highest,
        chi_square=lag.chi_square,
        degrees_of_freedom=lag.degrees_of_freedom,
        p_value=lag.p_value,
        gain_p_value=gain_p_value(lag),
        clock_difference_ppm=drift / units.PPM,
        clock_difference_standard_uncertainty_ppm=drift_sd / units.PPM,
        points=_points(responses, lag, scatter_s),
    )


def _clock(responses: Sequence[Response]) -> tuple[float, float]:
    """Weighted mean of the drifts and its standard uncertainty, relative."""
    known = [r for r in responses if isfinite(r.drift_sd) and r.drift_sd > 0.0]
    if not known:
        return 0.0, 0.0
    weights = np.array([r.drift_sd**-2 for r in known])
    mean = float(weights @ np.array([r.drift for r in known]) / weights.sum())
    return mean, float(weights.sum() ** -0.5)


def _points(responses: Sequence[Response], lag: Lag, scatter_s: float) -> tuple[ResponsePoint, ...]:
    ordered = sorted(responses, key=lambda r: r.frequency_hz)
    omega = np.array([r.omega for r in ordered])
    gains, phases = model(np.array([lag.log_gain, lag.delay_s, lag.q_s2]), omega)
    measured = unwrapped(np.angle([r.value for r in ordered]), omega)
    return tuple(
        ResponsePoint(
            frequency_hz=r.frequency_hz,
            amplitude_deg=r.amplitude_rad / units.DEG,
            gain=abs(r.value),
            gain_sd=abs(r.value) * r.gain_sd,
            phase_deg=float(measured[k]) / units.DEG,
            phase_sd_deg=hypot(r.phase_sd, r.omega * scatter_s) / units.DEG,
            modelled_gain=exp(float(gains[k])),
            modelled_phase_deg=float(phases[k]) / units.DEG,
            noise_ratio=r.noise_ratio,
        )
        for k, r in enumerate(ordered)
    )
