"""Initial alignment: angles put in come out, with the spread that is claimed; thesis 1.1; a pole is refused."""

import numpy as np
import pytest

from procedures.analysis.navigation.alignment import azimuth_error, initial_attitude, rotation_nb
from procedures.core import units
from procedures.core.errors import BadParameter, Undetermined, UnfitRecording
from procedures.core.imu_model import TriadCalibration, triad_calibration
from procedures.core.limits import Verdict
from procedures.core.recording import Channel, MemoryRecording, RecordingInfo
from procedures.core.unit import Unit
from procedures.methods.initial_alignment_of_recording import METHOD
from procedures.procedure import DatedCalibration, Evidence
from tests.kit.forward_model import (
    B_ACCELEROMETER,
    B_GYRO,
    GYRO_NOISE,
    K_ACCELEROMETER,
    K_GYRO,
    SITE,
    turn,
)

LATITUDE, G, EARTH = SITE.latitude_deg, SITE.gravity_m_s2, SITE.earth_rate_rad_s
ACROSS = EARTH * np.cos(np.radians(LATITUDE))


def seen(heading: float, pitch: float, roll: float) -> tuple[np.ndarray, np.ndarray]:
    """Specific force and Earth's rate in the unit's axes, from rotation matrices written out by hand [deg]."""
    attitude = turn("y", -heading) @ turn("z", pitch) @ turn("x", roll)
    rate = EARTH * np.array([np.cos(np.radians(LATITUDE)), np.sin(np.radians(LATITUDE)), 0.0])
    return attitude.T @ np.array([0.0, G, 0.0]), attitude.T @ rate


def aligned(force: np.ndarray, rate: np.ndarray, covariance: np.ndarray | None = None):
    covariance = np.eye(6) * 1e-16 if covariance is None else covariance
    return initial_attitude(force, rate, covariance, LATITUDE, G, EARTH)


def test_the_projections_of_s_3_163_and_3_165():
    """With S's yaw counterclockwise, ψ = −heading."""
    psi, theta, gamma = np.radians([-40.0, 12.0, -25.0])
    force, rate = seen(40.0, 12.0, -25.0)
    expected = G * np.array([np.sin(theta), np.cos(gamma) * np.cos(theta), -np.sin(gamma) * np.cos(theta)])
    assert force == pytest.approx(expected)
    up = EARTH * np.sin(np.radians(LATITUDE))
    assert rate[0] == pytest.approx(ACROSS * np.cos(theta) * np.cos(psi) + up * np.sin(theta))


@pytest.mark.parametrize("heading", [-170.0, -90.0, 0.0, 37.0, 90.0, 179.0])
@pytest.mark.parametrize(("pitch", "roll"), [(0.0, 0.0), (12.0, -25.0), (-60.0, 130.0)])
def test_angles_put_in_come_out_in_every_quadrant(heading: float, pitch: float, roll: float):
    found = np.degrees(aligned(*seen(heading, pitch, roll)).angles_rad)
    assert found == pytest.approx([heading, pitch, roll], abs=1e-9)
    assert rotation_nb(*np.radians([heading, pitch, roll])) == pytest.approx(
        turn("y", -heading) @ turn("z", pitch) @ turn("x", roll)
    )


def test_the_spread_is_what_is_claimed():
    rng = np.random.default_rng(7)
    force, rate = seen(37.0, 12.0, -25.0)
    n, covariance = 300, np.diag(np.repeat([(1e-4) ** 2, (1e-2 * units.DEG_PER_HOUR) ** 2], 3))
    claimed = aligned(force, rate, covariance)
    drawn = [aligned(force + d[:3], rate + d[3:]) for d in rng.normal(size=(n, 6)) * np.sqrt(np.diagonal(covariance))]
    # Sample standard deviations of n: one part in √(2n) each, four of them allowed.
    errors = np.array([a.angles_rad for a in drawn]) - claimed.angles_rad
    assert errors.std(axis=0) == pytest.approx(np.sqrt(np.diagonal(claimed.covariance)), rel=4 / np.sqrt(2 * n))
    magnitudes = np.array([a.magnitude_errors for a in drawn])
    assert magnitudes.std(axis=0) == pytest.approx(claimed.magnitude_sd, rel=4 / np.sqrt(2 * n))


def test_an_east_gyro_and_an_east_accelerometer_act_as_thesis_1_1():
    force, rate = seen(0.0, 0.0, 0.0)
    gyro, accelerometer = 0.01 * units.DEG_PER_HOUR, 1e-3
    exact = aligned(force, rate).angles_rad[0]
    # Level and heading north, z looks east.
    turned = aligned(force, rate + np.array([0.0, 0.0, gyro])).angles_rad[0] - exact
    assert abs(turned) == pytest.approx(azimuth_error(LATITUDE, G, 0.0, gyro, 0.0, 0.0, 1.0)[0], rel=1e-3)
    tilted = aligned(force + np.array([0.0, 0.0, accelerometer]), rate).angles_rad[0] - exact
    assert abs(tilted) == pytest.approx(azimuth_error(LATITUDE, G, accelerometer, 0.0, 0.0, 0.0, 1.0)[0], rel=1e-3)


