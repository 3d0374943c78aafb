"""Figure of a channel's power spectral density with the noise model's lines."""

from collections.abc import Callable, Sequence
from math import pi, sin

from procedures.analysis.launch.results import ChannelNoise
from procedures.core.report import Figure, Series
from procedures.core.units import DEVIATION_DISPLAY

LINES: dict[str, Callable[[float, float], float]] = {
    "quantization": lambda f, period_s: 8.0 * sin(pi * f * period_s) ** 2 / period_s,
    "random_walk": lambda _f, _: 2.0,
    "bias_instability": lambda f, _: 1.0 / (pi * f),
    "rate_random_walk": lambda f, _: 2.0 / (2.0 * pi * f) ** 2,
}
"""One-sided density of each process for a coefficient of one, at f [Hz] of samples of a period [s].

IEEE Std 952 Annex C, which gives two-sided ones. Quantization is the difference of two readings of independent errors
over a period: ``2Δt·|1 − e^{−i2πfΔt}|²/Δt²``, at low frequencies ``2·(2πf)²·Δt``.
"""


def density_figure(channels: Sequence[ChannelNoise], labels: Sequence[str]) -> Figure | None:
    """Return the figure of the first launch's density with interval and model, with the other launches; None in results
    without it.
    """
    first = channels[0]
    found = [(c.density, label) for c, label in zip(channels, labels, strict=True) if c.density is not None]
    if first.density is None or not found:
        return None
    unit, size = DEVIATION_DISPLAY[first.rate_unit]
    d = first.density
    interval = Series("interval", d.frequency_hz, _in(d.lower, size), style="band", upper=_in(d.upper, size))
    curves = tuple(Series(label, c.frequency_hz, _in(c.density, size), style="line") for c, label in found)
    note = "One-sided. Dashed: each process that was observed, at its efficient estimate. Lines taken out are left out."
    return Figure(
        f"Power spectral density of {first.channel}",
        "f, Hz",
        f"S, ({unit})²/Hz",
        (interval, *curves, *_model(first, size)),
        True,
        True,
        note,
    )


def _model(channel: ChannelNoise, size: float) -> tuple[Series, ...]:
    """The line of each observed process where it is at least a tenth of the density."""
    assert channel.density is not None
    pairs = tuple(zip(channel.density.frequency_hz, channel.density.density, strict=True))
    period_s = 0.5 / channel.bandwidth_hz
    made: list[Series] = []
    for process, of_one in LINES.items():
        value = channel.coefficient(process).likelihood.value
        if value:
            line = [(f, s, value**2 * of_one(f, period_s)) for f, s in pairs]
            on = [(f, own) for f, s, own in line if own > 0.1 * s]
            title = process.replace("_", " ")
            made.append(Series(title, tuple(f for f, _ in on), _in([s for _, s in on], size), style="reference"))
    return tuple(made)


def _in(values: Sequence[float], size: float) -> tuple[float, ...]:
    return tuple(v / size**2 for v in values)
