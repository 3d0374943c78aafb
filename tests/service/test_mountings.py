"""Mountings over HTTP: entered, named by jobs and in their lineage; their azimuth counts, a remount ends what waits."""

from collections.abc import Generator

import pytest

from tests.service.client import FAST, Client

MOUNTINGS = "/api/v1/mountings"
READING = {"plate": "P1", "azimuth_deg": 0.25, "azimuth_sd_arcsec": 30.0}


def enter(client: Client, status: int = 201, key: str | None = None, **body: object) -> dict:
    headers = {} if key is None else {"Idempotency-Key": key}
    answer = client.http.post(MOUNTINGS, json={"unit": "SIM-0001", **READING, **body}, headers=headers)
    assert answer.status_code == status, answer.text
    return answer.json()


@pytest.fixture
def bare(client: Client) -> Generator[Client]:
    """The bench has no mounting, before and after."""
    yield client
    for one in client.http.get(MOUNTINGS, params={"standing": True}).json()["items"]:
        assert client.http.post(f"{MOUNTINGS}/{one['id']}/end", json={}).is_success


def result(client: Client, job: dict) -> dict:
    done = client.wait(job["id"])
    assert done["state"] == "succeeded", done
    return client.http.get(f"/api/v1/jobs/{job['id']}/result").json()


def test_a_gyro_calibration_uses_the_azimuth_of_the_mounting_as_if_it_were_asked_for(bare: Client) -> None:
    """The same seed gives the same samples, so a job on a mounting agrees to the last bit with one without a mounting
    whose parameters name the same azimuth: two ways into the analysis, one number."""
    asked = {**FAST, "azimuth_deg": 0.25, "azimuth_sd_arcsec": 30.0}
    by_parameters = result(bare, bare.submit(seed=5, parameters=asked))
    plain = result(bare, bare.submit(seed=5))
    assert plain["lineage"]["mounting"] is None
    made = enter(bare, by="Olha", instrument="2T2A", remark="seat cleaned")
    assert (made["by"], made["stands"], made["bench"], made["proven"]) == ("Olha", True, "sim", False)
    job = bare.submit(seed=5)
    assert job["mounting"] == made["id"]
    found = result(bare, job)
    lineage = found["lineage"]
    assert lineage["parameters"]["azimuth_deg"] == 0.25
    assert lineage["parameters"]["azimuth_sd_arcsec"] == 30.0
    assert {name: lineage["mounting"][name] for name in ("id", "by", "plate")} == {
        "id": made["id"],
        "by": "Olha",
        "plate": "P1",
    }
    assert found["document"] == by_parameters["document"]
    assert found["document"] != plain["document"]
    again = bare.http.post(f"/api/v1/jobs/{job['id']}/analyses", json={"parameters": {}})
    assert again.json()["document"] == found["document"], again.text


def test_a_new_mounting_ends_those_of_its_unit_and_of_its_plate(bare: Client) -> None:
    first = enter(bare, key="one")
    assert enter(bare, key="one")["id"] == first["id"]
    assert enter(bare, 409, key="one", azimuth_deg=1.0)["title"]
    other = enter(bare, unit="RANDOM-2", plate="P2")
    second = enter(bare, plate="P2", by="Ann")
    kept = {one["id"]: one for one in bare.http.get(MOUNTINGS, params={"bench": "sim"}).json()["items"]}
    assert [kept[one["id"]]["stands"] for one in (first, other, second)] == [False, False, True]
    assert kept[first["id"]]["ended_by"] == kept[other["id"]]["ended_by"] == "Ann"
    assert bare.http.get(f"{MOUNTINGS}/{first['id']}").json() == kept[first["id"]]
    refused = bare.http.post(
        "/api/v1/jobs", json={"procedure": "no_operation", "unit": "SIM-0001", "mounting": first["id"]}
    )
    assert refused.status_code == 422
    assert f"there stands {second['id']}" in refused.text
    assert result(bare, bare.submit("no_operation", mounting=second["id"]))["lineage"]["mounting"]["id"] == second["id"]


def test_a_job_that_waited_while_its_unit_was_mounted_anew_is_refused_with_the_way_out(bare: Client) -> None:
    assert bare.http.post("/api/v1/benches/sim/stop", json={"reason": "remounting"}).is_success
    waiting = bare.submit(seed=1)
    made = enter(bare)
    assert bare.http.post("/api/v1/benches/sim/release").is_success
    done = bare.wait(waiting["id"])
    assert (done["state"], done["error"]["kind"]) == ("failed", "MountingChanged")
    assert f"mounting {made['id']} stands" in done["error"]["message"]
    assert "submit it again" in done["error"]["message"]


def test_nobody_mounts_a_unit_on_a_bench_that_moves(bare: Client) -> None:
    job = bare.submit(seed=1, parameters={"dwell_s": 3600.0})
    bare.wait(job["id"], "running")
    assert f"job {job['id']} drives bench sim" in enter(bare, 409)["detail"]
    bare.http.post(f"/api/v1/jobs/{job['id']}/cancel")
    bare.wait(job["id"])


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"azimuth_deg": 361.0}, "azimuth_deg"),
        ({"azimuth_sd_arcsec": -1.0}, "azimuth_sd_arcsec"),
        ({"plate": ""}, "plate"),
        ({"unit": "nobody-1"}, "nobody-1"),
        ({"mounted_at": "2100-01-01T00:00:00Z"}, "mounted_at"),
        ({"mounted_at": "2026-01-01T00:00:00"}, "mounted_at"),
        ({"mounted_at": "0001-01-01T00:00:00+23:59"}, "mounted_at"),
    ],
)
def test_what_cannot_be_is_refused_by_its_field(bare: Client, wrong: dict, said: str) -> None:
    assert said in str(enter(bare, 422, **wrong))
    assert bare.http.get(MOUNTINGS, params={"standing": True}).json()["items"] == []


def test_calibrations_under_two_mountings_give_the_repeatability_of_the_seat(bare: Client) -> None:
    client, made = bare, list[str]()
    for seed, plate in ((11, "P1"), (12, "P1"), (13, "P2")):
        if seed != 12:
            enter(client, plate=plate, azimuth_deg=0.0)
        made += client.calibrate(seed).values()
    found = client.analyse("mounting_repeatability", calibrations=made)
    assert found.status_code == 201, found.text
    document = found.json()["document"]
    assert len(document["mountings"]) == 2
    couplings = document["cross_couplings"]
    assert [c["triad"] for c in couplings] == ["gyro"] * 6 + ["accelerometer"] * 6
    assert all(c["within_degrees"] == 1 for c in couplings)
    client.http.post(f"{MOUNTINGS}/{client.http.get(MOUNTINGS).json()['items'][0]['id']}/end", json={})
    without = list(client.calibrate(15).values())
    refused = client.analyse("mounting_repeatability", calibrations=[*made, *without])
    assert refused.status_code == 422
    assert without[0] in refused.text
