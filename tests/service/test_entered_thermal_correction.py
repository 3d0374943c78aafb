"""Thesis table 4.4 through REST: entered, made current by a person, and applied to a calibration."""

import io
from typing import Any

import numpy as np
import pandas as pd
import pytest

from bench_service.drivers.simulated import SimulatedDriver
from tests.kit.forward_model import turn
from tests.service.client import Client

UNIT = "/api/v1/units/SIM-0001"
TABLE_4_4 = {
    "x": ((1.3306e-12, 1.6612e-9, 1.6292e-8, -6.0141e-5), (6.326e-5, 2.5551e-9, -4.505e-6, 1.3608e-12)),
    "y": ((3.2212e-12, -2.004e-8, 1.6158e-8, -5.303e-5), (2.5936e-4, -2.0542e-7, -8.6913e-6, -1.3042e-10)),
    "z": ((3.307e-12, -2.247e-9, 1.6626e-8, -5.6567e-5), (1.601e-5, 2.0265e-8, 7.0267e-7, 9.0582e-11)),
}
"""α1 … α4 and β1 … β4 of each axis, named as thesis 4.1 does: the table prints α3 and α4 in each other's place."""
CODES_PER_C = 16.0
"""Ours, since the thesis does not print it. A power of two: products with it are exact."""
SCALE, BIAS = (1.2, 1.16, 1.17), (-0.09, 0.02, 0.0)


@pytest.fixture(scope="module")
def entered(sqlite_client: Client) -> dict[str, Any]:
    axes = [
        {
            "scale": SCALE[i],
            "bias_m_s2": BIAS[i],
            "alpha": alpha,
            "beta": beta,
            "alpha_sd": [abs(v) / 100.0 for v in alpha],
            "beta_sd": [abs(v) / 100.0 for v in beta],
        }
        for i, (alpha, beta) in enumerate(TABLE_4_4.values())
    ]
    parameters = {"origin": "thesis table 4.4", "axes": axes}
    parameters |= {"case_codes_per_c": CODES_PER_C, "converter_codes_per_c": CODES_PER_C}
    answer = sqlite_client.analyse("entered_thermal_correction", unit="SIM-0001", parameters=parameters)
    assert answer.status_code == 201, answer.text
    (stored,) = sqlite_client.http.get(f"{UNIT}/corrections", params={"kind": "thermal"}).json()["items"]
    assert stored["result"] == answer.json()["id"]
    return stored


def test_the_coefficients_come_back_to_the_last_digit(entered: dict[str, Any]) -> None:
    for axis, (alpha, beta) in zip(entered["thermal"]["axes"], TABLE_4_4.values(), strict=True):
        a, b = (
            np.array(alpha) * CODES_PER_C ** np.array([2, 1, 2, 1]),
            np.array(beta) * CODES_PER_C ** np.array([1, 2] * 2),
        )
        assert axis["alpha"] == a.tolist()
        assert axis["beta"] == b.tolist()
        sd = np.sqrt(np.diagonal(axis["covariance"]))
        np.testing.assert_allclose(sd, np.abs([*a, *b]) / 100.0, rtol=1e-15)


def test_it_counts_when_a_person_says_so_and_a_calibration_applies_it(
    sqlite_client: Client, entered: dict[str, Any]
) -> None:
    http, warm = sqlite_client.http, {"dwell_s": 70.0, "thermal_correction": "current"}
    assert entered["current"] is False
    refused = sqlite_client.preview(**warm)
    assert refused.status_code == 422, "entered, and nobody has said that it counts"
    chosen = http.post(f"{UNIT}/corrections/{entered['id']}/current", json={"by": "Ann", "remark": "of the passport"})
    assert [(d["act"], d["by"]) for d in chosen.json()["decisions"]] == [("chosen", "Ann")]
    job = sqlite_client.wait(sqlite_client.submit(parameters=warm, seed=12)["id"])
    assert job["state"] == "succeeded", job
    result = http.get(f"/api/v1/jobs/{job['id']}/result").json()
    assert result["lineage"]["corrections"] == [entered["id"]]
    assert any("does not say at which temperatures" in w for w in result["document"]["warnings"]), (
        "a table says no range"
    )
    triad, share = result["document"]["triads"][1], result["document"]["thermal"]
    rows = {c["name"]: c["estimate"] for c in triad["coefficients"]}
    gravity = SimulatedDriver("sim").description.site.gravity_m_s2
    for k, station in enumerate(triad["residuals"]):
        beta, gamma = (float(part.split("=")[1]) for part in station["label"].split())
        felt = turn("x", beta).T @ turn("z", gamma).T @ np.array([0.0, gravity, 0.0])
        at_20 = np.array([rows[f"accelerometer.b_{a}"] for a in "xyz"])
        at_20 += station["residual"]
        at_20 += np.array([[rows[f"accelerometer.K{i}{j}"] for j in (1, 2, 3)] for i in (1, 2, 3)]) @ felt
        for i, (alpha, beta_) in enumerate(TABLE_4_4.values()):
            dt, db = (CODES_PER_C * (share[name][k] - 20.0) for name in ("case_c", "converter_c"))
            a = alpha[0] * dt**2 + alpha[1] * dt + alpha[2] * db**2 + alpha[3] * db
            b = beta_[0] * dt + beta_[1] * dt**2 + beta_[2] * db + beta_[3] * db**2
            raw = SCALE[i] * (at_20[i] + BIAS[i]) / (SCALE[i] + a) - BIAS[i] - b
            assert share["change_m_s2"][k][i] == pytest.approx(at_20[i] - raw, abs=1e-7)
    samples_go_out_corrected_by_it_until_it_is_rejected(sqlite_client, entered, job["id"])


def samples_go_out_corrected_by_it_until_it_is_rejected(client: Client, entered: dict[str, Any], job: str) -> None:
    """The formula of thesis 4.1 once more, sample by sample; `job`: one that recorded the temperatures."""
    http = client.http
    recording = client.recordings(job)[0]["id"]
    query = {"corrected_by": entered["id"], "stop_s": 1.0}
    answer = http.get(f"/api/v1/recordings/{recording}/samples", params=query)
    assert answer.status_code == 200, answer.text
    assert "-physical-corrected-part-simulated.csv" in answer.headers["Content-Disposition"]
    found = pd.read_csv(io.BytesIO(answer.content))
    plain = pd.read_csv(io.BytesIO(http.get(f"/api/v1/recordings/{recording}/samples", params={"stop_s": 1.0}).content))
    for name, axis in zip("xyz", entered["thermal"]["axes"], strict=True):
        dt = plain["temperature_case_degC"] - axis["case_reference_c"]
        db = plain["temperature_converter_degC"] - axis["converter_reference_c"]
        (a1, a2, a3, a4), (b1, b2, b3, b4) = axis["alpha"], axis["beta"]
        scale = axis["scale"] + a1 * dt**2 + a2 * dt + a3 * db**2 + a4 * db
        force = scale * (
            plain[f"accelerometer_{name}_m_per_s2"] + axis["bias_m_s2"] + b1 * dt + b2 * dt**2 + b3 * db + b4 * db**2
        )
        wanted = force / axis["scale"] - axis["bias_m_s2"]
        np.testing.assert_allclose(found[f"accelerometer_{name}_m_per_s2"], wanted, rtol=1e-12, atol=1e-12)
    http.post(f"{UNIT}/corrections/{entered['id']}/reject", json={"by": "Ann", "remark": "of another unit"})
    refused = http.get(f"/api/v1/recordings/{recording}/samples", params=query)
    assert (refused.status_code, "not rejected" in refused.text) == (422, True)
