"""The Allan family against printed tables: NIST SP 1065 (Tables 30 and 31) and Stable32's intervals."""

import numpy as np
import pytest

from procedures.analysis.allan.confidence_intervals import ONE_SIGMA, degrees_of_freedom, interval
from procedures.analysis.allan.deviation import deviation
from procedures.analysis.allan.statistic import (
    HADAMARD,
    MODIFIED_ALLAN,
    OVERLAPPING_ALLAN,
    OVERLAPPING_HADAMARD,
    STATISTICS,
    TIME,
    Statistic,
)

TABLE_31 = {
    "allan": ("2.922319e-01", "9.965736e-02", "3.897804e-02"),
    "overlapping_allan": ("2.922319e-01", "9.159953e-02", "3.241343e-02"),
    "modified_allan": ("2.922319e-01", "6.172376e-02", "2.170921e-02"),
    "time": ("1.687202e-01", "3.563623e-01", "1.253382e+00"),
    "hadamard": ("2.943883e-01", "1.052754e-01", "3.910861e-02"),
    "overlapping_hadamard": ("2.943883e-01", "9.581083e-02", "3.237638e-02"),
}
"""1000 points at averaging factors 1, 10 and 100."""

NBS14 = np.array([892.0, 809.0, 823.0, 798.0, 671.0, 644.0, 883.0, 903.0, 677.0])
TABLE_30 = {
    "allan": ("91.22945", "115.8082"),
    "overlapping_allan": ("91.22945", "85.95287"),
    "modified_allan": ("91.22945", "74.78849"),
    "time": ("52.67135", "86.35831"),
    "hadamard": ("70.80607", "116.7980"),
    "overlapping_hadamard": ("70.80607", "85.61487"),
}
"""9 frequencies at averaging factors 1 and 2."""


@pytest.fixture(scope="module")
def nist_1000() -> np.ndarray:
    """SP 1065, 12.4: n ← 16807·n mod 2147483647 from 1234567890, over the modulus."""
    numbers = [1234567890]
    for _ in range(999):
        numbers.append(16807 * numbers[-1] % 2147483647)
    assert numbers[1:4] == [395529916, 1209410747, 633705974]
    return np.array(numbers) / 2147483647


@pytest.mark.parametrize("name", TABLE_31)
def test_every_printed_digit_of_table_31(nist_1000: np.ndarray, name: str) -> None:
    found = deviation(nist_1000, 1.0, STATISTICS[name], sizes=[1, 10, 100])
    assert tuple(f"{value:.6e}" for value in found.deviation) == TABLE_31[name]


