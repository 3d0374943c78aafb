"""The figures of `docs/errata.md`, computed: printed tables against the default unit, and what follows from them."""

from dataclasses import replace
from math import sqrt
from pathlib import Path

import numpy as np
import pytest

from procedures.analysis.calibration.left_out import left_out_magnitudes
from procedures.analysis.calibration.multiposition import TriadFit, fit_triad
from procedures.analysis.calibration.reference import reference_vectors
from procedures.analysis.calibration.table_errors import TableUncertainty, table_errors
from procedures.analysis.calibration.verification import magnitudes
from procedures.analysis.table_program.dialect import read_program
from procedures.analysis.table_program.writing import THESIS_POSITIONS, dwells_at, write_program
from procedures.core import units
from procedures.core.errors import BadParameter
from procedures.core.frames import orientation_beta_gamma
from simulators.truth.files import default_unit
from tests.kit.forward_model import BETA_GAMMA, K_ACCELEROMETER, K_GYRO, SITE

TABLE_5_1 = """
    B0   0.090117    0.092241    0.12179
    K1   0.8148      0.0010164  -0.0014483
    K2  -0.0010369   0.85883    -0.005538
    K3   0.0010814   0.0053613   0.85306
"""
"""Accelerometers, first calibration, as printed: a column is the channel x, y, z."""
TABLE_5_2 = """
    B0   0.1856      0.026498   -0.027218
    K1   1.0048     -0.0045217   0.0025188
    K2  -0.00033819  1.0017     -0.0031615
    K3   0.00022548 -0.0091769   1.0009
"""
"""Gyros, the same; B0 in deg/h."""
STATED = (Path(__file__).parents[2] / "docs" / "errata.md").read_text(encoding="utf-8")


def printed(table: str) -> np.ndarray:
    """Rows B0, K1, K2, K3 over columns x, y, z, shape (4, 3)."""
    return np.array([[float(x) for x in line.split()[1:]] for line in table.strip().splitlines()])


@pytest.mark.parametrize(
    ("triad", "table", "size"),
    [
        ("accelerometer", TABLE_5_1, 1.0),
        ("gyro", TABLE_5_2, units.DEG_PER_HOUR),
    ],
)
def test_a_row_of_the_default_units_k_is_a_printed_column(triad: str, table: str, size: float) -> None:
    truth, rows = getattr(default_unit(), triad), printed(table)
    np.testing.assert_allclose(np.array(truth.bias) / size, rows[0], rtol=1e-12)
    for channel in range(3):
        assert tuple(truth.matrix[channel]) == tuple(rows[1:, channel])
    assert not np.array_equal(np.array(truth.matrix), rows[1:]), "as it was transposed"


def test_the_printed_cross_terms_exceed_what_is_allowed() -> None:
    cross = [np.abs(printed(t)[1:] - np.diag(np.diagonal(printed(t)[1:]))).max() for t in (TABLE_5_2, TABLE_5_1)]
    assert cross == pytest.approx([9.1769e-3, 5.538e-3])
    assert min(cross) > 1e-3
    assert "9.2·10⁻³" in STATED
    assert "5.5·10⁻³" in STATED


def design(triad: str, axes: tuple[str, str, str]) -> np.ndarray:
    """[1 v] of the fourteen rests, columns scaled; the first and the last position are the table's zero."""
    dwells = read_program(write_program(dwells_at(THESIS_POSITIONS)), axes)[1:-1]
    vectors = reference_vectors(triad, [d.angles for d in dwells], replace(SITE, azimuth_deg=0.0))
    whole = np.column_stack([np.ones(len(vectors)), vectors])
    return whole / np.linalg.norm(whole, axis=0)


def test_the_macro_is_a_calibration_with_one_numbering_of_the_axes_only() -> None:
    ours, reverse = ("inner", "middle", "outer"), ("outer", "middle", "inner")
    found = [np.linalg.cond(design(triad, ours)) for triad in ("accelerometer", "gyro")]
    assert found[0] == pytest.approx(1.28, abs=0.005)
    assert found[1] == pytest.approx(1.35, abs=0.005)
    assert np.linalg.matrix_rank(design("accelerometer", reverse), tol=1e-9) == 3


def test_a_pulse_as_printed_cannot_give_the_printed_quantization() -> None:
    largest = max(default_unit().gyro.quantization) / units.ARCSEC
    assert 1.8 / sqrt(12.0) == pytest.approx(0.52, abs=0.005)
    assert 1.8 / sqrt(12.0) > largest, "of the plainest counter"
    pulses = np.array(default_unit().gyro.pulse) / units.ARCSEC
    assert (pulses.min(), pulses.max()) == pytest.approx((0.45, 0.775))


