"""Methods that need no bench, through REST: on the recordings and the calibration of one job of the simulated bench."""

import pytest

from procedures.core import units
from tests.service.client import Client

SITE = {"latitude_deg": 50.45, "gravity_m_s2": 9.810553}
"""Of the simulated bench."""


@pytest.fixture(scope="module")
def evidence(sqlite_client: Client) -> tuple[list[str], list[str]]:
    """Recordings of twelve stations, in order, and the calibrations that they gave, gyros first."""
    parameters = {"dwell_s": 8.0, "settle_s": 0.5}
    job = sqlite_client.wait(sqlite_client.submit(seed=7, parameters=parameters)["id"])
    assert job["state"] == "succeeded", job
    recordings = sorted(sqlite_client.recordings(job["id"]), key=lambda r: r["station"]["index"])
    calibrations = sqlite_client.http.get("/api/v1/units/SIM-0001/calibrations").json()["items"]
    return [r["id"] for r in recordings], [c["id"] for c in reversed(calibrations)]


def result(client: Client, method: str, **body: object) -> dict:
    answer = client.analyse(method, **body)
    assert answer.status_code == 201, answer.text
    assert client.http.get(answer.json()["page"]).status_code == 200
    return answer.json()["document"]


def test_error_growth_says_what_a_calibration_buys(
    sqlite_client: Client, evidence: tuple[list[str], list[str]]
) -> None:
    parameters = {"latitude_deg": 50.45, "hours": 1.0}
    found = result(sqlite_client, "error_growth", calibrations=evidence[1], parameters=parameters)
    assert "After one hour parked, the position is within" in found["sentence"]
    assert found["calibration_radius_95_1h_m"] > 0
    # The unit's record has changes from launch to launch.
    assert {s["source"] for s in found["shares"]} >= {"gyro calibration", "gyro launch to launch", "gyro random walk"}
    assert found["schuler_period_s"] / 60 == pytest.approx(84.4, abs=0.1)


def test_the_first_station_is_aligned_to_the_tables_zero(
    sqlite_client: Client, evidence: tuple[list[str], list[str]]
) -> None:
    recordings, calibration = evidence
    body = {"recordings": [recordings[4]], "calibrations": calibration, "parameters": SITE}  # (β, γ) = (0, 0)
    (attitude,) = result(sqlite_client, "initial_alignment_of_recording", **body)["attitudes"]
    heading = (attitude["heading_deg"] + 180.0) % 360.0 - 180.0  # the table's zero looks north
    # The noise that made the calibration is partly the recording's own, so the error is rather less than claimed.
    assert abs(heading) < 4 * attitude["heading_sd_deg"]
    assert abs(attitude["pitch_deg"]) < 4 * attitude["pitch_sd_deg"] + 0.001  # levelled to arcseconds
    assert abs(attitude["roll_deg"]) < 4 * attitude["roll_sd_deg"] + 0.001


def test_the_kalman_filter_finds_the_mean_of_a_recording(
    sqlite_client: Client, evidence: tuple[list[str], list[str]]
) -> None:
    parameters = {"channels": ["gyro_x", "accelerometer_y"], "window_s": 0.25}
    found = result(sqlite_client, "kalman_calibration", recordings=[evidence[0][4]], parameters=parameters)
    gyro, accelerometer = found["biases"]
    assert gyro["noise"] == accelerometer["noise"] == "record"
    assert gyro["standard_uncertainty"] < gyro["white_standard_uncertainty"]  # quantization falls faster
    assert abs(gyro["bias"] - gyro["batch_mean"]) < 4 * gyro["white_standard_uncertainty"]
    alone = 0.001425 * units.DEG_PER_SQRT_HOUR / 8.0**0.5  # the angle random walk of its truth
    assert gyro["standard_uncertainty"] > alone


def test_field_calibration_of_the_same_recordings_agrees_with_the_bench(
    sqlite_client: Client, evidence: tuple[list[str], list[str]]
) -> None:
    parameters = {**SITE, "tilt": "base", "cross_coupling_sd": 0.01, "angle_sd_arcsec": 5.0, "scale_sd_limit": 0.02}
    found = result(sqlite_client, "field_calibration", recordings=evidence[0], parameters=parameters)
    accelerometer = found["triads"][0]
    listed = sqlite_client.http.get("/api/v1/units/SIM-0001/calibrations").json()["items"]
    bench = next(c["calibration"] for c in listed if c["id"] == evidence[1][1])
    for c, (k, sd) in enumerate(zip(accelerometer["scale"], accelerometer["scale_relative_sd"], strict=True)):
        assert abs(k / bench["matrix"][c][c] - 1.0) < 4 * sd  # the same noise is in both
    refused = sqlite_client.analyse("field_calibration", recordings=evidence[0][:1], parameters=parameters)
    assert refused.status_code == 422
    small = {**SITE, "positions": [[0, 0], [3, 3]]}
    refused = sqlite_client.analyse("field_calibration", recordings=evidence[0][:2], parameters=small)
    assert refused.status_code == 422
    assert "turn farther" in refused.json()["detail"]


def test_a_plan_for_the_unit_of_a_recording(sqlite_client: Client, evidence: tuple[list[str], list[str]]) -> None:
    parameters = {**SITE, "station_counts": [8], "starts": 1, "dwell_s": 70.0}
    found = result(sqlite_client, "plan_orientations", recordings=evidence[0][:1], parameters=parameters)
    assert len(found["plans"]) == 2
    assert "times surer" in found["sentence"]


def test_nothing_to_work_on_is_refused(sqlite_client: Client) -> None:
    for method, parameters in (
        ("error_growth", {"latitude_deg": 50.0}),
        ("initial_alignment_of_recording", SITE),
        ("kalman_calibration", {}),
        ("field_calibration", SITE),
        ("plan_orientations", SITE),
    ):
        answer = sqlite_client.analyse(method, parameters=parameters)
        assert answer.status_code == 422, method
    pole = sqlite_client.analyse("error_growth", parameters={"latitude_deg": 90.0, "declared": {}})
    assert pole.status_code == 422
    assert "latitude_deg" in pole.text
