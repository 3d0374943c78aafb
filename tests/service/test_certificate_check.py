"""Check of a certificate over the API: a sound one, each way to be unsound, and one of calibrations of elsewhere."""

import json
from typing import Any

import pytest

from bench_service.formats.certificate.document import certificate
from bench_service.formats.certificate.laboratory import laboratory_of
from bench_service.formats.certificate.signature import KeyPair, new_key, signed
from tests.kit.certificate_facts import TEXT
from tests.service.client import Client


@pytest.fixture(scope="module")
def pair() -> KeyPair:
    return new_key("Bench Lab")


@pytest.fixture(scope="module")
def exported(sqlite_client: Client) -> str:
    """Our JSON of a calibration that is stored."""
    sqlite_client.wait(sqlite_client.submit(parameters={}, seed=7)["id"])
    found = sqlite_client.http.get("/api/v1/units/SIM-0001/calibrations?limit=1").json()["items"][0]["id"]
    return sqlite_client.http.get(f"/api/v1/units/SIM-0001/calibrations/{found}/export?format=json").text


def made(text: str, pair: KeyPair) -> bytes:
    return signed(certificate(json.loads(text), text, laboratory_of(TEXT), "1"), pair)


def check(client: Client, data: bytes, pinned: bytes) -> dict[str, Any]:
    files = {"certificate": ("c.xml", data), "laboratory": ("lab.cert.pem", pinned)}
    answer = client.http.post("/api/v1/certificates/check", files=files)
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_a_certificate_of_a_stored_calibration_is_valid_and_the_same(
    sqlite_client: Client, exported: str, pair: KeyPair
) -> None:
    found = check(sqlite_client, made(exported, pair), pair.certificate)
    assert (found["valid"], found["unchanged"], found["faults"]) == (True, True, [])
    assert found["signed_by"] == "CN=Bench Lab"
    assert found["unit"] == "SIM-0001"
    assert {one["triad"] for one in found["calibrations"]} == {"gyro", "accelerometer"}
    assert all(one["stored"] and one["same"] for one in found["calibrations"])


def test_a_changed_certificate_and_another_laboratorys_key_are_seen(
    sqlite_client: Client, exported: str, pair: KeyPair
) -> None:
    data = made(exported, pair)
    changed = check(sqlite_client, data.replace(b"K-2026-001", b"K-2026-002"), pair.certificate)
    assert (changed["valid"], changed["unchanged"], changed["signed_by"]) == (False, False, None)
    assert "signature" in changed["faults"][0]
    other = check(sqlite_client, data, new_key("Other").certificate)
    assert (other["valid"], other["signed_by"]) == (False, None)
    assert not check(sqlite_client, b"no xml", pair.certificate)["valid"]
    assert not check(sqlite_client, data, b"no certificate")["valid"]


def test_other_coefficients_than_those_stored_are_seen(sqlite_client: Client, exported: str, pair: KeyPair) -> None:
    document = json.loads(exported)
    triad = document["triads"][0]
    triad["coefficients"][0]["value"] += 1e-6
    triad["forward"]["b"][0] += 1e-6
    found = check(sqlite_client, made(json.dumps(document), pair), pair.certificate)
    assert (found["valid"], found["unchanged"]) == (False, True)
    assert [one["same"] for one in found["calibrations"]].count(False) == 1
    assert any("not the coefficients stored here" in fault for fault in found["faults"])


def test_a_calibration_of_another_place_is_valid_by_itself(sqlite_client: Client, exported: str, pair: KeyPair) -> None:
    document = json.loads(exported)
    for number, triad in enumerate(document["triads"]):
        triad["calibration"] = f"01a00000-0000-7000-8000-00000000000{number}"
    found = check(sqlite_client, made(json.dumps(document), pair), pair.certificate)
    assert found["valid"]
    assert [one["stored"] for one in found["calibrations"]] == [False, False]


def test_a_file_that_is_empty_is_refused_with_its_field(sqlite_client: Client, pair: KeyPair) -> None:
    files = {"certificate": ("c.xml", b""), "laboratory": ("lab.cert.pem", pair.certificate)}
    answer = sqlite_client.http.post("/api/v1/certificates/check", files=files)
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "certificate"
