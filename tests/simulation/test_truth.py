"""Truth files: what is shipped, what is refused, and that a saved truth is read back."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from procedures.core import units
from simulators.truth import (
    TableTruth,
    TriadTruth,
    TruthError,
    default_bench,
    default_unit,
    load_bench,
    load_unit,
    random_table_truth,
    random_unit_truth,
    save_bench,
    save_unit,
)
from simulators.truth.files import parse_bench, parse_unit

UNIT = """
serial = "U"
[gyro]
bias_deg_h = [1.0, 2.0, 3.0]
matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
quantization_arcsec = [1.0, 1.0, 1.0]
[accelerometer]
bias_m_s2 = [0.1, 0.2, 0.3]
matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
quantization_ug_s = [10.0, 10.0, 10.0]
"""


def test_the_shipped_unit_has_the_published_figures() -> None:
    unit = default_unit()
    assert unit.serial == "SIM-0001"
    assert unit.sample_rate_hz == 400.0
    np.testing.assert_allclose(np.array(unit.gyro.bias) / units.DEG_PER_HOUR, [0.1856, 0.026498, -0.027218])
    assert unit.gyro.matrix[1][2] == -0.0091769
    assert unit.accelerometer.matrix[1] == (0.0010164, 0.85883, 0.0053613)
    assert unit.gyro.pulse[0] / units.ARCSEC == pytest.approx(0.775)  # 2·0.3875: dithered
    assert unit.accelerometer.pulse[0] == pytest.approx(2.157463e-4)  # 2·11e-6·9.80665
    bare = replace(unit.gyro, dithered=False)
    assert bare.pulse[0] / units.ARCSEC == pytest.approx(1.342339)  # 0.3875·√12


def test_the_shipped_bench_is_true_within_what_it_declares() -> None:
    bench = default_bench()
    accuracy, table = bench.description.accuracy, bench.table
    assert bench.description.id == "sim"
    assert bench.description.simulated
    assert bench.description.inner.maximum_deg == 400.0
    assert abs(table.outer_middle_nonorthogonality_arcsec) <= accuracy.orthogonality_sd_arcsec
    assert abs(table.middle_inner_nonorthogonality_arcsec) <= accuracy.orthogonality_sd_arcsec
    assert abs(table.azimuth_error_arcsec) <= bench.description.site.azimuth_sd_arcsec
    assert table.pointing_sd_arcsec <= accuracy.pointing_sd_arcsec


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "bias_deg_h = [1.0, 2.0, 3.0]",
            "bias_deg_h = [1.0, nan, 3.0]",
            r"gyro.bias_deg_h\[1\] = nan must be a number within",
        ),
        ("bias_deg_h = [1.0", "bias_deg_h = [1e9", r"gyro.bias_deg_h\[0\] = 1000000000.0 must be .* -100000 … 100000"),
        ("bias_deg_h", "bias_deg_s", "gyro.bias_deg_s = .* is not known"),
        ("bias_m_s2 = [0.1, 0.2, 0.3]", "", "accelerometer.bias_m_s2 is missing"),
        ("[1.0, 1.0, 1.0]", "[1.0, 1.0]", "gyro.quantization_arcsec = .* must be a list of 3"),
        ("[10.0, 10.0, 10.0]", "[10.0, 0.0, 10.0]", r"quantization_ug_s\[1\] = 0.0 must be"),
        ("[0.0, 0.0, 1.0]]", "[0.0, 1.0, 0.0]]", "gyro: matrix = .* invertible"),
        ("[10.0, 10.0, 10.0]", "[10.0, 10.0, 10.0]\ndithered = 1", "accelerometer.dithered = 1 must be true or false"),
        (
            "[1.0, 1.0, 1.0]",
            "[1.0, 1.0, 1.0]\ndither_residue_arcsec = [0.1, -0.1, 0.1]",
            r"gyro.dither_residue_arcsec\[1\] = -0.1 must be a number within 0 … 1000",
        ),
        (
            "[1.0, 1.0, 1.0]",
            "[1.0, 1.0, 1.0]\ndither_frequency_hz = [0.1, nan, 0.1]",
            r"gyro.dither_frequency_hz\[1\] = nan must be a number within 0 … 100000",
        ),
        (
            "[10.0, 10.0, 10.0]",
            "[10.0, 10.0, 10.0]\nself_heating_1_time_s = 0.0",
            "accelerometer.self_heating_1_time_s = 0.0 must be a number within 1 … 1e",
        ),
        (
            "[10.0, 10.0, 10.0]",
            '[10.0, 10.0, 10.0]\nself_heating_2_ug = [1.0, "2", 1.0]',
            r"accelerometer.self_heating_2_ug\[1\] = '2' must be a number within",
        ),
        ('"U"', '"U"\nsample_rate_hz = "fast"', "sample_rate_hz = 'fast' must be a number"),
        ("[gyro]", "[gyro", "not a TOML file"),
    ],
)
def test_a_refused_truth_names_field_value_and_range(old: str, new: str, message: str) -> None:
    with pytest.raises(TruthError, match=message):
        parse_unit(UNIT.replace(old, new))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("dither_residue", (0.0, -1e-9, 0.0)),
        ("dither_frequency_hz", (float("nan"), 1.0, 1.0)),
        ("self_heating_1", (float("inf"), 0.0, 0.0)),
        ("self_heating_2_time_s", 0.0),
    ],
)
def test_values_made_in_code_are_refused_by_name_too(field: str, value: object) -> None:
    with pytest.raises(TruthError, match=rf"{field} = .* must"):
        replace(default_unit().gyro, **{field: value})


def test_a_refused_bench_names_its_field(tmp_path: Path) -> None:
    save_bench(default_bench(), tmp_path / "bench.toml")
    text = (tmp_path / "bench.toml").read_text()
    for old, new, message in [
        ("pointing_sd_arcsec = 0.5", "pointing_sd_arcsec = -0.5", "table_truth.pointing_sd_arcsec = -0.5 must be"),
        ("latitude_deg = 50.45", "latitude_deg = 95.0", "site.latitude_deg = 95.0 is outside"),
        ("[site_truth]", "[sight_truth]", "bench.sight_truth = .* is not known"),
        ("maximum_deg", "largest_deg", "description.outer.largest_deg = 360.0 is not known"),
    ]:
        with pytest.raises(TruthError, match=message):
            parse_bench(text.replace(old, new))


def test_a_saved_truth_is_read_back(tmp_path: Path) -> None:
    unit = replace(random_unit_truth(4), serial='odd "name"')
    unit = replace(unit, gyro=replace(unit.gyro, dithered=False, self_heating_2=(1e-9, 2e-9, -3e-9)))
    save_unit(unit, tmp_path / "unit.toml")
    back = load_unit(tmp_path / "unit.toml")
    assert back.serial == unit.serial
    for name in ("gyro", "accelerometer"):
        for field in TriadTruth.__dataclass_fields__:
            np.testing.assert_allclose(getattr(back.triad(name), field), getattr(unit.triad(name), field), rtol=1e-14)
    save_bench(default_bench(), tmp_path / "bench.toml")
    assert load_bench(tmp_path / "bench.toml") == default_bench()


def test_an_unstated_site_truth_is_the_declared_site() -> None:
    axis = "{ minimum_deg = -360, maximum_deg = 360, rate_deg_s = 60, acceleration_deg_s2 = 100 }"
    axes = "\n".join(f"{name} = {axis}" for name in ("outer", "middle", "inner"))
    bench = parse_bench(f'[description]\nid = "b"\nsite = {{ latitude_deg = 10, gravity_m_s2 = 9.79 }}\n{axes}')
    assert bench.site.gravity_m_s2 == 9.79
    assert bench.table == TableTruth()


def test_random_tables_have_the_declared_spread_and_random_units_differ() -> None:
    tables = [random_table_truth(s, 3.0, 5.0, 1.0, 2.0) for s in range(500)]
    # 500 draws: 3.2 %, 4 sigma.
    assert np.std([t.outer_middle_nonorthogonality_arcsec for t in tables]) == pytest.approx(3.0, rel=0.13)
    assert np.std([t.azimuth_error_arcsec for t in tables]) == pytest.approx(5.0, rel=0.13)
    assert np.std([t.base_tilt_east_arcsec for t in tables]) == pytest.approx(2.0, rel=0.13)
    assert random_unit_truth(1) == random_unit_truth(1)
    assert random_unit_truth(1).gyro.matrix != random_unit_truth(2).gyro.matrix
