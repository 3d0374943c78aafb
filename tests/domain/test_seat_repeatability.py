"""Repeatability of cross-couplings over mountings, against seats that were drawn, and against closed forms."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from procedures.core import units
from procedures.core.errors import BadParameter
from procedures.core.imu_model import TriadCalibration
from procedures.methods.mounting_repeatability import METHOD, Params
from procedures.procedure import DatedCalibration, Evidence

SEAT_ARCSEC, NOISE_ARCSEC, MOUNTINGS, REPEATS = 30.0, 5.0, 40, 3


def calibration(matrix: np.ndarray, sd: float, triad: str = "gyro") -> TriadCalibration:
    covariance = np.diag(np.full(12, sd**2))
    rows = tuple(tuple(row) for row in matrix.tolist())
    return TriadCalibration(
        triad, "rad/s", "rad/s", (0.0, 0.0, 0.0), rows, tuple(tuple(r) for r in covariance.tolist())
    )


def dated(number: int, mounting: str, value: TriadCalibration) -> DatedCalibration:
    return DatedCalibration(f"c{number:03d}", f"2026-01-01T00:00:{number % 60:02d}Z", (value,), mounting)


def test_the_seat_that_was_drawn_is_found() -> None:
    """The scatter of a seat turned by N(0, 30″) about each axis is found, and the noise within a mounting.

    Sample standard deviation of n = 40 means of variance 30² + 5²/3: relative sd 1/√(2·39) = 11 %, so four of
    them are 45 %; of the pooled one with 40·2 degrees 1/√160 = 8 %, four of them 32 %.
    """
    dice = np.random.default_rng(7)
    k = np.diag([1.01, 0.99, 1.0]) + 1e-3 * dice.standard_normal((3, 3))
    made: list[DatedCalibration] = []
    for mounting in range(MOUNTINGS):
        seat = Rotation.from_rotvec(dice.standard_normal(3) * SEAT_ARCSEC * units.ARCSEC).as_matrix()
        for _ in range(REPEATS):
            noisy = k @ seat + dice.standard_normal((3, 3)) * NOISE_ARCSEC * units.ARCSEC
            made.append(dated(len(made), f"m{mounting:02d}", calibration(noisy, NOISE_ARCSEC * units.ARCSEC)))
    found = METHOD.analyse(Evidence(calibrations=tuple(made)), Params(), None).cross_couplings
    expected = np.hypot(SEAT_ARCSEC, NOISE_ARCSEC / np.sqrt(REPEATS))
    assert [c.name for c in found] == ["K12", "K13", "K21", "K23", "K31", "K32"]
    for c in found:
        assert c.sd / units.ARCSEC == pytest.approx(expected, rel=0.45)
        assert c.within_sd is not None
        assert c.within_sd / units.ARCSEC == pytest.approx(NOISE_ARCSEC, rel=0.32)
        assert c.within_degrees == MOUNTINGS * (REPEATS - 1)
        assert c.expected_from_measurement / units.ARCSEC == pytest.approx(NOISE_ARCSEC / np.sqrt(REPEATS), rel=0.03)
        assert c.seat_sd < c.sd


def test_two_mountings_by_hand() -> None:
    """Couplings 10 and 30 µrad: s = 20/√2 µrad, whatever the scale factor, which is divided out."""
    made = [
        dated(n, f"m{n}", calibration(2.0 * (np.eye(3) + coupling * (np.ones((3, 3)) - np.eye(3))), 0.0))
        for n, coupling in enumerate((10e-6, 30e-6))
    ]
    result = METHOD.analyse(Evidence(calibrations=tuple(made)), Params(repeatability_arcsec=3.0), None)
    for c in result.cross_couplings:
        assert c.sd == pytest.approx(20e-6 / np.sqrt(2.0), rel=1e-9)
        assert c.values == pytest.approx((10e-6, 30e-6), rel=1e-9)
        assert (c.within_sd, c.within_degrees) == (None, 0)
    assert all(c.passed for c in result.checks)  # 14.1 µrad are 2.9″
    assert METHOD.report(result).sections


@pytest.mark.parametrize("mountings", [("m1", "m1"), ("m1", "")])
def test_fewer_than_two_mountings_are_refused(mountings: tuple[str, str]) -> None:
    made = tuple(dated(n, name, calibration(np.eye(3), 1e-6)) for n, name in enumerate(mountings))
    with pytest.raises(BadParameter, match="mounting"):
        METHOD.analyse(Evidence(calibrations=made), Params(), None)
