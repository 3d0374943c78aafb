"""The procedure `initial_alignment`: signs, prediction against hand-made draws and against the simulator, refusals."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.analysis.repeated_alignment.expected import expected_errors, planned_alignments, reference_attitudes
from procedures.analysis.repeated_alignment.observed import alignment_errors, found_attitudes, recorded_alignments
from procedures.catalog import discover
from procedures.core import units
from procedures.core.errors import BadParameter, DomainError, UnfitRecording
from procedures.core.imu_model import TriadCalibration, triad_calibration
from procedures.core.limits import Verdict
from procedures.core.recording import Channel, MemoryRecording, Recording, RecordingInfo, Station
from procedures.core.table_angles import TableAngles
from procedures.core.unit import TriadRecord, Unit
from procedures.methods.initial_alignment_of_recording import METHOD
from procedures.procedure import Context, Evidence
from simulators.truth import BenchTruth, SiteTruth, declared_unit, default_bench, default_unit
from simulators.world import WorldConfig
from tests.kit.forward_model import (
    ACCELEROMETER_NOISE,
    B_ACCELEROMETER,
    B_GYRO,
    GYRO_NOISE,
    K_ACCELEROMETER,
    K_GYRO,
    SITE,
    Table,
    random_table,
    turn,
)
from tests.validation.population import recordings as simulated_recordings

PROCEDURE = discover()["initial_alignment"]
CALIBRATION = discover()["calibration_12_orientations"]
TABLE = TableUncertainty(30.0, 20.0, 10.0, 40.0)
AXES = ((60.0, 100.0),) * 3
RUN_TO_RUN = ((0.002 * units.DEG_PER_HOUR, 20e-6), (5e-5, 8e-5))
"""(bias, relative scale factor) of gyros and accelerometers."""
COEFFICIENT_SD = ((0.004 * units.DEG_PER_HOUR, 3e-4), (2e-5, 3e-6))
"""(bias, element of K) of a calibration, gyros and accelerometers."""


def calibrated(name: str, drawn: np.ndarray) -> TriadCalibration:
    """A calibration with these errors (12,) in units of their standard uncertainties."""
    gyro = name == "gyro"
    unit, sds = ("rad/s", COEFFICIENT_SD[0]) if gyro else ("m/s^2", COEFFICIENT_SD[1])
    truth = np.column_stack([B_GYRO, K_GYRO] if gyro else [B_ACCELEROMETER, K_ACCELEROMETER]).ravel()
    sd = np.tile([sds[0], *(sds[1],) * 3], 3)
    return triad_calibration(name, unit, unit, truth + sd * drawn, np.diag(sd**2))


def unit_with(channels: tuple[Channel, ...], gyro: np.ndarray, accelerometer: np.ndarray) -> Unit:
    records = (TriadRecord((GYRO_NOISE,) * 3, *RUN_TO_RUN[0]), TriadRecord((ACCELEROMETER_NOISE,) * 3, *RUN_TO_RUN[1]))
    triads = (calibrated("gyro", gyro), calibrated("accelerometer", accelerometer))
    return Unit("S-1", 400.0, channels, *records, 70.0, triads, "c")


def rest(
    channels: tuple[Channel, ...], stations: Sequence[Station], table: Table, added: np.ndarray | None = None
) -> list[Recording]:
    """One recording a station, a launch each: hand-made outputs, plus what is added, (n, 6), to the channels' means."""
    found: list[Recording] = []
    for i, station in enumerate(stations):
        rate, force = table.vectors(station, SITE)
        mean = np.concatenate([B_GYRO + K_GYRO @ rate, B_ACCELEROMETER + K_ACCELEROMETER @ force])
        mean += 0.0 if added is None else added[i]
        ripple = np.where(np.arange(100) % 2, 1.0, -1.0)[:, None] * np.array([1e-8] * 3 + [1e-6] * 3)
        info = RecordingInfo(f"r{i}", "S-1", channels, 1 / 6, 100, 1000.0 * i + 2, station, launched_s=1000.0 * i)
        found.append(MemoryRecording(info, mean + ripple))
    return found