def fitted(
    triad: str, matrix: np.ndarray, sd: float, seed: int, count: int = 12
) -> tuple[TriadFit, np.ndarray, np.ndarray]:
    """A calibration at the first `count` of the twelve orientations, with white noise of `sd` on every mean."""
    angles = [orientation_beta_gamma(*pair) for pair in BETA_GAMMA[:count]]
    vectors = reference_vectors(triad, angles, SITE)
    noise = np.random.default_rng(seed).normal(size=(count, 3)) * sd
    outputs = vectors @ matrix.T + 0.01 + noise
    ideal = table_errors(angles, vectors, TableUncertainty(), of_gravity=True)
    unit = {"gyro": "rad/s", "accelerometer": "m/s^2"}[triad]
    covariance = np.array([np.eye(count) * sd**2] * 3)
    return fit_triad(triad, unit, unit, vectors, outputs, covariance, ideal, weighting="noise"), vectors, outputs


def test_a_mean_error_in_sample_is_no_evidence_and_out_of_sample_shows_what_is() -> None:
    """Each residual has variance σ²(1 − h) in sample and σ²/(1 − h) left out, h the station's leverage.

    The twelve stations have Σh = 4, so the mean square ratio is at least (1/(1 − 1/3))² = 2.25 (Jensen, of equal
    leverages). The mean error in sample: residuals are orthogonal to the design, whose columns have the radial unit
    vector; what remains are the two tangential parts, (1 − h)·σ²/2g each: 2/3·σ²/g on average, whatever the unit. 4
    standard errors of 200 units are allowed.
    """
    sd, count = 1e-4, 200
    identity = np.eye(3)
    inside, outside, means = [], [], []
    labels = [str(i) for i in range(12)]
    for seed in range(count):
        fit, vectors, outputs = fitted("accelerometer", identity, sd, seed)
        m = magnitudes(outputs, fit.calibration(), SITE.gravity_m_s2, labels)
        left = left_out_magnitudes(fit, vectors, outputs, SITE.gravity_m_s2, labels)
        assert left is not None
        inside.append(np.mean(np.square(m.errors)))
        outside.append(np.mean(np.square(left.errors)))
        means.append(m.mean_error_after)
    h = np.einsum(
        "ia,ab,ib->i",
        fit.estimator.design,
        np.linalg.inv(fit.estimator.design.T @ fit.estimator.design),
        fit.estimator.design,
    )
    for found, expected in ((inside, sd**2 * np.mean(1.0 - h)), (outside, sd**2 * np.mean(1.0 / (1.0 - h)))):
        assert abs(np.mean(found) - expected) < 4.0 * np.std(found) / sqrt(count)
    assert np.mean(1.0 / (1.0 - h)) / np.mean(1.0 - h) >= 2.25
    expected = 2.0 / 3.0 * sd**2 / SITE.gravity_m_s2
    assert abs(np.mean(means) - expected) < 4.0 * np.std(means) / sqrt(count)


def test_a_station_left_out_is_one_that_the_fit_never_saw() -> None:
    fit, vectors, outputs = fitted("accelerometer", K_ACCELEROMETER, 1e-4, 3)
    left = left_out_magnitudes(fit, vectors, outputs, SITE.gravity_m_s2, [str(i) for i in range(12)])
    assert left is not None
    for i in (0, 7, 11):
        others = np.arange(12) != i
        plain = np.column_stack([np.ones(11), vectors[others]])
        b, k = np.split(np.linalg.lstsq(plain, outputs[others], rcond=None)[0], [1])
        assert left.after[i] == pytest.approx(np.linalg.norm(np.linalg.solve(k.T, outputs[i] - b[0])), rel=1e-12)


def test_too_few_stations_have_no_figure_out_of_sample() -> None:
    fit, vectors, outputs = fitted("gyro", K_GYRO, 1e-9, 1, count=5)
    assert left_out_magnitudes(fit, vectors, outputs, SITE.earth_rate_rad_s, ["x"] * 5) is None


def test_the_axes_of_a_program_are_a_setting() -> None:
    axes = ("outer", "middle", "inner")
    dwells = dwells_at([(10.0, 20.0, 30.0, 60.0)])
    text = write_program(dwells, axes)
    assert ":demand:position 1,10; p 2,20; p 3,30" in text
    assert read_program(text, axes)[0].angles == dwells[0].angles
    assert read_program(text)[0].angles.inner_deg == 10.0
    with pytest.raises(BadParameter, match=r"1 \(outer\), 2 \(middle\) or 3 \(inner\), not '4'"):
        read_program(":demand:position 4,1", axes)
