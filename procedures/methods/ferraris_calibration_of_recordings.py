"""Calibration on six faces from recordings that exist, at rest and of whole turns (Ferraris' way).

The recordings may be of several jobs: each needs a station with table angles, and those of turns their turns. Rests of
other faces than the six may be among them.
"""

from collections.abc import Sequence

from pydantic import Field

from procedures import ferraris
from procedures.analysis.calibration.station_means import launch_warnings
from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.core.recording import Recording
from procedures.core.site import Site
from procedures.core.unit import Unit
from procedures.ferraris import FerrarisLimits, Result
from procedures.parameters import RecordedParameters
from procedures.procedure import STATIONS, Evidence, Method


class Params(RecordedParameters):
    """Site and table of the recordings, and limits."""

    latitude_deg: float = Field(ge=-90.0, le=90.0)
    gravity_m_s2: float = Field(ge=9.7, le=9.9)
    azimuth_deg: float = Field(0.0, ge=-360.0, le=360.0, description="heading of the table's zero")
    azimuth_sd_arcsec: float = Field(5.0, ge=0.0, le=3600.0)
    latitude_sd_arcsec: float = Field(0.0, ge=0.0, le=3600.0)
    gravity_sd_m_s2: float = Field(1e-5, ge=0.0, le=0.01)
    orthogonality_sd_arcsec: float = Field(3.0, ge=0.0, le=3600.0)
    pointing_sd_arcsec: float = Field(1.0, ge=0.0, le=3600.0)
    level_sd_arcsec: float = Field(1.0, ge=0.0, le=3600.0)
    limits: FerrarisLimits = Field(default_factory=lambda: FerrarisLimits.model_validate({}))


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Return the coefficients of both triads by least squares over rests and turns. Raises `UnfitRecording`,
    `MissingChannel`, `Undetermined`.
    """
    site = Site(
        params.latitude_deg, params.gravity_m_s2, params.azimuth_deg, params.azimuth_sd_arcsec, params.gravity_sd_m_s2
    )
    table = TableUncertainty(
        params.orthogonality_sd_arcsec,
        params.pointing_sd_arcsec,
        params.level_sd_arcsec,
        params.azimuth_sd_arcsec,
        params.gravity_sd_m_s2 / params.gravity_m_s2,
        latitude_sd_arcsec=params.latitude_sd_arcsec,
    )
    in_time: Sequence[Recording] = sorted(evidence.recordings, key=lambda r: r.info.start_s)
    found = ferraris.calibrated(in_time, site, table, unit, params.limits)
    return found.model_copy(update={"warnings": (*launch_warnings(in_time), *found.warnings)})


METHOD = Method(
    *("ferraris_calibration_of_recordings", "Calibration on six faces from recordings", "1.1.0"),
    *(Params, Result, analyse, ferraris.report, ferraris.calibrations),
    planned_checks=lambda params, unit, _: ferraris.planned_residuals(params.limits, unit),
    inspection=lambda _params, _count: STATIONS,
)
"""Both triads from rests and whole turns that were recorded before."""
