"""Words that the sentences of all findings share: how many samples, where, how much."""

from collections.abc import Sequence
from dataclasses import dataclass

from procedures.core.recording import INCREMENTS, Channel
from procedures.core.units import DISPLAY

PLACES = 5
"""Places that a sentence names; how many more there are stands behind them."""


@dataclass(frozen=True)
class Wording:
    """Of a recording of `seen` samples at `rate_hz`."""

    seen: int
    rate_hz: float

    def share(self, count: int) -> str:
        """ "3 of 50000 samples", with the percentage where it is worth saying."""
        return f"{count} of {self.seen} samples" + (
            f" ({100.0 * count / self.seen:.3g} %)" if 1000 * count >= self.seen else ""
        )

    def at(self, index: int) -> str:
        """ "7001 (70.01 s)": a sample and its time since the recording's beginning."""
        return f"{index} ({index / self.rate_hz:.6g} s)"

    def places(self, indices: Sequence[int], more: int = 0) -> str:
        """The first few samples; `more`: how many stand behind those given."""
        shown = ", ".join(self.at(i) for i in indices[:PLACES])
        left = len(indices) - min(len(indices), PLACES) + more
        return f"{shown} and {left} more" if left else shown


def gain_of(channel: Channel, rate_hz: float) -> float:
    """What one raw unit is in the channel's `rate_unit`."""
    return channel.scale * (rate_hz if channel.quantity in INCREMENTS else 1.0)


def amount(channel: Channel, rate_hz: float, raw: float) -> str:
    """A difference of raw values as people read it: "12.3 deg/h", with the raw figure where that is another."""
    unit, size = DISPLAY.get(channel.rate_unit, (channel.rate_unit, 1.0))
    shown = f"{raw * gain_of(channel, rate_hz) / size:.4g} {unit}"
    return shown if gain_of(channel, rate_hz) == size else f"{shown} ({raw:.4g} raw)"
