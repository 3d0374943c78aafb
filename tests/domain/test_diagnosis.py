"""Diagnosis of a verification: scores against their distribution, single changes named, groups, what is not named."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom, norm

from procedures.analysis.calibration.diagnosis import (
    FALSE_ALARM,
    TriadDiagnosis,
    coefficient_columns,
    diagnose,
    inseparable,
    residual_covariance,
)
from procedures.analysis.calibration.station_noise import mean_covariance
from procedures.analysis.calibration.table_errors import TableErrors, TableUncertainty, table_errors
from procedures.catalog import discover
from procedures.core.arrays import Array
from procedures.core.imu_model import COEFFICIENT_NAMES, TriadCalibration, triad_calibration
from procedures.core.limits import Verdict
from procedures.core.recording import Station
from procedures.core.table_angles import TableAngles
from procedures.procedure import Context
from procedures.reports.diagnosis import diagnosis_tables
from tests.kit.forward_model import (
    ACCELEROMETER_NOISE,
    B_ACCELEROMETER,
    K_ACCELEROMETER,
    SITE,
    Table,
    random_table,
    station_noise,
    station_recordings,
)

VERIFICATION = discover()["verification_9_orientations"]
CALIBRATION = discover()["calibration_12_orientations"]
ANGLES = [TableAngles(20.0 * i, 10.0 * i, 40.0 * i) for i in range(9)]
TRUTH = np.column_stack([B_ACCELEROMETER, K_ACCELEROMETER]).ravel()
SPREAD = np.tile([1e-5, 1e-6, 2e-6, 2e-6], 3)
ARCSEC = 2.0
"""Level, orthogonality and pointing of the table: 2″ is 95 µm/s² of gravity, some times the noise of a dwell."""


class Bench:
    """Stations whose accelerometer means are drawn from matrices written out by hand, with the table's flaws."""

    def __init__(self, angles: list[TableAngles], seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.stations = [Station(i, str(i), a, record_s=70.0) for i, a in enumerate(angles)]
        windows = [[80.0 * i, 80.0 * i + 70.0] for i in range(len(angles))]
        self.noise = np.array([mean_covariance(ACCELEROMETER_NOISE, windows)] * 3)
        self.vectors = self._vectors(Table())
        uncertainty = TableUncertainty(ARCSEC, ARCSEC, ARCSEC)
        self.table: TableErrors = table_errors(angles, self.vectors, uncertainty, of_gravity=True)
        self.roots = np.linalg.cholesky(self.noise)

    def _vectors(self, table: Table) -> Array:
        return np.array([table.vectors(s, SITE)[1] for s in self.stations])

    def calibration(self) -> TriadCalibration:
        measured = TRUTH + SPREAD * self.rng.normal(size=12)
        return triad_calibration("accelerometer", "m/s^2", "m/s^2", measured, np.diag(SPREAD**2))

    def covariance(self, calibration: TriadCalibration) -> Array:
        return residual_covariance(calibration, self.vectors, self.noise, None, self.table)

    def diagnosis(self, calibration: TriadCalibration, change: Array, table: Table | None = None) -> TriadDiagnosis:
        true = (TRUTH + change).reshape(3, 4)
        flawed = table or random_table(self.rng, ARCSEC, ARCSEC, ARCSEC, 0.0)
        noise = np.einsum("cij,cj->ic", self.roots, self.rng.normal(size=(3, len(self.stations))))
        outputs = true[:, 0] + self._vectors(flawed) @ true[:, 1:].T + noise
        return diagnose(calibration, outputs, self.vectors, self.covariance(calibration), self.table)


def only(k: int, size: float) -> Array:
    return size * np.eye(12)[k]


def sigmas(found: TriadDiagnosis) -> Array:
    by_name = {c.coefficients[0]: c.sigmas for c in found.changes}
    return np.array([by_name[name] for name in COEFFICIENT_NAMES])


def test_scores_of_an_unchanged_unit_are_normal_and_rarely_named():
    bench, n = Bench(ANGLES, 41), 300
    made = [bench.diagnosis(bench.calibration(), np.zeros(12)) for _ in range(n)]
    z = np.array([sigmas(d) for d in made])
    # A standard deviation of n normal numbers: 1/√(2n) relative; twelve of them at once: four of those.
    assert z.std(axis=0) == pytest.approx(np.ones(12), abs=4.0 / np.sqrt(2.0 * n))
    assert np.abs(z.mean(axis=0)).max() < 4.0 / np.sqrt(n)
    assert np.mean([d.p_value_unchanged for d in made]) == pytest.approx(0.5, abs=4.0 * 0.289 / np.sqrt(n))
    assert np.mean([d.p_value_refitted or 0.0 for d in made]) == pytest.approx(0.5, abs=4.0 * 0.289 / np.sqrt(n))
    assert sum(bool(d.named) for d in made) <= binom.isf(1e-4, n, FALSE_ALARM)


def test_a_single_change_of_five_sigma_is_named_first():
    bench, n, right = Bench(ANGLES, 42), 200, 0
    for _ in range(n):
        calibration = bench.calibration()
        a = coefficient_columns(bench.vectors)
        sd = np.sqrt(np.diagonal(np.linalg.inv(a.T @ np.linalg.inv(bench.covariance(calibration)) @ a)))
        k = int(bench.rng.integers(12))
        found = bench.diagnosis(calibration, only(k, 5.0 * sd[k] * bench.rng.choice([-1.0, 1.0])))
        right += bool(found.named) and found.named[0].coefficients == (COEFFICIENT_NAMES[k],)
    # P(N(5, 1) > threshold), less the chance that another one is larger, which is smaller than the power's own loss.
    power = norm.sf(norm.isf(FALSE_ALARM / 24.0) - 5.0)
    assert right >= binom.isf(1.0 - 1e-4, n, power) - 1
    assert right >= 0.9 * n


def test_a_change_is_measured_and_no_other_is_named_however_large_it_is():
    bench = Bench(ANGLES, 43)
    found = bench.diagnosis(bench.calibration(), only(6, 0.01))
    (named,) = found.named
    assert named.coefficients == ("K22",)
    assert named.change is not None
    assert abs(named.change - 0.01) < 4.0 * (named.standard_uncertainty or 0.0)
    assert found.changes[0].p_value_alone > 1e-4 > found.p_value_unchanged
    assert all(c.p_value_alone < 1e-4 for c in found.changes[1:])
    assert "K22" in found.sentence
    (table,) = diagnosis_tables([found])
    assert table.rows[0][0] == "K22"
    assert table.rows[0][2] == pytest.approx(1e6 * named.change)  # ppm


def test_what_the_stations_cannot_tell_apart_is_a_group_and_is_named_as_one():
    """Four attitudes about the outer axis see gravity along y alone: b and K_i2 stand for one, K_i1 and K_i3 unseen."""
    bench = Bench([TableAngles(90.0 * i) for i in range(4)], 44)
    assert inseparable(bench.vectors)[:3] == ((0, 2), (1,), (3,))
    found = bench.diagnosis(bench.calibration(), only(6, 1e-3), Table())
    assert found.named[0].coefficients == ("b_y", "K22")
    assert found.named[0].change is None
    unseen = [c for c in found.changes if c.coefficients in (("K21",), ("K23",))]
    assert [c.sigmas for c in unseen] == [0.0, 0.0]
    upside = Bench([TableAngles(0.0, m, 0.0) for m in (0.0, 90.0, 180.0, 270.0)], 45)
    assert inseparable(upside.vectors)[:4] == ((0,), (1,), (2,), (3,))  # z is not seen, the others are


def test_one_group_may_have_several_dimensions():
    """Three attitudes with the three axes up: b, K1, K2, K3 lie in three dimensions, all four tied."""
    bench = Bench([TableAngles(0, 90, 0), TableAngles(), TableAngles(0, 0, -90)], 46)
    assert inseparable(bench.vectors)[0] == (0, 1, 2, 3)
    found = [bench.diagnosis(bench.calibration(), np.zeros(12)) for _ in range(300)]
    z = np.array([c.sigmas for d in found for c in d.changes])
    # |z| of a group is a folded normal: 900 values, P(|z| > 1.96) = 5 %.
    assert np.mean(z > 1.959964) == pytest.approx(0.05, abs=4.0 * np.sqrt(0.05 * 0.95 / len(z)))
    far = bench.diagnosis(bench.calibration(), only(5, 10.0))
    assert far.named[0].coefficients == ("b_y", "K21", "K22", "K23")
    assert np.isfinite(far.named[0].sigmas)
    assert far.p_value_refitted is None


def test_a_knocked_table_is_no_change_of_coefficients_and_a_turned_unit_is_recognised():
    bench = Bench(ANGLES, 47)
    pointing = iter(np.radians(1.0) * bench.rng.normal(size=(9, 3)))
    wild = bench.diagnosis(bench.calibration(), np.zeros(12), replace(Table(), pointing=lambda: next(pointing)))
    assert "fit no change of its coefficients" in wild.sentence
    turned = np.column_stack([B_ACCELEROMETER, K_ACCELEROMETER @ turn_z(60.0 / 3600.0)]).ravel() - TRUTH
    found = bench.diagnosis(bench.calibration(), turned, Table())
    assert len(found.named) > 1
    movement = found.movements[0]
    assert movement.p_value > 1e-3
    # Noise of 1e-4 m/s² over nine stations is a few arcseconds.
    assert movement.arcsec == pytest.approx((0.0, 0.0, 60.0), abs=10.0)
    assert "turn of the unit on the table" in found.sentence


def turn_z(degrees: float) -> Array:
    """Passive turn: what a unit turned by `degrees` about z sees of a vector in the table's axes."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def test_the_procedure_names_what_moved_and_not_in_a_good_unit(context: Context):
    rng = np.random.default_rng(48)
    params = CALIBRATION.resolve(CALIBRATION.params(), context)
    table, stations = random_table(rng, 3.0, 5.0, 2.0, 10.0), CALIBRATION.schedule(params)
    taken = station_recordings(stations, context.unit.channels, rng, table, noise=station_noise(stations, context.unit))
    made = CALIBRATION.calibrations(CALIBRATION.analyse(taken, params, context))
    later = replace(context, unit=replace(context.unit, calibrations=made))
    params = VERIFICATION.resolve(VERIFICATION.params(), later)
    stations = VERIFICATION.schedule(params)
    taken = station_recordings(stations, context.unit.channels, rng, table, noise=station_noise(stations, context.unit))
    good = VERIFICATION.analyse(taken, params, later)
    assert good.verdict is Verdict.PASS
    assert [t.diagnosis.named for t in good.triads] == [(), ()]
    assert not any("moved" in w for w in good.warnings)
    # The unit's gyro z scale is 2000 ppm more than its calibration says: the calibration is taken back by as much.
    gyro = made[0]
    moved = triad_calibration("gyro", "rad/s", "rad/s", gyro.coefficients - only(11, 0.002), gyro.covariance_array)
    changed = replace(context, unit=replace(context.unit, calibrations=(moved, made[1])))
    found = VERIFICATION.analyse(taken, params, changed)
    first = found.triads[0].diagnosis.changes[0]
    assert first.coefficients == ("K33",)
    assert abs(first.change - 0.002) < 4.0 * first.standard_uncertainty
    assert any("K33" in w for w in found.warnings)
    assert "K33" in VERIFICATION.report(found).summary
    assert VERIFICATION.result.model_validate_json(found.model_dump_json()) == found