def errors(unit: Unit, recordings: Sequence[Recording]) -> np.ndarray:
    """Errors of (heading, pitch, roll) [rad], (n, 3)."""
    plan = recorded_alignments(recordings, unit, SITE, TABLE)
    return alignment_errors(found_attitudes(recordings, plan), plan)


def test_heading_is_the_azimuth_less_the_outer_angle():
    angles = [TableAngles(30.0), TableAngles(0.0, 10.0), TableAngles(0.0, 0.0, -20.0), TableAngles(200.0, 5.0, 7.0)]
    found = np.degrees(reference_attitudes(angles, SITE))
    assert found[:3] == pytest.approx(np.array([[7.0, 0, 0], [37.0, 10.0, 0], [37.0, 0, -20.0]]), abs=1e-9)
    heading, pitch, roll = found[3]
    whole = turn("y", -SITE.azimuth_deg) @ turn("y", 200.0) @ turn("z", 5.0) @ turn("x", 7.0)
    assert turn("y", -heading) @ turn("z", pitch) @ turn("x", roll) == pytest.approx(whole)


def test_a_perfect_unit_finds_the_tables_angles(context: Context):
    unit = unit_with(context.unit.channels, np.zeros(12), np.zeros(12))
    places = ((0.0, 0.0, 0.0), (60.0, 10.0, -20.0), (-150.0, 0.0, 180.0))
    params = PROCEDURE.params(orientations=places, repetitions=2)
    stations = PROCEDURE.schedule(params)
    assert [s.power_off_s for s in stations] == [60.0] * 6
    result = PROCEDURE.analyse(rest(unit.channels, stations, Table()), params, replace(context, unit=unit))
    assert np.array([a.error_deg for a in result.alignments]) == pytest.approx(np.zeros((6, 3)), abs=1e-7)
    assert [a.attitude_deg[0] for a in result.alignments[:2]] == pytest.approx([37.0, 337.0])
    assert [a.launch for a in result.alignments] == [1, 2, 3, 4, 5, 6]
    assert result.verdict is Verdict.PASS
    assert PROCEDURE.result.model_validate_json(result.model_dump_json()) == result
    assert len(PROCEDURE.report(result).sections) == 4


def test_every_source_has_the_spread_that_is_claimed(context: Context):
    """Draws through a forward model of rotation matrices; 200 of each source."""
    rng, n = np.random.default_rng(3), 200
    channels = context.unit.channels
    nominal = unit_with(channels, np.zeros(12), np.zeros(12))
    params = PROCEDURE.params(orientations=((20.0, 8.0, -30.0),), repetitions=1)
    stations = PROCEDURE.schedule(params)
    expected = expected_errors(planned_alignments(nominal, SITE, TABLE, stations, AXES))
    outputs = np.concatenate(
        [k @ v for k, v in zip((K_GYRO, K_ACCELEROMETER), Table().vectors(stations[0], SITE), strict=True)]
    )
    change = np.concatenate(
        [np.hypot(b, s * v) for (b, s), v in zip(RUN_TO_RUN, outputs.reshape(2, 3), strict=True)]
    ) * np.sqrt(2.0)  # the calibration's launch and this one
    truth = Table()
    one = [r for _ in range(n) for r in rest(channels, stations, random_table(rng, 30.0, 20.0, 10.0, 40.0))]
    drawn = {
        "calibration": np.vstack(
            [errors(unit_with(channels, *rng.normal(size=(2, 12))), rest(channels, stations, truth)) for _ in range(n)]
        ),
        "launch to launch": errors(nominal, rest(channels, stations * n, truth, change * rng.normal(size=(n, 6)))),
        "table": errors(nominal, one),
    }
    low, high = np.sqrt(chi2.ppf([5e-5, 1 - 5e-5], n) / n)  # nine figures: one in a thousand runs fails by chance
    for source, found in drawn.items():
        ratio = np.sqrt(np.mean(found**2, axis=0)) / np.sqrt(np.diagonal(expected.by_source[source]))
        assert np.all((low < ratio) & (ratio < high)), (source, ratio)


