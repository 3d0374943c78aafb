"""The converter's bench and a calibration with a thermal correction, through REST on an empty database.

The correction is the default unit's truth with the uncertainties of a thermal cycle, written beside the service; what
finds one is tested elsewhere.
"""

from dataclasses import replace

import numpy as np
import pytest

from bench_service.persistence import open_stores
from procedures.core.converter import ConverterTriad
from procedures.core.thermal_correction import AxisCorrection, ThermalCorrection
from procedures.core.unit_correction import UnitCorrection
from simulators.truth import default_unit
from simulators.truth.thermal import REFERENCE_C
from tests.service.client import Client
from tests.service.page import page

BACKENDS = ("sqlite",)
"""What is computed with a correction; `tests/storage/test_corrections.py` has its rows on both databases."""

UNIT = "/api/v1/units/SIM-0001"
SPREAD = np.array([1e-9, 4e-8, 1e-9, 4e-8, 8e-7, 2e-8, 8e-7, 2e-8])
WARM = {"dwell_s": 70.0, "thermal_correction": "current"}


@pytest.fixture(scope="module")
def stage_one(client: Client) -> dict:
    """A short bench of the converter alone."""
    temperatures = [-20.0, 0.0, 20.0, 40.0, 60.0]
    parameters = {"temperatures_c": temperatures, "sample_rate_hz": 50.0, "slope_c_min": 0.05, "order": 2}
    parameters["reference_c"] = REFERENCE_C + default_unit().thermal.thermometers[1].offset_c  # of the truth
    job = client.wait(client.submit("converter_bench", parameters=parameters, seed=3)["id"])
    assert job["state"] == "succeeded", job
    return job


def truth_correction(first_stage: ConverterTriad | None) -> ThermalCorrection:
    """Correction that a cycle would find of the default unit, exactly."""
    unit = default_unit()
    case, board = (REFERENCE_C + t.offset_c for t in unit.thermal.thermometers[:2])
    axes = []
    for i, a in enumerate(unit.thermal.accelerometers):
        scale = 1.0 / unit.accelerometer.matrix[i][i]
        alpha = scale * np.array([a.scale_static[1], a.scale_static[0], a.scale_dynamic[1], a.scale_dynamic[0]])
        covariance = tuple(tuple(row) for row in np.diag(SPREAD**2).tolist())
        beta = (*a.bias_static, *a.bias_dynamic)
        bias = -unit.accelerometer.bias[i]
        axes.append(AxisCorrection(scale, bias, tuple(alpha.tolist()), beta, case, board, covariance=covariance))
    return ThermalCorrection("accelerometer", (axes[0], axes[1], axes[2]), first_stage)


def test_a_unit_without_a_correction_is_told_so_before_anything_moves(client: Client) -> None:
    body = {"unit": "RANDOM-5", "parameters": WARM}
    answer = client.http.post("/api/v1/procedures/calibration_12_orientations/preview", json=body)
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"].endswith("thermal_correction")
    assert "RANDOM-5 has no current thermal correction" in answer.text


def test_the_converters_bench_gives_the_unit_its_first_stage(client: Client, stage_one: dict) -> None:
    (stored,) = client.http.get(f"{UNIT}/corrections", params={"kind": "converter"}).json()["items"]
    assert (stored["current"], stored["result"], stored["simulated"]) == (True, stage_one["result"], True)
    for model, truth in zip(stored["converter"], default_unit().thermal.converter, strict=True):
        sd = model["scale"]["covariance"][0][0] ** 0.5
        assert abs(model["scale"]["at_reference"] / truth.codes_a_ma - 1) < 2e-5  # 4 ppm of it are the source's error
        assert sd / truth.codes_a_ma == pytest.approx(5e-6, rel=0.2), "the source's certificate"
    (first, *_) = client.recordings(stage_one["id"])
    assert [c["name"] for c in first["channels"]] == [
        "converter_x",
        "converter_y",
        "converter_z",
        "temperature_converter",
    ]
    shown = page(client, stage_one["page"])
    assert "Scale over temperature" in shown.words


def test_a_calibration_at_any_temperature_finds_the_unit_at_the_reference(
    client: Client, stage_one: dict, database_url: str
) -> None:
    stores, database = open_stores(database_url)
    try:
        result = stores.results.get(stage_one["result"])
        converter = stores.units.unit("SIM-0001").converter
        assert converter is not None
        correction = UnitCorrection("thermal", truth_correction(converter))
        stores.results.add(replace(result, id=f"{result.id}-t", job_id=None), corrections=[correction])
    finally:
        database.dispose()
    current = client.http.get(UNIT).json()["thermal_correction"]
    job = client.wait(client.submit(parameters=WARM, seed=12)["id"])
    assert job["state"] == "succeeded", job
    result = client.http.get(f"/api/v1/jobs/{job['id']}/result").json()
    assert result["lineage"]["corrections"] == [current]
    assert client.http.get(f"{UNIT}/corrections/{current}").json()["results"] == [result["id"]]
    truth = client.http.get(f"/api/v1/jobs/{job['id']}/truth").json()["triads"][1]
    true = np.column_stack([truth["bias"], truth["matrix"]]).ravel()
    assert np.all(np.abs(errors(result, true)) < 4)
    assert result["document"]["thermal"]["case_c"][0] > 20.0
    answer = client.http.post(f"/api/v1/jobs/{job['id']}/analyses", json={"parameters": {"thermal_correction": "none"}})
    plain = answer.json()
    assert plain["lineage"]["corrections"] == []
    assert "thermal" not in plain["document"]
    assert np.max(np.abs(errors(plain, true))) > 20
    shown = page(client, job["page"])
    assert "Accelerometer outputs brought to the reference temperatures" in shown.words
    assert current in shown.words


def errors(result: dict, true: np.ndarray) -> np.ndarray:
    """Errors of the accelerometers' twelve coefficients, in their own standard uncertainties."""
    found = result["document"]["triads"][1]["coefficients"]
    estimate, sd = (np.array([c[name] for c in found]) for name in ("estimate", "standard_uncertainty"))
    return (estimate - true) / sd
