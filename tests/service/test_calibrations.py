"""Calibrations that count, one a triad, through REST, the pages and the command line."""

import pytest

from procedures.core.imu_model import COEFFICIENT_NAMES, coefficient_unit
from tests.service.client import Client

UNIT = "/api/v1/units/SIM-0001"
PATH = f"{UNIT}/calibrations"
INPUT = {"gyro": "rad/s", "accelerometer": "m/s^2"}


@pytest.fixture(scope="module")
def client(sqlite_client: Client) -> Client:
    """The storage's own tests show that the databases do not differ here."""
    return sqlite_client


@pytest.fixture(scope="module")
def calibrated(client: Client) -> dict:
    """A calibration in twelve orientations that passed."""
    job = client.wait(client.submit(seed=2, parameters={"dwell_s": 70.0})["id"])
    assert job["verdict"] == "pass"
    return job


def current(client: Client) -> dict[str, dict]:
    return {c["triad"]: c for c in client.http.get(PATH, params={"limit": 500}).json()["items"] if c["current"]}


def verified(client: Client, seed: int) -> dict:
    """A verification, judged by its prediction: the limit of the thesis, which launches may miss, is out of the way."""
    limits = {"gyro_bias_in_run_deg_h": 1.0, "accelerometer_bias_in_run_m_s2": 1.0}
    parameters = {"dwell_s": 70.0, "limits": limits}
    return client.wait(client.submit("verification_9_orientations", seed=seed, parameters=parameters)["id"])


def entry_of(truth: dict, **changes: object) -> dict:
    """The true values of a triad as a passport would print them."""
    triad = truth["triad"]
    values = [x for b, row in zip(truth["bias"], truth["matrix"], strict=True) for x in (b, *row)]
    sd = {"gyro": (5e-9, 1e-4), "accelerometer": (2e-5, 1e-5)}[triad]
    coefficients = [
        {
            "name": name,
            "value": value,
            "unit": coefficient_unit(name, INPUT[triad], INPUT[triad]),
            "standard_uncertainty": sd[name.startswith("K")],
        }
        for name, value in zip(COEFFICIENT_NAMES, values, strict=True)
    ]
    return {"triad": triad, "origin": "passport 17", "coefficients": coefficients, "by": "Ann", **changes}


def test_a_calibration_of_one_triad_leaves_the_others(client: Client, calibrated: dict) -> None:
    """Seen once: whole turns calibrate the gyros alone, and the next verification refused for want of the others."""
    before = current(client)
    assert {c["result"] for c in before.values()} == {calibrated["result"]}
    turns = {"make_calibration": True}
    job = client.wait(client.submit("scale_factor_whole_turns", seed=3, parameters=turns)["id"])
    assert job["verdict"] == "pass", job
    after = current(client)
    assert after["gyro"]["method"] == "scale_factor_whole_turns"
    assert after["accelerometer"]["id"] == before["accelerometer"]["id"]
    verification = verified(client, 4)
    lineage = client.http.get(f"/api/v1/jobs/{verification['id']}/result").json()["lineage"]
    assert lineage["calibrations"] == [after["gyro"]["id"], after["accelerometer"]["id"]]
    used = client.http.get(f"{PATH}/{after['gyro']['id']}").json()
    assert used["results"] == [verification["result"]]
    assert used["lineage"]["job"] == job["id"]


def test_a_failed_calibration_does_not_take_over_and_the_next_verification_passes(
    client: Client, calibrated: dict
) -> None:
    """Seen once: a calibration that failed became current, and the next verification failed with it."""
    good = {c["triad"]: c for c in client.http.get(PATH).json()["items"] if c["result"] == calibrated["result"]}
    for one in good.values():
        assert client.http.post(f"{PATH}/{one['id']}/choose", json={"by": "Ann"}).status_code == 200
    for triad in good:
        client.http.post(f"{PATH}/choose-by-rule", json={"triad": triad})
    before = current(client)
    limits = {"accelerometer_bias_in_run_m_s2": 1e-9}
    failed = client.wait(client.submit(seed=5, parameters={"dwell_s": 5.0, "limits": limits})["id"])
    assert failed["verdict"] == "fail"
    assert {t: c["id"] for t, c in current(client).items()} == {t: c["id"] for t, c in before.items()}
    verification = verified(client, 6)
    assert verification["verdict"] == "pass"
    made = [c for c in client.http.get(PATH).json()["items"] if c["result"] == failed["result"]]
    refusal = client.http.post(f"{PATH}/{made[0]['id']}/choose", json={"by": "Ann"})
    assert refusal.status_code == 409
    assert "verdict is fail: give a remark" in refusal.json()["detail"]
    chosen = client.http.post(f"{PATH}/{made[0]['id']}/choose", json={"by": "Ann", "remark": "limit mistyped"})
    assert (chosen.status_code, chosen.json()["current"], chosen.json()["by_rule"]) == (200, True, False)
    client.http.post(f"{PATH}/choose-by-rule", json={"triad": made[0]["triad"]})


