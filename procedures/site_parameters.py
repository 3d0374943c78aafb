"""Site of a bench and accuracy of its table, as parameters that several procedures share.

None takes what the bench declares.
"""

from typing import Annotated

from pydantic import Field

from procedures.analysis.calibration.reference import site_with
from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.core.site import Site
from procedures.procedure import Context, Parameters

Arcsec = Annotated[float, Field(ge=0.0, le=3600.0)]


class SiteParameters(Parameters):
    """Overrides of the bench's site."""

    latitude_deg: float | None = Field(None, ge=-90.0, le=90.0)
    gravity_m_s2: float | None = Field(None, ge=9.7, le=9.9)
    azimuth_deg: float | None = Field(None, ge=-360.0, le=360.0, description="heading of the table's zero")
    azimuth_sd_arcsec: Arcsec | None = None

    def site(self, context: Context) -> Site:
        """The bench's site with the values that these parameters override."""
        return site_with(
            context.bench.site, self.latitude_deg, self.gravity_m_s2, self.azimuth_deg, self.azimuth_sd_arcsec
        )


class TableParameters(SiteParameters):
    """The site, and the table's accuracy."""

    orthogonality_sd_arcsec: Arcsec | None = Field(None, description="of each of the table's two right angles")
    pointing_sd_arcsec: Arcsec | None = Field(None, description="of each axis, anew at each station")
    level_sd_arcsec: Arcsec | None = Field(None, description="of the outer axis about each horizontal direction")

    def table(self, site: Site) -> TableUncertainty:
        """Uncertainty of the reference due to table and site; zero for what neither bench nor parameters declare."""
        return TableUncertainty(
            self.orthogonality_sd_arcsec or 0.0,
            self.pointing_sd_arcsec or 0.0,
            self.level_sd_arcsec or 0.0,
            site.azimuth_sd_arcsec,
            site.gravity_sd_m_s2 / site.gravity_m_s2,
        )


def declared_site(context: Context) -> dict[str, float]:
    """Site values declared by the bench, for `Parameters.filled`."""
    site = context.bench.site
    return {
        "latitude_deg": site.latitude_deg,
        "gravity_m_s2": site.gravity_m_s2,
        "azimuth_deg": site.azimuth_deg,
        "azimuth_sd_arcsec": site.azimuth_sd_arcsec,
    }


def declared_table(context: Context) -> dict[str, float]:
    """Site and table values declared by the bench, for `Parameters.filled`."""
    accuracy = context.bench.accuracy
    return {
        **declared_site(context),
        "orthogonality_sd_arcsec": accuracy.orthogonality_sd_arcsec,
        "pointing_sd_arcsec": accuracy.pointing_sd_arcsec,
        "level_sd_arcsec": accuracy.level_sd_arcsec,
    }
