"""Mounting of a unit on a plate of a bench, with the azimuth that was read for it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Mounting:
    """Facts of a mounting that analyses and lineage need (thesis 5.1, steps 1 to 4).

    `azimuth_deg` is the heading of the unit's x axis at zero table angles, clockwise from north, read by theodolite to
    the prism in this mounting; `azimuth_sd_arcsec` its standard uncertainty.
    """

    id: str
    plate: str
    by: str
    mounted_at: str
    """Moment of the mounting, ISO 8601."""
    azimuth_deg: float
    azimuth_sd_arcsec: float
