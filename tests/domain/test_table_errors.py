"""Sensitivities to the table's flaws against a table built from rotation matrices with those flaws in it."""

from dataclasses import replace

import numpy as np
import pytest

from procedures.analysis.calibration.reference import reference_vectors
from procedures.analysis.calibration.table_errors import TableUncertainty, table_errors
from procedures.core import units
from procedures.core.recording import Station
from procedures.core.table_angles import TableAngles
from tests.kit.forward_model import SITE, Table

ANGLES = [TableAngles(20.0, -50.0, 110.0), TableAngles(-75.0, 33.0, 5.0)]
SMALL = 1e-4  # deg; the second order is then 1e-6 of the first


def pointing_once(axis: int):
    def pointing() -> np.ndarray:
        return SMALL * np.eye(3)[axis]

    return pointing


FLAWS = {
    0: Table(orthogonality=(SMALL, 0.0)),
    1: Table(orthogonality=(0.0, SMALL)),
    2: Table(level=(SMALL, 0.0)),
    3: Table(level=(0.0, SMALL)),
    4: Table(azimuth=-SMALL),
    6: Table(pointing=pointing_once(0)),
    7: Table(pointing=pointing_once(1)),
    8: Table(pointing=pointing_once(2)),
}


@pytest.mark.parametrize("triad", ["gyro", "accelerometer"])
@pytest.mark.parametrize("column", FLAWS)
def test_each_flaw_moves_the_vectors_as_a_real_table_would(triad: str, column: int):
    which = 0 if triad == "gyro" else 1
    vectors = reference_vectors(triad, ANGLES, SITE)
    errors = table_errors(ANGLES, vectors, TableUncertainty(1, 1, 1, 1), of_gravity=triad == "accelerometer")
    for i, angles in enumerate(ANGLES):
        station = Station(i, "", angles)
        moved = FLAWS[column].vectors(station, SITE)[which] - Table().vectors(station, SITE)[which]
        k = column + 3 * i if column > 5 else column
        size = np.linalg.norm(vectors[i])
        if triad == "accelerometer" and column == 4:
            continue  # a heading does not move gravity
        assert errors.sensitivity[i, :, k] * SMALL * units.DEG == pytest.approx(
            moved, abs=1e-5 * SMALL * units.DEG * size
        )


@pytest.mark.parametrize("latitude_deg", [-50.0, 0.0, 50.0, 89.9])
def test_the_latitude_moves_the_earths_rate_alone(latitude_deg: float):
    """By central difference of the site over 20″, whose error is beneath 1e-8 of Ω a radian."""
    declared, step = TableUncertainty(latitude_sd_arcsec=2.0), 10.0 / 3600.0
    site = replace(SITE, latitude_deg=latitude_deg)
    south, north = (replace(site, latitude_deg=latitude_deg + d) for d in (-step, step))
    vectors = reference_vectors("gyro", ANGLES, site)
    moved = reference_vectors("gyro", ANGLES, north) - reference_vectors("gyro", ANGLES, south)
    errors = table_errors(ANGLES, vectors, declared, of_gravity=False)
    assert errors.source[-1] == "latitude"
    assert errors.sd[-1] == pytest.approx(2.0 * units.ARCSEC)
    expected = moved / (2.0 * step * units.DEG)
    assert errors.sensitivity[:, :, -1] == pytest.approx(expected, abs=1e-7 * site.earth_rate_rad_s)
    forces = reference_vectors("accelerometer", ANGLES, site)
    of_gravity = table_errors(ANGLES, forces, declared, of_gravity=True)
    assert not of_gravity.sensitivity[:, :, -1].any()
    assert of_gravity.sd[-1] == 0.0
    assert "latitude" not in table_errors(ANGLES, vectors, TableUncertainty(), of_gravity=False).source


def test_heading_does_not_move_gravity():
    vectors = reference_vectors("accelerometer", ANGLES, SITE)
    errors = table_errors(ANGLES, vectors, TableUncertainty(azimuth_sd_arcsec=1.0), of_gravity=True)
    assert np.abs(errors.sensitivity[:, :, 4]).max() < 1e-14


def test_only_a_change_of_gravity_changes_the_magnitude():
    vectors = reference_vectors("accelerometer", ANGLES, SITE)
    errors = table_errors(ANGLES, vectors, TableUncertainty(), of_gravity=True)
    along = np.einsum("nj,njp->np", vectors, errors.sensitivity) / SITE.gravity_m_s2**2
    assert along[:, 5] == pytest.approx(1.0)
    assert np.abs(np.delete(along, 5, axis=1)).max() < 1e-14
