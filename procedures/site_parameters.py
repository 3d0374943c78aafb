"""Site of a bench and accuracy of its table, as parameters that several procedures share.

None takes what the bench declares.
"""

from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field

from procedures.analysis.calibration.reference import site_with
from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.core.errors import BadParameter
from procedures.core.site import Site
from procedures.core.unit import TriadRecord
from procedures.procedure import Context, JudgedParameters

Arcsec = Annotated[float, Field(ge=0.0, le=3600.0)]


BudgetSource = Literal[
    "noise", "orthogonality", "pointing", "level", "azimuth", "gravity", "thermometers", "mounting", "latitude"
]


def _records(context: Context) -> tuple[TriadRecord | None, TriadRecord | None]:
    return context.unit.gyro, context.unit.accelerometer


class SiteParameters(JudgedParameters):
    """Parameters that override the bench's site; None takes what the bench declares."""

    latitude_deg: float | None = Field(None, ge=-90.0, le=90.0)
    gravity_m_s2: float | None = Field(None, ge=9.7, le=9.9)
    azimuth_deg: float | None = Field(None, ge=-360.0, le=360.0, description="heading of the table's zero")
    azimuth_sd_arcsec: Arcsec | None = None
    gravity_sd_m_s2: float | None = Field(
        None, ge=0.0, le=0.01, exclude_if=lambda sd: sd is None, description="standard uncertainty of gravity"
    )

    latitude_sd_arcsec: Arcsec | None = Field(
        None, exclude_if=lambda sd: sd is None, description="standard uncertainty of the latitude, which gyros feel"
    )

    def site(self, context: Context) -> Site:
        """Return the bench's site with the values that these parameters override."""
        found = site_with(
            context.bench.site, self.latitude_deg, self.gravity_m_s2, self.azimuth_deg, self.azimuth_sd_arcsec
        )
        given = {"gravity_sd_m_s2": self.gravity_sd_m_s2, "latitude_sd_arcsec": self.latitude_sd_arcsec}
        return replace(found, **{name: value for name, value in given.items() if value is not None})


class TableParameters(SiteParameters):
    """Parameters that override the bench's site and its table's accuracy; None takes what the bench declares."""

    orthogonality_sd_arcsec: Arcsec | None = Field(
        None, description="standard uncertainty of each of the table's two right angles"
    )
    pointing_sd_arcsec: Arcsec | None = Field(
        None, description="standard uncertainty of each axis' angle, independent at each station"
    )
    level_sd_arcsec: Arcsec | None = Field(
        None, description="standard uncertainty of the outer axis' level about each horizontal direction"
    )
    mounting_sd_arcsec: Arcsec | None = Field(
        None,
        exclude_if=lambda sd: sd is None,
        description="repeatability of the unit's seat about each axis (method mounting_repeatability); None: the "
        "coefficients hold for the unit as it is mounted",
    )
    budget_sources: tuple[BudgetSource, ...] = Field(
        (),
        max_length=9,
        exclude_if=lambda sources: not sources,
        description="sources that the uncertainty budget must have: each needs a value above 0 of the parameters, the "
        "bench or the unit",
    )

    def table(self, site: Site) -> TableUncertainty:
        """Return the uncertainty of the reference due to table and site; zero for what neither bench nor parameters
        declare.
        """
        return TableUncertainty(
            self.orthogonality_sd_arcsec or 0.0,
            self.pointing_sd_arcsec or 0.0,
            self.level_sd_arcsec or 0.0,
            site.azimuth_sd_arcsec,
            site.gravity_sd_m_s2 / site.gravity_m_s2,
            self.mounting_sd_arcsec or 0.0,
            site.latitude_sd_arcsec,
        )

    def require_sources(self, context: Context, corrected: bool) -> None:
        """Refuse a source that the budget must have and that has no value. Raises `BadParameter` with its name.
        `corrected`: a thermal correction is applied, which the source "thermometers" needs.
        """
        site = self.site(context)
        known = [t is not None and any(n.random_walk or n.quantization for n in t.noise) for t in _records(context)]
        values = {
            "noise": (float(all(known)), "the unit's noise: static_run, or a declaration"),
            "orthogonality": (self.orthogonality_sd_arcsec, "orthogonality_sd_arcsec"),
            "pointing": (self.pointing_sd_arcsec, "pointing_sd_arcsec"),
            "level": (self.level_sd_arcsec, "level_sd_arcsec"),
            "azimuth": (site.azimuth_sd_arcsec, "azimuth_sd_arcsec"),
            "gravity": (site.gravity_sd_m_s2, "gravity_sd_m_s2"),
            "thermometers": (float(corrected), "thermal_correction=current, whose thermometers they are"),
            "mounting": (self.mounting_sd_arcsec, "mounting_sd_arcsec"),
            "latitude": (site.latitude_sd_arcsec, "latitude_sd_arcsec"),
        }
        for source in self.budget_sources:
            value, way_out = values[source]
            if not value:
                raise BadParameter("budget_sources", source, f"a source with a value above 0; give {way_out}")


def declared_site(context: Context) -> dict[str, float]:
    """Return the site values that the bench declares, for `Parameters.filled`."""
    site = context.bench.site
    return {
        "latitude_deg": site.latitude_deg,
        "gravity_m_s2": site.gravity_m_s2,
        "azimuth_deg": site.azimuth_deg,
        "azimuth_sd_arcsec": site.azimuth_sd_arcsec,
    }


def declared_table(context: Context) -> dict[str, float]:
    """Return the site and table values that the bench declares, for `Parameters.filled`."""
    accuracy = context.bench.accuracy
    return {
        **declared_site(context),
        "orthogonality_sd_arcsec": accuracy.orthogonality_sd_arcsec,
        "pointing_sd_arcsec": accuracy.pointing_sd_arcsec,
        "level_sd_arcsec": accuracy.level_sd_arcsec,
    }
