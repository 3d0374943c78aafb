"""Phrases common to the sentences of all findings: number, place and amount."""

from collections.abc import Sequence
from dataclasses import dataclass

from procedures.core.recording import INCREMENTS, Channel
from procedures.core.units import DISPLAY

PLACES = 5
"""Most places that a sentence names; the number of further ones follows them."""


@dataclass(frozen=True)
class Wording:
    """Phrases on a recording of `seen` samples at `rate_hz`."""

    seen: int
    rate_hz: float

    def share(self, count: int) -> str:
        """Return the phrase "3 of 50000 samples", with the percentage where it is notable."""
        return f"{count} of {self.seen} samples" + (
            f" ({100.0 * count / self.seen:.3g} %)" if 1000 * count >= self.seen else ""
        )

    def at(self, index: int) -> str:
        """Return the phrase "7001 (70.01 s)": a sample and its time since the recording's beginning."""
        return f"{index} ({index / self.rate_hz:.6g} s)"

    def places(self, indices: Sequence[int], more: int = 0) -> str:
        """Return a phrase naming the first few samples; `more`: the number beyond those given."""
        shown = ", ".join(self.at(i) for i in indices[:PLACES])
        left = len(indices) - min(len(indices), PLACES) + more
        return f"{shown} and {left} more" if left else shown


def gain_of(channel: Channel, rate_hz: float) -> float:
    """Return the value of one raw unit in the channel's `rate_unit`."""
    return channel.scale * (rate_hz if channel.quantity in INCREMENTS else 1.0)


def amount(channel: Channel, rate_hz: float, raw: float) -> str:
    """Return a difference of raw values in display units, "12.3 deg/h", with the raw figure where it differs."""
    unit, size = DISPLAY.get(channel.rate_unit, (channel.rate_unit, 1.0))
    shown = f"{raw * gain_of(channel, rate_hz) / size:.4g} {unit}"
    return shown if gain_of(channel, rate_hz) == size else f"{shown} ({raw:.4g} raw)"
