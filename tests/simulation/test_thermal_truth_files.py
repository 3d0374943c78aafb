"""Chamber, faults, operator and the unit's heat in truth files: left out, said, refused, read back."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from procedures.bench.chamber import ChamberLimits
from procedures.core.units import DEG_PER_HOUR
from simulators.truth import (
    OperatorTruth,
    TruthError,
    default_bench,
    default_unit,
    load_bench,
    load_unit,
    random_unit_truth,
    save_bench,
    save_unit,
)
from simulators.truth.files import parse_bench, parse_unit
from simulators.truth.thermal import (
    ChamberFault,
    ChamberTruth,
    GyroThermalTruth,
    UnitThermalTruth,
    random_thermal_truth,
)

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
AXIS = "{ minimum_deg = -360, maximum_deg = 360, rate_deg_s = 60, acceleration_deg_s2 = 100 }"
BENCH = f"""
[description]
id = "b"
site = {{ latitude_deg = 10, gravity_m_s2 = 9.79 }}
outer = {AXIS}
middle = {AXIS}
inner = {AXIS}
"""
CHAMBER = "chamber = { minimum_c = -40, maximum_c = 60, ramp_c_min = 2, ambient_c = 20 }\n"


def test_what_is_not_said_is_the_default_and_the_shipped_bench_has_a_chamber() -> None:
    assert parse_unit(UNIT).thermal == UnitThermalTruth() == default_unit().thermal
    bench = parse_bench(BENCH)
    assert (bench.chamber, bench.chamber_faults, bench.operator) == (ChamberTruth(), (), OperatorTruth())
    assert bench.description.chamber is None
    assert default_bench().description.chamber == ChamberLimits(-60.0, 100.0, 5.0, 22.0)
    assert parse_bench(BENCH + CHAMBER).description.chamber == ChamberLimits(-40.0, 60.0, 2.0, 20.0)


def test_what_is_said_is_in_its_unit_and_the_rest_stays() -> None:
    told = """
[thermal.network]
case_w = 20.0
[thermal.accelerometer_y]
scale_static_ppm = [4.0, 0.5]
bias_dynamic_m_s2 = [1e-3, 2e-5]
[thermal.converter_z]
scale_drift_ppm = [-7.0, 0.25]
[thermal.gyro]
fault_residue_deg_h = [0.0, 0.01, 0.0]
[thermal.thermometer_gyro_x]
stuck_from_s = 3600.0
"""
    found, default = parse_unit(UNIT + told).thermal, UnitThermalTruth()
    assert found.network == replace(default.network, case_w=20.0)
    assert found.accelerometers[1].scale_static == pytest.approx((4e-6, 5e-7))
    assert found.accelerometers[1].bias_dynamic == (1e-3, 2e-5)
    assert found.accelerometers[1].bias_static == default.accelerometers[1].bias_static
    assert found.accelerometers[0] == default.accelerometers[0]
    assert found.converter[2].scale_drift == pytest.approx((-7e-6, 2.5e-7))
    assert found.gyro.fault_residue_rad_s_c == pytest.approx((0.0, 0.01 * DEG_PER_HOUR, 0.0))
    assert found.thermometers[2] == replace(default.thermometers[2], stuck_from_s=3600.0)
    assert found.thermometers[3] == default.thermometers[3]


def test_what_is_said_of_a_bench_is_kept() -> None:
    told = """
