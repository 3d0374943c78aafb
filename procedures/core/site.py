"""Site of a bench: gravity, latitude, and the azimuth of its zero, with their uncertainties."""

from dataclasses import dataclass

from procedures.core import units


@dataclass(frozen=True)
class Site:
    """Site of a laboratory: its latitude, gravity and azimuth.

    `azimuth_deg` is the heading of the unit's x axis at zero table angles, clockwise from north, as
    measured by theodolite to the laboratory's prism (thesis 3.3.5); `azimuth_sd_arcsec` its standard uncertainty.
    """

    latitude_deg: float
    gravity_m_s2: float
    azimuth_deg: float = 0.0
    azimuth_sd_arcsec: float = 0.0
    gravity_sd_m_s2: float = 0.0
    earth_rate_rad_s: float = units.EARTH_RATE
    latitude_sd_arcsec: float = 0.0
    """Standard uncertainty of the latitude; 0: none is declared, and no budget has a row for it."""

    def __post_init__(self) -> None:
        for name, low, high in (
            ("latitude_deg", -90.0, 90.0),
            ("gravity_m_s2", 9.7, 9.9),
            ("azimuth_deg", -360.0, 360.0),
            ("azimuth_sd_arcsec", 0.0, 3600.0),
            ("gravity_sd_m_s2", 0.0, 0.01),
            ("earth_rate_rad_s", 7.0e-5, 7.6e-5),
            ("latitude_sd_arcsec", 0.0, 3600.0),
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                raise ValueError(f"site.{name} = {value!r} is outside {low} … {high}")
