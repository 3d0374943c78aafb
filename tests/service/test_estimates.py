"""Estimates so far over the API: of a dwell that is recorded, after each station, and where there are none."""

from typing import Any

import pytest

from tests.service.client import Client


@pytest.fixture(scope="module")
def calibrated(sqlite_client: Client) -> dict[str, Any]:
    return sqlite_client.wait(sqlite_client.submit(parameters={}, seed=7)["id"])


def of(client: Client, job: str) -> dict[str, Any]:
    answer = client.http.get(f"/api/v1/jobs/{job}/estimates")
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_after_its_last_station_a_calibration_has_its_results_coefficients_within_their_uncertainty(
    sqlite_client: Client, calibrated: dict[str, Any]
) -> None:
    found = of(sqlite_client, calibrated["id"])
    assert of(sqlite_client, str(calibrated["number"])) == found, "a job's number stands for its id"
    assert found["stations_done"] == 12
    assert found["not_estimated"] == {}
    result = sqlite_client.http.get("/api/v1/units/SIM-0001/calibrations?limit=2").json()["items"]
    final = {(c["subject"], c["name"]): c for one in result for c in one["coefficients"]}
    for triad in found["coefficients"]:
        for one in triad["coefficients"]:
            assert one["determined"]
            assert len(one["values"]) == 12
            known = final[triad["triad"], one["name"]]
            # the same data; the result weighs the channels together, and so tells flaws of table and unit apart
            doubt = max(one["standard_uncertainties"][-1], known["standard_uncertainty"])
            assert abs(one["values"][-1] - known["value"]) < 4.0 * doubt, one["name"]


def test_the_dwell_has_bias_and_allan_deviation_of_each_inertial_channel(
    sqlite_client: Client, calibrated: dict[str, Any]
) -> None:
    dwell = of(sqlite_client, calibrated["id"])["dwell"]
    assert dwell["station"] == 11
    assert dwell["recorded_s"] == pytest.approx(70.0)
    assert {one["channel"] for one in dwell["bias"]} == {
        f"{triad}_{axis}" for triad in ("gyro", "accelerometer") for axis in "xyz"
    }
    for one in dwell["bias"]:
        assert one["standard_uncertainty"] > 0.0
        assert len(one["course"]) == len(one["at_s"]) == len(one["course_uncertainty"])
        assert one["course"][-1] == pytest.approx(one["estimate"])
    for one in dwell["allan"]:
        assert all(low < at < high for low, at, high in zip(one["lower"], one["deviation"], one["upper"], strict=True))


def test_a_job_without_recordings_has_no_estimates_and_an_unknown_one_is_not_found(sqlite_client: Client) -> None:
    job = sqlite_client.wait(sqlite_client.submit("no_operation")["id"])
    assert of(sqlite_client, job["id"])["dwell"] is None
    assert sqlite_client.http.get("/api/v1/jobs/none/estimates").status_code == 404
