"""Thermometers, a stop rule and the dependence of recordings on temperature through REST, on the simulated bench."""

import pytest

from tests.service.client import Client
from tests.service.page import page

UNIT = "/api/v1/units/SIM-0001"
SOAKS = {"temperatures_c": [0.0, 20.0, 40.0, 20.0], "soak_s": 7200.0, "sample_rate_hz": 10.0}


@pytest.fixture(scope="module")
def calibrated(sqlite_client: Client) -> dict:
    job = sqlite_client.wait(sqlite_client.submit("thermometer_calibration", parameters=SOAKS, seed=4)["id"])
    assert (job["state"], job["verdict"]) == ("succeeded", "fail"), job
    assert sqlite_client.http.get(UNIT).json()["thermometers"] is None, "soaks this short fail, and count for no job"
    (made,) = sqlite_client.http.get(f"{UNIT}/corrections", params={"kind": "thermometers"}).json()["items"]
    remark = {"remark": "slopes of soaks of two hours; the offsets are good"}
    assert sqlite_client.http.post(f"{UNIT}/corrections/{made['id']}/current", json=remark).json()["current"]
    return job


def test_the_chambers_accuracy_and_a_short_soak_are_told_beforehand(sqlite_client: Client) -> None:
    plan = sqlite_client.preview("thermometer_calibration", **SOAKS).json()
    of = {u["name"]: u["standard_uncertainty"] for u in plan["predicted_uncertainties"]}
    assert of["temperature_case.offset"] > 0.58
    assert "a longer soak makes them smaller" in plan["warnings"][0]
    assert len(plan["stations"]) == 4
    bad = sqlite_client.preview("thermometer_calibration", **{**SOAKS, "temperatures_c": [20.0, 20.0, 40.0]})
    assert bad.status_code == 422
    assert bad.json()["errors"][0]["field"].endswith("temperatures_c")
    assert "none twice in a row" in bad.text


def test_the_units_record_has_its_thermometers(sqlite_client: Client, calibrated: dict) -> None:
    unit = sqlite_client.http.get(UNIT).json()
    stored = sqlite_client.http.get(f"{UNIT}/corrections/{unit['thermometers']}").json()
    assert (stored["kind"], stored["current"], stored["approval"]) == ("thermometers", True, "open")
    assert [s["channel"] for s in stored["thermometers"]["sensors"]][:2] == [
        "temperature_case",
        "temperature_converter",
    ]
    # Offsets of the truth differ by 0.7 °C; the chamber's part is common to both and drops out.
    case, converter = (s["offset_c"] for s in stored["thermometers"]["sensors"][:2])
    assert case - converter == pytest.approx(0.7, abs=0.15)
    words = page(sqlite_client, "/units/SIM-0001").words
    assert "temperature_gyro_z" in words
    result = page(sqlite_client, f"/results/{calibrated['result']}").words
    assert "Up against down" in result


def test_recordings_with_temperatures_are_fitted_by_a_method(sqlite_client: Client, calibrated: dict) -> None:
    recordings = sqlite_client.http.get("/api/v1/recordings", params={"job": calibrated["id"]}).json()["items"]
    body = {
        "method": "temperature_dependence",
        "recordings": [r["id"] for r in recordings],
        "parameters": {"channels": ["accelerometer_x"], "sensor": "temperature_case", "cell_s": 1.0, "soaks": False},
    }
    answer = sqlite_client.http.post("/api/v1/analyses", json=body)
    assert answer.status_code == 201, answer.text
    found = answer.json()["document"] if "document" in answer.json() else answer.json()["result"]
    assert found["channels"][0]["sensor"] == "temperature_case"
    assert found["thermometers"] == sqlite_client.http.get(UNIT).json()["thermometers"]
    assert answer.json()["lineage"]["corrections"] == [found["thermometers"]]
    body["parameters"] = {"channels": ["accelerometer_x"]}
    refused = sqlite_client.http.post("/api/v1/analyses", json=body)
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"].endswith("sensor")
    assert "temperature_gyro_x" in refused.text


def test_a_stop_rule_ends_the_dwells_of_a_job_and_its_result_tells_what_it_saved(sqlite_client: Client) -> None:
    parameters = {
        "orientations": [[0, -90], [0, 90], [90, 0], [-90, 0], [0, 0], [180, 0]],
        "scalar_check": False,
        "dwell_s": 60.0,
        "settle_s": 0.5,
        "stop_at": {"gyro_deg_h": 0.1},
    }
    job = sqlite_client.wait(sqlite_client.submit(parameters=parameters, seed=8)["id"])
    assert job["state"] == "succeeded", job
    document = sqlite_client.http.get(f"/api/v1/jobs/{job['id']}/result").json()
    dwells = (document.get("document") or document["result"])["dwells"]
    assert all(d["by_rule"] for d in dwells["dwells"])
    assert 0.0 < dwells["share"] < 1.0
    recordings = sqlite_client.http.get("/api/v1/recordings", params={"job": job["id"]}).json()["items"]
    assert {r["duration_s"] for r in recordings} == {d["duration_s"] for d in dwells["dwells"]}
    assert recordings[0]["station"]["until"]["targets"][0]["channel"] == "gyro_x"
    empty = sqlite_client.preview("calibration_12_orientations", stop_at={})
    assert empty.status_code == 422
    assert "without a target nothing ends a dwell" in empty.text