def bench_at(latitude_deg: float) -> BenchTruth:
    """The shipped bench elsewhere, its table pointing as well as it declares."""
    shipped = default_bench()
    site = replace(shipped.description.site, latitude_deg=latitude_deg)
    table = replace(shipped.table, pointing_sd_arcsec=shipped.description.accuracy.pointing_sd_arcsec)
    description = replace(shipped.description, site=site)
    return BenchTruth(SiteTruth(latitude_deg, site.gravity_m_s2, site.earth_rate_rad_s), table, description)


@cache
def simulated(latitude_deg: float, seed: int, alignments: int) -> Any:
    """A unit calibrated in one launch, then aligned in as many others; means made by the simulator."""
    config = WorldConfig(default_unit(), bench_at(latitude_deg), seed)
    context = Context(declared_unit(config.unit), config.bench.description)
    params = CALIBRATION.resolve(CALIBRATION.params(), context)
    recordings = simulated_recordings(config, CALIBRATION.schedule(params), 1)
    made = CALIBRATION.calibrations(CALIBRATION.analyse(recordings, params, context))
    context = replace(context, unit=replace(context.unit, calibrations=made))
    params = PROCEDURE.resolve(PROCEDURE.params(repetitions=alignments, alignment_s=120.0), context)
    taken: list[Recording] = []
    for i, station in enumerate(PROCEDURE.schedule(params)):
        (one,) = simulated_recordings(config, [station], 2 + i)
        began = 1000.0 * i
        taken.append(replace(one, info=replace(one.info, start_s=began + one.info.start_s, launched_s=began)))
    few = params.model_copy(update={"repetitions": 2})  # one alignment's uncertainty does not depend on their number
    return PROCEDURE.analyse(taken, params, context), PROCEDURE.predict(few, context)


@pytest.mark.parametrize(("latitude_deg", "seed"), [(50.45, 11), (-68.0, 12)])
def test_many_alignments_err_as_predicted(latitude_deg: float, seed: int):
    """Two-sided chi-square of all, spread and mean of the heading: together one in a thousand runs fails by chance."""
    n = 150  # 300 and more units in `tests.validation.alignment`
    result, prediction = simulated(latitude_deg, seed, n)
    heading = result.angles[0]
    low, high = chi2.ppf([1e-4, 1 - 1e-4], n)
    assert low < heading.chi_square < high
    # What launches and noise scatter is independent from launch to launch: n − 1 degrees of freedom.
    low, high = np.sqrt(chi2.ppf([1e-4, 1 - 1e-4], n - 1) / (n - 1))
    assert low < heading.spread_deg / heading.expected_spread_deg < high
    assert abs(heading.mean_error_deg) < 3.9 * heading.mean_error_expected_sd_deg
    assert result.verdict is Verdict.PASS
    # The preview, made before, says the same; it has no more than the time since launch from its own reckoning.
    found = {u.name: u.standard_uncertainty for u in prediction.uncertainties}
    assert found["heading of one alignment"] / units.DEG == pytest.approx(heading.expected_sd_deg, rel=1e-3)
    # Of thesis 1.1 only the noise is comparable, and ours of it has the random walk at least.
    walk = 0.0006 * units.DEG_PER_SQRT_HOUR / np.sqrt(120.0) / (units.EARTH_RATE * np.cos(np.radians(latitude_deg)))
    assert np.radians(heading.expected_by_source_deg["noise"]) > walk
    assert result.thesis.independent_deg < result.thesis.added_deg


def test_a_wrong_azimuth_fails(context: Context):
    unit = unit_with(context.unit.channels, np.zeros(12), np.zeros(12))
    params = PROCEDURE.params(repetitions=3)
    turned = rest(unit.channels, PROCEDURE.schedule(params), Table(azimuth=1.0))
    result = PROCEDURE.analyse(turned, params, replace(context, unit=unit))
    assert result.verdict is Verdict.FAIL
    assert [c.name for c in result.checks if not c.passed] == ["heading errors as predicted, p-value of chi-square"]
    assert result.angles[0].mean_error_deg == pytest.approx(1.0, rel=1e-3)


