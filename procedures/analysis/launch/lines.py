"""Spectral line of a launch, as a result keeps it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SpectralLine:
    """A line that was removed from the record before its noise was fitted."""

    frequency_hz: float
    amplitude: float
    """Amplitude of the sine [rate]."""
    origin: str = ""
    """The dither that it belongs to, by the unit's declared frequencies; empty where none are declared."""