@pytest.mark.parametrize("name", TABLE_30)
def test_every_printed_digit_of_table_30(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("procedures.analysis.allan.statistic.FEWEST_SAMPLES", len(NBS14))
    found = deviation(NBS14, 1.0, STATISTICS[name], sizes=[1, 2])
    digits = [len(text.split(".")[1]) for text in TABLE_30[name]]
    assert tuple(f"{v:.{d}f}" for v, d in zip(found.deviation, digits, strict=True)) == TABLE_30[name]


OVERLAPPING_HADAMARD_1000 = """1 2.9439e-01 2 2.0125e-01 3 1.6240e-01 5 1.3344e-01 8 1.0987e-01 13 7.6285e-02
    21 4.9759e-02 34 4.5024e-02 55 3.5111e-02 89 3.3493e-02 143 2.5501e-02 231 1.2500e-02 247 1.1150e-02"""
"""The 1000 points as Stable32 prints them between the columns of Table 31."""


def test_every_printed_digit_between_the_columns(nist_1000: np.ndarray) -> None:
    words = OVERLAPPING_HADAMARD_1000.split()
    found = deviation(nist_1000, 1.0, OVERLAPPING_HADAMARD, sizes=[int(m) for m in words[::2]])
    assert [f"{value:.4e}" for value in found.deviation] == words[1::2]


STABLE32 = [  # statistic, samples, then rows of m, α, least, sigma, greatest as Stable32 1.60 prints them (68.3 %)
    (
        OVERLAPPING_ALLAN,
        1000,
        """1 0 2.8515e-01 2.9223e-01 2.9987e-01
        2 0 1.9520e-01 2.0102e-01 2.0738e-01
        4 0 1.3931e-01 1.4479e-01 1.5098e-01
        8 0 1.0038e-01 1.0570e-01 1.1198e-01
        16 0 5.7696e-02 6.1915e-02 6.7217e-02
        32 0 4.3654e-02 4.8082e-02 5.4202e-02
        64 0 3.1755e-02 3.6237e-02 4.3377e-02
        128 0 2.3045e-02 2.7674e-02 3.7027e-02""",
    ),
    (
        MODIFIED_ALLAN,
        1000,
        """2 0 1.5336e-01 1.5821e-01 1.6355e-01
        4 0 1.0322e-01 1.0780e-01 1.1304e-01
        8 0 6.9840e-02 7.4192e-02 7.9481e-02
        16 0 3.8022e-02 4.1376e-02 4.5809e-02
        32 0 3.0466e-02 3.4255e-02 3.9933e-02
        64 0 2.3687e-02 2.7871e-02 3.5511e-02
        128 0 1.4874e-02 1.8669e-02 2.8584e-02""",
    ),
    (
        OVERLAPPING_ALLAN,
        19982,
        """1 1 7.5672e-11 7.6143e-11 7.6622e-11
        2 1 3.9668e-11 3.9937e-11 4.0212e-11
        4 0 1.8650e-11 1.8816e-11 1.8987e-11
        8 1 9.6652e-12 9.7555e-12 9.8484e-12
        16 -2 6.0842e-12 6.2088e-12 6.3413e-12
        64 -2 4.8402e-12 5.0365e-12 5.2589e-12
        128 -1 5.1239e-12 5.3841e-12 5.6888e-12
        512 -2 4.6879e-12 5.2159e-12 5.9752e-12
        1024 -1 5.7328e-12 6.5443e-12 7.8393e-12
        2048 0 6.9598e-12 8.2071e-12 1.0509e-11
        4096 0 7.2435e-12 9.1057e-12 1.4019e-11""",
    ),
    (
        HADAMARD,
        19982,
        """1 1 7.9145e-11 7.9695e-11 8.0257e-11
        4 0 1.9211e-11 1.9473e-11 1.9745e-11
        16 -2 5.3215e-12 5.4399e-12 5.5666e-12
        128 -1 4.8839e-12 5.2198e-12 5.6361e-12
        512 -2 3.9824e-12 4.4684e-12 5.1904e-12
        2048 -2 7.3681e-12 9.1993e-12 1.3822e-11""",
    ),
    (
        OVERLAPPING_HADAMARD,
        19982,
        """1 1 7.9203e-11 7.9753e-11 8.0315e-11
        2 1 4.2296e-11 4.2610e-11 4.2931e-11
        4 0 1.9603e-11 1.9793e-11 1.9990e-11
        8 1 9.8549e-12 9.9549e-12 1.0058e-11
        16 -2 5.4935e-12 5.6036e-12 5.7207e-12
        32 -2 4.2398e-12 4.3595e-12 4.4900e-12
        64 -2 4.1180e-12 4.2817e-12 4.4667e-12
        128 -1 4.6679e-12 4.9244e-12 5.2287e-12
        256 -1 4.1723e-12 4.4968e-12 4.9112e-12
        512 -2 3.8499e-12 4.2789e-12 4.8931e-12
        1024 -1 4.2162e-12 4.8704e-12 5.9683e-12
        2048 0 6.4971e-12 7.7990e-12 1.0424e-11
        4096 0 6.5430e-12 8.4681e-12 1.4748e-11""",
    ),
    (
        TIME,
        19982,
        """1 1 4.3689e-11 4.3961e-11 4.4238e-11
        2 1 3.2336e-11 3.2568e-11 3.2805e-11
        4 0 2.2040e-11 2.2261e-11 2.2490e-11
        8 1 1.9202e-11 1.9470e-11 1.9750e-11
        16 -2 3.1452e-11 3.2159e-11 3.2915e-11
        32 -2 6.4932e-11 6.6986e-11 6.9250e-11
        64 -2 1.4705e-10 1.5359e-10 1.6111e-10
        128 -1 3.1063e-10 3.2813e-10 3.4897e-10
        256 -1 5.6516e-10 6.1021e-10 6.6807e-10
        512 -2 1.1524e-09 1.2957e-09 1.5104e-09
        1024 -1 3.0605e-09 3.5476e-09 4.3778e-09
        2048 0 6.7733e-09 8.3072e-09 1.1784e-08
        4096 0 1.7460e-08 2.3192e-08 4.6937e-08""",
    ),
]


@pytest.mark.parametrize(("statistic", "count", "rows"), STABLE32, ids=lambda v: getattr(v, "name", None))
def test_the_intervals_that_stable32_prints(statistic: Statistic, count: int, rows: str) -> None:
    """From its own sigma and exponent, so that only degrees of freedom and interval are on trial.

    To the five digits printed, of sigma and limit each (and the four of the edf's tables), where the degrees of
    freedom are fewer than 100. Above, all its intervals are narrower than ours by 0.6 % of their width: it has an
    approximate quantile there.
    """
    for row in rows.splitlines():
        m, alpha, least, sigma, greatest = (float(word) for word in row.split())
        edf = degrees_of_freedom(statistic, int(alpha), int(m), count, averaged=True)
        lower, upper = interval(np.array([sigma]), np.array([edf]), ONE_SIGMA)
        if edf < 100:
            assert (lower[0], upper[0]) == pytest.approx((least, greatest), rel=1.5e-4), row
        else:
            assert upper[0] - lower[0] == pytest.approx(1.006 * (greatest - least), rel=0.003), row
