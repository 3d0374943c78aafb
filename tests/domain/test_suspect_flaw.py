"""Residuals that look like a flaw of the reference: named as what they are, and as large as the size foreseen."""

from dataclasses import replace

import numpy as np
import pytest

from procedures.analysis.calibration.multiposition import fit_triad
from procedures.analysis.calibration.reference import reference_vectors
from procedures.analysis.calibration.station_noise import mean_covariance
from procedures.analysis.calibration.station_plan import THESIS_ORIENTATIONS
from procedures.analysis.calibration.suspect_flaw import smallest_size, suspect
from procedures.analysis.calibration.table_errors import TableUncertainty, table_errors
from procedures.core.frames import orientation_beta_gamma
from procedures.core.site import Site
from procedures.core.units import ARCSEC
from tests.kit.forward_model import ACCELEROMETER_NOISE, GYRO_NOISE, K_ACCELEROMETER, K_GYRO, SITE

ANGLES = [orientation_beta_gamma(*o) for o in THESIS_ORIENTATIONS]
LABELS = [f"station {i}" for i in range(len(ANGLES))]
WINDOWS = [[80.0 * i, 80.0 * i + 70.0] for i in range(len(ANGLES))]
DECLARED = TableUncertainty(3.0, 1.0, 1.0, 5.0)
TRIADS = {"gyro": (GYRO_NOISE, K_GYRO, "rad/s"), "accelerometer": (ACCELEROMETER_NOISE, K_ACCELEROMETER, "m/s^2")}


def fitted(triad: str, dice: np.random.Generator, flaw: np.ndarray, site: Site = SITE):
    """A fit of one set of outputs whose vectors are off by a flaw of each column, (P,) [rad]."""
    noise, matrix, unit = TRIADS[triad]
    vectors = reference_vectors(triad, ANGLES, site)
    table = table_errors(ANGLES, vectors, DECLARED, of_gravity=triad == "accelerometer")
    covariance = np.array([mean_covariance(noise, WINDOWS)] * 3)
    truth = vectors + table.sensitivity @ (flaw + table.sd * dice.normal(size=len(table.sd)))
    outputs = truth @ matrix.T + np.array([np.linalg.cholesky(c) @ dice.normal(size=len(ANGLES)) for c in covariance]).T
    return fit_triad(triad, unit, unit, vectors, outputs, covariance, table), table


def named(triad: str, flaw: np.ndarray, draws: int) -> list[str]:
    dice = np.random.default_rng(11)
    fits = [fitted(triad, dice, flaw)[0] for _ in range(draws)]
    return ["" if f.free is None else suspect(f.free, LABELS) for f in fits]


def column(triad: str, source: str, number: int = 0) -> np.ndarray:
    table = fitted(triad, np.random.default_rng(0), np.zeros(6 + 3 * len(ANGLES)))[1]
    unit = np.zeros(len(table.source))
    unit[[i for i, s in enumerate(table.source) if s == source][number]] = 1.0
    return unit


def test_sound_residuals_are_said_nothing_about():
    """P(p < 0.01) = 0.01: of 300 at most 9 with a probability of 0.999."""
    for triad in TRIADS:
        assert sum(bool(s) for s in named(triad, np.zeros(6 + 3 * len(ANGLES)), 300)) <= 9


def test_a_wrong_azimuth_is_named_with_its_size():
    size = 40.0 * 60.0 * ARCSEC
    said = named("gyro", column("gyro", "azimuth") * size, 40)
    good = [s for s in said if "azimuth" in s]
    assert len(good) >= 36
    sizes = [float(s.split(": ")[1].split(" ±")[0]) for s in good]
    assert np.mean(sizes) == pytest.approx(2400.0, rel=0.1)


def test_gyros_alone_cannot_tell_an_azimuth_from_a_level_and_accelerometers_can():
    """With the outer axis at zero, heading north, turns about up and about north both give the rate a part to the east.

    They are then one column, exactly. The level is named with the azimuth by the gyros alone, and is left out where the
    accelerometers, which see an arcsecond of it, do not show it; a real level stays, and the accelerometers name it.
    """
    north = replace(SITE, azimuth_deg=0.0)
    azimuth, level = (column("gyro", source) * 20.0 * 60.0 * ARCSEC for source in ("azimuth", "level"))
    for seed in range(10):
        dice = np.random.default_rng(seed)
        gyro = fitted("gyro", dice, azimuth, north)[0]
        force = fitted("accelerometer", dice, 0.0 * azimuth, north)[0]
        assert gyro.free is not None
        assert force.free is not None
        alone, beside = suspect(gyro.free, LABELS), suspect(gyro.free, LABELS, [force.free])
        assert "wrong azimuth" in alone
        assert "wrong level" in alone
        assert "cannot tell which" in alone
        assert beside.startswith("the residuals look like a wrong azimuth: ")
        assert "cannot tell" not in beside
        gyro = fitted("gyro", dice, level, north)[0]
        force = fitted("accelerometer", dice, level, north)[0]
        assert gyro.free is not None
        assert force.free is not None
        assert "wrong level" in suspect(gyro.free, LABELS, [force.free])


def test_one_station_and_a_loose_mounting_are_told_apart():
    dice = np.random.default_rng(4)
    one = 20.0 * ARCSEC * sum(column("accelerometer", "pointing", 3 * 7 + axis) for axis in range(3))
    said = named("accelerometer", one, 20)
    assert sum(s.endswith("station 7") for s in said) >= 18  # what it leaves has p < 0.01 in one of a hundred
    loose = np.zeros(6 + 3 * len(ANGLES))
    loose[6:] = 10.0 * ARCSEC * dice.normal(size=3 * len(ANGLES))
    said = named("accelerometer", loose, 20)
    assert sum("loose mounting" in s for s in said) >= 18


def test_the_smallest_size_is_found_as_often_as_foreseen():
    """The power of 0.9 at a level of 0.01 in 300 draws: ±0.052 is three standard deviations."""
    dice = np.random.default_rng(2)
    azimuth = column("gyro", "azimuth")
    strong, _ = fitted("gyro", np.random.default_rng(0), azimuth * 0.1)
    assert strong.free is not None
    effect = strong.free.per_radian @ azimuth
    size = smallest_size(effect, strong.free.covariance, 0.01, 0.9)
    assert 60.0 * ARCSEC < size < 1e-1
    found = [(fitted("gyro", dice, azimuth * size)[0].p_value or 0.0) < 0.01 for _ in range(300)]
    assert np.mean(found) == pytest.approx(0.9, abs=0.052)
    assert smallest_size(0.0 * effect, strong.free.covariance, 0.01, 0.9) == float("inf")
