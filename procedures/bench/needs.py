"""What a job asks of a bench before it is opened."""

from collections.abc import Sequence
from dataclasses import dataclass

from procedures.core.errors import BadParameter
from procedures.core.recording import Station


@dataclass(frozen=True)
class BenchNeeds:
    """How the unit is to send, and whether temperature matters to the job."""

    sample_rate_hz: float | None = None
    """None: the unit's own."""
    temperatures: bool = False
    """Whether the unit's temperature sensors are read. A simulated unit then feels its temperature too."""
    currents: bool = False
    """Whether what is tested is a converter alone, a current source on its inputs, instead of a whole unit."""

    @classmethod
    def of(cls, stations: Sequence[Station]) -> "BenchNeeds":
        """What all stations of a job need together. Raises `BadParameter` where they disagree."""
        rates = {station.sample_rate_hz for station in stations}
        if len(rates) > 1:
            raise BadParameter("stations", sorted(map(str, rates)), "one sample_rate_hz for all stations of a job")
        sourced = {station.current_ma is not None for station in stations}
        if len(sourced) > 1:
            raise BadParameter("stations", "mixed", "a current_ma for all stations of a job, or for none")
        return cls(next(iter(rates), None), any(s.temperatures for s in stations), True in sourced)