def test_entered_coefficients_verify_a_simulated_unit_made_from_them(client: Client, calibrated: dict) -> None:
    truth = client.http.get(f"/api/v1/jobs/{calibrated['id']}/truth").json()["triads"]
    entered = [client.http.post(PATH, json=entry_of(t, choose=True, remark="first")) for t in truth]
    assert [e.status_code for e in entered] == [201, 201], entered[0].text
    ids = {e.json()["triad"]: e.json()["id"] for e in entered}
    assert entered[0].headers["Location"] == f"{PATH}/{entered[0].json()['id']}"
    assert {t: c["id"] for t, c in current(client).items()} == ids
    verification = verified(client, 7)
    assert verification["verdict"] == "pass"
    lineage = client.http.get(f"/api/v1/jobs/{verification['id']}/result").json()["lineage"]
    assert lineage["calibrations"] == [ids["gyro"], ids["accelerometer"]]
    wrong = entry_of(next(t for t in truth if t["triad"] == "accelerometer"), choose=True)
    wrong["coefficients"][1]["value"] *= 1.001  # a scale factor 1000 ppm off, fifty times what nine orientations see
    assert client.http.post(PATH, json=wrong).status_code == 201
    verification = verified(client, 8)
    assert verification["verdict"] == "fail"
    for triad in ids:
        assert client.http.post(f"{PATH}/choose-by-rule", json={"triad": triad}).status_code == 200


def test_coefficients_in_the_units_of_a_passport_are_converted(client: Client, calibrated: dict) -> None:
    truth = client.http.get(f"/api/v1/jobs/{calibrated['id']}/truth").json()["triads"]
    body = entry_of(next(t for t in truth if t["triad"] == "gyro"))
    si = client.http.post(PATH, json=body).json()
    for coefficient in body["coefficients"]:
        unit, size = ("deg/h", 4.84813681109536e-06) if coefficient["unit"] == "rad/s" else ("ppm", 1e-6)
        coefficient["value"], coefficient["unit"] = coefficient["value"] / size, unit
        coefficient["standard_uncertainty"] /= size
    read = client.http.post(PATH, json=body).json()
    for a, b in zip(si["coefficients"], read["coefficients"], strict=True):
        assert (a["subject"], a["name"], a["unit"]) == (b["subject"], b["name"], b["unit"])
        assert b["value"] == pytest.approx(a["value"], rel=1e-14)
        assert b["standard_uncertainty"] == pytest.approx(a["standard_uncertainty"], rel=1e-14)