[chamber_truth]
cooling_w = 500.0
[operator_truth]
fixture_tilt_sd_arcsec = 60.0
[[chamber_faults]]
name = "heater_stuck"
from_s = 25200
[[chamber_faults]]
name = "link_lost"
from_s = 0.0
"""
    bench = parse_bench(BENCH + told)
    assert bench.chamber == ChamberTruth(cooling_w=500.0)
    assert bench.operator == OperatorTruth(fixture_tilt_sd_arcsec=60.0)
    assert bench.chamber_faults == (ChamberFault("heater_stuck", 25200.0), ChamberFault("link_lost", 0.0))


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("thermal = 3", r"thermal = 3 must be a table"),
        ("[thermal.heat]", r"thermal.heat = \{\} is not known; known are accelerometer_x, "),
        ("[thermal]\nnetwork = 1", r"thermal.network = 1 must be a table"),
        ("[thermal.network]\ncase_w = nan", r"thermal.network.case_w = nan must be a number within"),
        ("[thermal.network]\ncase_w = -1", r"thermal.network: network.case_w = -1.0 must be .* within 0 … 10000"),
        ("[thermal.network]\ncase = 1", r"thermal.network.case = 1 is not known"),
        ("[thermal.accelerometer_x]\nscale_static = [1, 2]", "accelerometer_x.scale_static = .* is not known"),
        ("[thermal.accelerometer_x]\nscale_static_ppm = [1]", "accelerometer_x.scale_static_ppm = .* a list of 2"),
        ("[thermal.accelerometer_x]\nbias_static_m_s2 = [1, inf]", r"bias_static_m_s2\[1\] = inf must be .* -10 … 10"),
        ("[thermal.accelerometer_x]\nblock_share = 2", "accelerometer_x.block_share = 2 must be .* within 0 … 1"),
        ("[thermal.converter_y]\ncodes_a_ma = 0", "converter_y.codes_a_ma = 0 must be a number within 1 … 1e"),
        ("[thermal.gyro]\nfault_residue_deg_h = 1.0", "thermal.gyro.fault_residue_deg_h = 1.0 must be a list of 3"),
        ("[thermal.thermometer_case]\nstep_c = 0", "thermometer_case: thermometer.step_c = 0.0 must be .* 1e-06 … 10"),
        ("[thermal.thermometer_case]\nstuck_from_s = -1", "stuck_from_s = -1.0 must be a number within 0 … inf"),
    ],
)
def test_a_refused_unit_names_field_value_and_range(more: str, message: str) -> None:
    text = more + UNIT if more.startswith("thermal =") else UNIT + more
    with pytest.raises(TruthError, match=message):
        parse_unit(text)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("[chamber_truth]\nair_j_k = 0", "chamber_truth: chamber.air_j_k = 0.0 must be a number within 0.001 … 1e"),
        ("[chamber_truth]\nair = 0", "chamber_truth.air = 0 is not known"),
        ("[chamber_truth]\nleast_c = 120", "chamber_truth: chamber: limiter_low_c <= least_c < most_c"),
        ("[operator_truth]\nset_by_hand_s = -1", "operator_truth.set_by_hand_s = -1.0 must be .* within 0 … 86400"),
        ("[chamber_faults]\nname = 1", r"chamber_faults = .* must be a list of tables"),
        ('[[chamber_faults]]\nname = "fire"\nfrom_s = 1', "chamber fault 'fire' is not known; known are heater_stuck"),
        ('[[chamber_faults]]\nname = "link_lost"', r"chamber_faults\[0\].from_s is missing"),
        ('[[chamber_faults]]\nname = "link_lost"\nfrom_s = nan', r"chamber_faults\[0\].from_s = nan must be"),
        (CHAMBER.replace("-40", "-61"), "description.chamber.minimum_c = -61.0 must be a number within -60 … 100"),
        (CHAMBER.replace("= 60", "= 101"), "description.chamber.maximum_c = 101.0 must be a number within -40 … 100"),
        (CHAMBER.replace("= 20", "= 70"), "description.chamber.ambient_c = 70.0 must be a number within -40 … 60"),
        (CHAMBER.replace("= 2,", "= 6,"), "description.chamber.ramp_c_min = 6.0 must be a number within 0.001 … 5"),
        (CHAMBER.replace(", ambient_c = 20", ""), "description.chamber.ambient_c is missing"),
    ],
)
def test_a_refused_bench_names_field_value_and_range(more: str, message: str) -> None:
    with pytest.raises(TruthError, match=message):
        parse_bench(BENCH + more)


def test_a_saved_truth_is_read_back(tmp_path: Path) -> None:
    drawn = random_unit_truth(4)
    assert drawn.thermal == random_thermal_truth(4)
    first, *rest = drawn.thermal.thermometers
    gyro = GyroThermalTruth((1e-9, 0.0, -2e-9))
    thermal = replace(drawn.thermal, gyro=gyro, thermometers=(replace(first, disconnected_from_s=7.5), *rest))
    save_unit(replace(drawn, thermal=thermal), tmp_path / "unit.toml")
    back = load_unit(tmp_path / "unit.toml").thermal
    assert (back.network, back.thermometers) == (thermal.network, thermal.thermometers)
    for one, other in zip(back.accelerometers, thermal.accelerometers, strict=True):
        for name in ("scale_static", "scale_dynamic", "bias_static", "bias_dynamic"):
            np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-14)
    np.testing.assert_allclose(back.gyro.fault_residue_rad_s_c, gyro.fault_residue_rad_s_c, rtol=1e-14)
    bench = replace(
        default_bench(),
        chamber=ChamberTruth(ambient_c=18.0),
        chamber_faults=(ChamberFault("heating_lost", 1.5),),
        operator=OperatorTruth(10.0, 20.0),
    )
    save_bench(bench, tmp_path / "bench.toml")
    assert load_bench(tmp_path / "bench.toml") == bench
