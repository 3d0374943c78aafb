"""Requirements of a job on its bench, before the bench is opened."""

from collections.abc import Sequence
from dataclasses import dataclass

from procedures.core.errors import BadParameter
from procedures.core.recording import Station


@dataclass(frozen=True)
class BenchNeeds:
    """Needs of a job on its bench: a sample rate, and the optional sensors and sources that it uses."""

    sample_rate_hz: float | None = None
    """Sample rate of the unit; None: its own rate."""
    temperatures: bool = False
    """True if the unit's temperature sensors are read. A simulated unit then senses its temperature too."""
    currents: bool = False
    """True if a converter alone is tested, with a current source on its inputs, instead of a whole unit."""
    real_time: bool = False
    """True if a person commands the bench: a simulated one is then no faster than real time, unless it is set
    fast it is."""

    @classmethod
    def of(cls, stations: Sequence[Station]) -> "BenchNeeds":
        """Return the needs of all stations of a job together. Raises `BadParameter` where they disagree."""
        rates = {station.sample_rate_hz for station in stations}
        if len(rates) > 1:
            raise BadParameter("stations", sorted(map(str, rates)), "one sample_rate_hz for all stations of a job")
        sourced = {station.current_ma is not None for station in stations}
        if len(sourced) > 1:
            raise BadParameter("stations", "mixed", "a current_ma for all stations of a job, or for none")
        return cls(next(iter(rates), None), any(s.temperatures for s in stations), True in sourced)
