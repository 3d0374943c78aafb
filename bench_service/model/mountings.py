"""A mounting of a unit on a plate of a bench, as it is stored."""

from dataclasses import dataclass
from datetime import datetime

from bench_service.mapping import copied
from procedures.core.mounting import Mounting


@dataclass(frozen=True)
class StoredMounting:
    """A mounting: it stands until the unit is taken off, or another one takes its place."""

    id: str
    unit: str
    bench: str
    plate: str
    """Name of the mounting plate."""
    by: str
    """Name of the person who mounted the unit."""
    proven: bool
    """True where the service knows the person by a log-in; False where the request declared the name."""
    mounted_at: datetime
    entered_at: datetime
    azimuth_deg: float
    """Heading of the unit's x axis at zero table angles, clockwise from north, read in this mounting."""
    azimuth_sd_arcsec: float
    """Standard uncertainty of that reading."""
    instrument: str = ""
    """Theodolite and prism, as text."""
    remark: str = ""
    ended_at: datetime | None = None
    """Time at which the unit was taken off or another mounting took its place; None: it stands."""
    ended_by: str = ""

    @property
    def stands(self) -> bool:
        """True while the unit has not been taken off and no other mounting has replaced this one."""
        return self.ended_at is None

    def for_context(self) -> Mounting:
        """Return the facts of the mounting that a job keeps with its context: id, plate, person, time, and the azimuth
        with its uncertainty.
        """
        return copied(Mounting, self, mounted_at=self.mounted_at.isoformat())