def test_thesis_1_1_by_hand():
    n, turned = 0.003 * units.DEG_PER_SQRT_HOUR, 2.0 * units.ARCSEC
    added, independent = azimuth_error(60.0, 10.0, 1e-3, 0.01 * units.DEG_PER_HOUR, n, turned, 900.0)
    rates = np.array([0.01, 0.003 / 0.5, 2.0 / 900.0])  # 0.003 deg/√h over a quarter of an hour; arcsec/s is deg/h
    parts = np.array([1e-3 * np.sqrt(3.0) / 10.0, *(rates / 15.0410686 / 0.5)])
    assert added == pytest.approx(parts.sum(), rel=1e-6)
    assert independent == pytest.approx(np.sqrt(np.sum(parts**2)), rel=1e-6)


@pytest.mark.parametrize("latitude", [90.0, -90.0, 89.5])
def test_a_pole_is_refused(latitude: float):
    with pytest.raises(BadParameter, match=r"latitude_deg.*pole"):
        initial_attitude(np.array([0, G, 0]), np.array([0, EARTH, 0]), np.eye(6), latitude, G, EARTH)
    with pytest.raises(BadParameter, match="latitude_deg"):
        METHOD.analyse(Evidence(), METHOD.params(latitude_deg=latitude, gravity_m_s2=G), None)


def test_a_unit_on_end_is_refused():
    with pytest.raises(Undetermined, match="heading"):
        aligned(*seen(20.0, 89.0, 0.0))


def calibration() -> DatedCalibration:
    def triad(name: str, unit: str, bias: np.ndarray, matrix: np.ndarray, sd: tuple[float, float]) -> TriadCalibration:
        covariance = np.diag(np.tile([sd[0], *(sd[1],) * 3], 3) ** 2)
        return triad_calibration(name, unit, unit, np.column_stack([bias, matrix]).ravel(), covariance)

    gyro = triad("gyro", "rad/s", B_GYRO, K_GYRO, (0.001 * units.DEG_PER_HOUR, 1e-5))
    return DatedCalibration(
        "c", "2026-01-01", (gyro, triad("accelerometer", "m/s^2", B_ACCELEROMETER, K_ACCELEROMETER, (1e-5, 1e-6)))
    )


def resting(channels: tuple[Channel, ...], heading: float, moved: float = 1.0, pitch: float = 3.0) -> MemoryRecording:
    force, rate = seen(heading, pitch, -2.0)
    mean = np.concatenate([B_GYRO + K_GYRO @ rate, B_ACCELEROMETER + K_ACCELEROMETER @ force * moved])
    ripple = np.where(np.arange(600) % 2, 1.0, -1.0)[:, None] * np.array([1e-8] * 3 + [1e-6] * 3)
    return MemoryRecording(RecordingInfo(f"h{heading:g}", "S-1", channels, 1.0, 600), mean + ripple)


def test_recordings_of_a_calibrated_unit_are_aligned(channels: tuple[Channel, ...], unit: Unit):
    params = METHOD.params(latitude_deg=LATITUDE, gravity_m_s2=G)
    evidence = Evidence((resting(channels, 12.0), resting(channels, -100.0)), (calibration(),))
    result = METHOD.analyse(evidence, params, unit)
    assert [a.heading_deg for a in result.attitudes] == pytest.approx([12.0, 260.0], abs=1e-6)
    assert [a.pitch_deg for a in result.attitudes] == pytest.approx([3.0, 3.0], abs=1e-6)
    assert [a.roll_deg for a in result.attitudes] == pytest.approx([-2.0, -2.0], abs=1e-6)
    assert result.verdict is Verdict.PASS
    first = result.attitudes[0]
    # At least the noise of 600 s across the Earth's horizontal rate.
    noise = GYRO_NOISE.random_walk / np.sqrt(600.0) / ACROSS
    assert np.radians(first.heading_sd_deg) > noise
    assert first.predicted_azimuth_error_deg is not None
    assert METHOD.result.model_validate_json(result.model_dump_json()) == result
    assert METHOD.report(result).sections


def test_a_magnitude_that_gravity_has_not_fails(channels: tuple[Channel, ...], unit: Unit):
    params = METHOD.params(latitude_deg=LATITUDE, gravity_m_s2=G)
    result = METHOD.analyse(Evidence((resting(channels, 12.0, 1.001),), (calibration(),)), params, unit)
    assert result.verdict is Verdict.FAIL
    assert [c.name for c in result.checks if not c.passed] == ["h12: |f| − g"]


def test_without_a_calibration_nothing_is_aligned(channels: tuple[Channel, ...], unit: Unit):
    params = METHOD.params(latitude_deg=LATITUDE, gravity_m_s2=G)
    with pytest.raises(BadParameter, match="accelerometer triad has no calibration"):
        METHOD.analyse(Evidence((resting(channels, 12.0),)), params, unit)


def test_a_recording_on_end_is_named(channels: tuple[Channel, ...], unit: Unit):
    params = METHOD.params(latitude_deg=LATITUDE, gravity_m_s2=G)
    recordings = (resting(channels, 12.0), resting(channels, 13.0, pitch=89.0))
    with pytest.raises(UnfitRecording, match="recording h13: the heading of a unit that stands on end"):
        METHOD.analyse(Evidence(recordings, (calibration(),)), params, unit)