def test_bad_entries_are_refused_with_the_way_out(client: Client, calibrated: dict) -> None:
    truth = client.http.get(f"/api/v1/jobs/{calibrated['id']}/truth").json()["triads"][0]
    before = client.stored()

    def refused(field: str, says: str, **changes: object) -> None:
        answer = client.http.post(PATH, json={**entry_of(truth), **changes})
        assert answer.status_code == 422, answer.text
        assert answer.json()["errors"][0]["field"] == field
        assert says in answer.text

    without_origin = entry_of(truth)
    del without_origin["origin"]
    answer = client.http.post(PATH, json=without_origin)
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "origin")
    refused("origin", "a passport, a certificate", origin="  ")
    rows = entry_of(truth)["coefficients"]
    refused("coefficients", "without K33", coefficients=[*rows[:11], rows[0]])
    refused("coefficients.0.unit", "converts to rad/s", coefficients=[{**rows[0], "unit": "furlong"}, *rows[1:]])
    without = {k: v for k, v in rows[0].items() if k != "standard_uncertainty"}
    refused("coefficients.0.standard_uncertainty", "Field required", coefficients=[without, *rows[1:]])
    zero = [{**r, "value": 0.0} if r["name"].startswith("K") else r for r in rows]
    refused("coefficients", "can be inverted", coefficients=zero)
    refused("valid_until", "later than", valid_from="2030-01-02T00:00:00Z", valid_until="2030-01-01T00:00:00Z")
    refused("measured_at", "in the past", measured_at="2999-01-01T00:00:00Z")
    ones = [[1.0] * 12 for _ in range(12)]
    ones[0][1] = ones[1][0] = -1.0
    refused("correlations", "negative eigenvalues", correlations=ones)
    assert client.http.post("/api/v1/units/none/calibrations", json=entry_of(truth)).status_code == 404
    assert client.stored() == before


def test_a_rejected_and_an_expired_calibration_are_refused_with_the_way_out(client: Client, calibrated: dict) -> None:
    truth = client.http.get(f"/api/v1/jobs/{calibrated['id']}/truth").json()["triads"]
    body = entry_of(next(t for t in truth if t["triad"] == "gyro"), choose=True)
    made = client.http.post(PATH, json=body).json()
    no_reason = client.http.post(f"{PATH}/{made['id']}/reject", json={"by": "Bo"})
    assert (no_reason.status_code, no_reason.json()["errors"][0]["field"]) == (422, "remark")
    client.http.post(f"{PATH}/{made['id']}/reject", json={"by": "Bo", "remark": "of another unit"})
    for answer in (
        client.preview("verification_9_orientations"),
        client.http.post("/api/v1/jobs", json={"procedure": "verification_9_orientations", "unit": "SIM-0001"}),
    ):
        assert answer.status_code == 422
        assert "rejected by Bo: of another unit; choose another calibration" in answer.json()["detail"]
    assert client.http.get(UNIT).json()["gyro_calibration"] is None
    assert "rejected by Bo" in client.http.get(UNIT).json()["withheld"][0]
    assert "rejected by Bo" in client.http.get("/units/SIM-0001").text
    approved = client.http.post(
        f"{PATH}/{made['id']}/approve", json={"by": "Bo", "valid_until": "2001-01-01T00:00:00Z"}
    ).json()
    assert (approved["approval"], "expired at 2001-01-01" in approved["unusable"]) == ("approved", True)
    assert [d["act"] for d in approved["decisions"]] == ["entered", "chosen", "rejected", "approved"]
    refused = client.http.post(f"{PATH}/{made['id']}/choose", json={"by": "Bo"})
    assert (refused.status_code, "later valid_until" in refused.json()["detail"]) == (409, True)
    assert client.preview("calibration_12_orientations").json()["basis"].startswith("calibration ")
    client.http.post(f"{PATH}/choose-by-rule", json={"triad": "gyro"})
    assert client.http.get(UNIT).json()["withheld"] == []


def test_a_repeated_request_decides_once(client: Client, calibrated: dict) -> None:
    one = current(client)["gyro"]
    key = {"Idempotency-Key": "approve once"}
    first = client.http.post(f"{PATH}/{one['id']}/approve", json={"by": "Bo"}, headers=key).json()
    again = client.http.post(f"{PATH}/{one['id']}/approve", json={"by": "Bo"}, headers=key).json()
    assert again["decisions"] == first["decisions"]
    assert again["decisions"][-1]["by"] == "Bo"
    assert not again["decisions"][-1]["proven"], "a name in a request is declared"
    other = client.http.post(f"{PATH}/{one['id']}/approve", json={"by": "Cy"}, headers=key)
    assert other.status_code == 409


def test_the_page_of_a_unit_shows_each_calibration_and_who_decided(client: Client, calibrated: dict) -> None:
    one = current(client)["accelerometer"]
    client.http.post(f"{PATH}/{one['id']}/approve", json={"by": "Bo <b>", "remark": "looked at"})
    text = client.http.get("/units/SIM-0001").text
    assert f"/calibrations/{one['id']}/choose" in text
    assert "approved by Bo &lt;b&gt;: looked at" in text