def test_in_one_launch_the_unit_stays_on_and_errors_hang_together(context: Context):
    unit = unit_with(context.unit.channels, np.zeros(12), np.zeros(12))
    one = PROCEDURE.schedule(PROCEDURE.params(repetitions=2, off_time_s=0.0))
    assert [s.power_off_s for s in one] == [0.0, 0.0]
    apart = PROCEDURE.schedule(PROCEDURE.params(repetitions=2))
    covariances = [expected_errors(planned_alignments(unit, SITE, TABLE, s, AXES)).of_angle(0) for s in (one, apart)]
    launch = [c[0, 1] for c in covariances]
    across = SITE.earth_rate_rad_s * np.cos(np.radians(SITE.latitude_deg))
    # The bias of a launch is common to both, at least: level, the east one across the Earth's horizontal rate.
    assert launch[0] - launch[1] > (RUN_TO_RUN[0][0] / across) ** 2


def test_the_method_for_a_single_recording_says_the_same(context: Context):
    """Another hand wrote `initial_alignment_of_recording`; it knows no table, so the table's part stays out."""
    unit = unit_with(context.unit.channels, np.zeros(12), np.zeros(12))
    params = PROCEDURE.params(orientations=((110.0, 12.0, -25.0),), repetitions=1)
    taken = rest(unit.channels, PROCEDURE.schedule(params), Table())
    ours = PROCEDURE.analyse(taken, params, replace(context, unit=unit))
    given = METHOD.params(latitude_deg=SITE.latitude_deg, gravity_m_s2=SITE.gravity_m_s2)
    (theirs,) = METHOD.analyse(Evidence(tuple(taken)), given, unit).attitudes
    found = (theirs.heading_deg, theirs.pitch_deg, theirs.roll_deg)
    assert ours.alignments[0].attitude_deg == pytest.approx(found, abs=1e-9)
    for a, sd in zip(ours.angles, (theirs.heading_sd_deg, theirs.pitch_sd_deg, theirs.roll_sd_deg), strict=True):
        of_unit = [v for source, v in a.expected_by_source_deg.items() if source != "table"]
        assert np.hypot.reduce(of_unit) == pytest.approx(sd, rel=1e-4)


@pytest.mark.parametrize("latitude_deg", [90.0, -90.0, 89.5])
def test_a_pole_is_refused(context: Context, latitude_deg: float):
    unit = unit_with(context.unit.channels, np.zeros(12), np.zeros(12))
    with pytest.raises(BadParameter, match=r"latitude_deg.*pole.*no north"):
        PROCEDURE.predict(PROCEDURE.params(latitude_deg=latitude_deg), replace(context, unit=unit))


def test_refusals(context: Context):
    unit = unit_with(context.unit.channels, np.zeros(12), np.zeros(12))
    there = replace(context, unit=unit)
    with pytest.raises(DomainError, match="no calibration of its accelerometer triad"):
        PROCEDURE.predict(PROCEDURE.params(), context)
    with pytest.raises(BadParameter, match=r"orientations.*on end"):
        PROCEDURE.predict(PROCEDURE.params(orientations=((0.0, 90.0, 0.0),)), there)
    with pytest.raises(BadParameter, match="500 are the most"):
        PROCEDURE.schedule(PROCEDURE.params(orientations=((0.0, 0.0, 0.0),) * 50, repetitions=300))
    params = PROCEDURE.params(repetitions=1)
    (taken,) = rest(unit.channels, PROCEDURE.schedule(params), Table())
    nowhere = MemoryRecording(replace(taken.info, station=None), np.concatenate(list(taken.blocks())))
    with pytest.raises(UnfitRecording, match="table's angles"):
        PROCEDURE.analyse([nowhere], params, there)


def test_a_unit_of_unknown_noise_is_aligned_but_not_judged(context: Context):
    unit = replace(unit_with(context.unit.channels, np.zeros(12), np.zeros(12)), gyro=None)
    params = PROCEDURE.params(repetitions=2)
    result = PROCEDURE.analyse(
        rest(unit.channels, PROCEDURE.schedule(params), Table()), params, replace(context, unit=unit)
    )
    assert [a.p_value for a in result.angles] == [None] * 3
    assert result.thesis is None
    assert any("not judged" in w for w in result.warnings)
