"""Tables and figures of a dynamic response."""

from procedures.analysis.response.summary import ChannelResponse, DynamicResponse
from procedures.core.report import Figure, Report, Series, Table


def response_report(found: DynamicResponse) -> Report:
    """Return the report: delays and bandwidths, then gain and phase of each channel over the frequency."""
    figures = [f for c in found.channels for f in (_gains(c), _phases(c))]
    return Report(" ".join(map(_sentence, found.channels)), (_delays(found), *figures, _points(found)))


def _sentence(c: ChannelResponse) -> str:
    delay = f"{1e3 * c.delay_s:.4g} ± {1e3 * c.delay_standard_uncertainty_s:.2g} ms"
    return f"{c.channel}: delay {delay}, bandwidth {_bandwidth(c)}."


def _bandwidth(c: ChannelResponse) -> str:
    if c.bandwidth_hz is None:
        return f"not reached: above {c.bandwidth_above_hz:.3g} Hz (95 %)"
    beyond = ", beyond the highest frequency, by the model of one lag" if c.extrapolated else ""
    return f"{c.bandwidth_hz:.4g} ± {c.bandwidth_standard_uncertainty_hz:.2g} Hz{beyond}"


def _delays(found: DynamicResponse) -> Table:
    rows = tuple(
        (
            *(c.channel, c.gain, c.gain_standard_uncertainty, 1e3 * c.delay_s, 1e3 * c.delay_standard_uncertainty_s),
            *(1e3 * c.delay_from_noise_s, 1e3 * c.delay_from_encoder_s),
            *(None if c.time_constant_s is None else 1e3 * c.time_constant_s, _bandwidth(c), c.p_value),
            *(c.clock_difference_ppm, c.clock_difference_standard_uncertainty_ppm),
        )
        for c in found.channels
    )
    columns = (
        *("channel", "gain", "± standard uncertainty", "delay, ms", "± standard uncertainty, ms"),
        *("of noise, ms", "of the encoder's time, ms", "time constant, ms", "bandwidth, −3 dB", "p-value"),
        *("unit's clock, ppm", "± standard uncertainty, ppm"),
    )
    note = (
        "Delay of the middle of a sample's interval, by the recording's stamps, against the encoder; of slow motion: a "
        f"pure delay and a lag together. Delays of recordings scatter by {1e3 * found.stamp_scatter_s:.3g} ms beyond "
        f"the noise. The encoder was read within ±{1e3 * found.encoder_within_s:.3g} ms."
    )
    return Table("Delay and bandwidth of the gyros", columns, rows, note)


def _frequencies(c: ChannelResponse) -> tuple[float, ...]:
    return tuple(p.frequency_hz for p in c.points)


def _gains(c: ChannelResponse) -> Figure:
    x = _frequencies(c)
    measured = tuple(p.gain / c.gain for p in c.points)
    series = (
        Series("measured", x, measured, tuple(p.gain_sd / c.gain for p in c.points)),
        Series("model", x, tuple(p.modelled_gain / c.gain for p in c.points), style="line"),
    )
    return Figure(f"Gain of {c.channel} over that of slow motion", "frequency, Hz", "relative gain", series, x_log=True)


def _phases(c: ChannelResponse) -> Figure:
    x = _frequencies(c)
    series = (
        Series("measured", x, tuple(p.phase_deg for p in c.points), tuple(p.phase_sd_deg for p in c.points)),
        Series("model", x, tuple(p.modelled_phase_deg for p in c.points), style="line"),
    )
    return Figure(f"Phase of {c.channel} against the encoder", "frequency, Hz", "phase, deg", series, x_log=True)


def _points(found: DynamicResponse) -> Table:
    rows = tuple(
        (
            *(c.channel, p.frequency_hz, p.amplitude_deg, p.gain, p.gain_sd, p.phase_deg, p.phase_sd_deg),
            p.noise_ratio,
        )
        for c in found.channels
        for p in c.points
    )
    columns = (
        *("channel", "frequency, Hz", "amplitude, deg", "gain", "± sd", "phase, deg", "± sd, deg"),
        "noise over the record's",
    )
    return Table("Response at each frequency", columns, rows)
