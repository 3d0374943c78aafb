"""Correction sets through REST and on the unit's page, on both databases."""

import pytest

from bench_service.persistence import open_stores
from procedures.core.limits import Verdict
from tests.correction_samples import converter, gyros, thermal
from tests.service.client import Client
from tests.service.page import page

UNIT = "/api/v1/units/SIM-0001"


@pytest.fixture(scope="module")
def made(client: Client, database_url: str) -> list[dict]:
    """Four correction sets of the unit, newest first, written beside the service by another process's means."""
    job = client.wait(client.submit("no_operation")["id"])
    stores, database = open_stores(database_url)
    result = stores.results.get(job["result"])
    try:
        for seed in (1, 2):
            copy = type(result)(**{**vars(result), "id": f"{result.id}-{seed}", "job_id": None})
            stores.results.add(copy, corrections=[thermal(seed), converter(seed)])
    finally:
        database.dispose()
    return client.http.get(f"{UNIT}/corrections").json()["items"]


def test_the_history_is_paged_and_of_one_kind_where_asked(client: Client, made: list[dict]) -> None:
    assert [(c["kind"], c["current"]) for c in made] == [
        ("converter", True),
        ("thermal", True),
        ("converter", False),
        ("thermal", False),
    ]
    first = client.http.get(f"{UNIT}/corrections", params={"kind": "thermal", "limit": 1}).json()
    rest = client.http.get(f"{UNIT}/corrections", params={"kind": "thermal", "after": first["next"]}).json()
    assert [*first["items"], *rest["items"]] == [made[1], made[3]]
    assert first["items"][0]["converter"] is None
    value = thermal(2).thermal
    assert value is not None
    assert first["items"][0]["thermal"]["axes"][0]["alpha"] == list(value.axes[0].alpha)
    unit = client.http.get(UNIT).json()
    assert (unit["thermal_correction"], unit["converter"]) == (made[1]["id"], made[0]["id"])


def test_another_one_is_chosen_and_new_jobs_know_it(client: Client, made: list[dict]) -> None:
    old, new = made[3], made[1]
    key = {"Idempotency-Key": "choose the old one"}
    chosen = client.http.post(f"{UNIT}/corrections/{old['id']}/current", headers=key)
    assert (chosen.status_code, chosen.json()["current"]) == (200, True)
    assert [d["act"] for d in chosen.json()["decisions"]] == ["chosen"]
    assert client.http.get(UNIT).json()["thermal_correction"] == old["id"]
    assert not client.http.get(f"{UNIT}/corrections/{new['id']}").json()["current"]
    assert client.http.post(f"{UNIT}/corrections/{new['id']}/current").json()["current"]
    again = client.http.post(f"{UNIT}/corrections/{old['id']}/current", headers=key)
    assert (again.status_code, again.json()["current"]) == (200, False), "what was chosen since stands"
    other = client.http.post(f"{UNIT}/corrections/{new['id']}/current", headers=key)
    assert other.status_code == 409
    assert client.http.get(UNIT).json()["thermal_correction"] == new["id"]


def test_one_of_a_failed_result_is_chosen_with_a_remark(client: Client, database_url: str, made: list[dict]) -> None:
    stores, database = open_stores(database_url)
    try:
        one = stores.results.get(made[0]["result"])
        failed = type(one)(**{**vars(one), "id": f"{one.id}-failed", "verdict": Verdict.FAIL})
        stores.results.add(failed, corrections=[gyros(3)])
    finally:
        database.dispose()
    (stored,) = client.http.get(f"{UNIT}/corrections", params={"kind": "gyros"}).json()["items"]
    assert (stored["current"], stored["verdict"]) == (False, "fail"), "a failed one never counts by itself"
    assert f"result {failed.id}, whose verdict is fail" in stored["not_current"]
    assert f"result {failed.id}, whose verdict is fail" in page(client, "/units/SIM-0001").words
    assert client.http.get(UNIT).json()["gyro_correction"] is None
    refused = client.http.post(f"{UNIT}/corrections/{stored['id']}/current")
    assert (refused.status_code, refused.headers["content-type"]) == (409, "application/problem+json")
    assert "give a remark" in refused.json()["detail"]
    body = {"by": "Ann", "remark": "the limit was for another model"}
    assert client.http.post(f"{UNIT}/corrections/{stored['id']}/current", json=body).json()["current"]


def test_a_kind_is_given_back_to_the_rule(client: Client, made: list[dict]) -> None:
    one = f"{UNIT}/corrections/{made[1]['id']}"
    chosen = client.http.post(f"{one}/current", json={"by": "Ann"}).json()
    assert (chosen["current"], chosen["by_rule"]) == (True, False)
    assert page(client, "/units/SIM-0001").words.count("chosen by Ann") >= 1
    refused = client.http.post(f"{UNIT}/corrections/choose-by-rule", json={"kind": "thermal", "by": "Ann"})
    assert (refused.status_code, refused.headers["content-type"]) == (409, "application/problem+json")
    assert "no job that passed has given unit SIM-0001" in refused.json()["detail"], "its corrections are of no job"
    unknown = client.http.post(f"{UNIT}/corrections/choose-by-rule", json={"kind": "magnetic"})
    assert unknown.json()["errors"][0]["field"] == "kind"


def test_what_does_not_exist_is_a_problem_that_says_so(client: Client, made: list[dict]) -> None:
    for path in ("/api/v1/units/NOBODY/corrections", f"{UNIT}/corrections/none"):
        answer = client.http.get(path)
        assert (answer.status_code, answer.headers["content-type"]) == (404, "application/problem+json")
    elsewhere = client.http.post(f"/api/v1/units/RANDOM-1/corrections/{made[0]['id']}/current")
    assert elsewhere.status_code == 404
    assert "RANDOM-1" in elsewhere.json()["detail"]
    wrong = client.http.get(f"{UNIT}/corrections", params={"kind": "magnetic"})
    assert wrong.status_code == 422
    assert wrong.json()["errors"][0]["field"] == "kind"


def test_the_units_page_shows_them(client: Client, made: list[dict]) -> None:
    unit = page(client, "/units/SIM-0001")
    for correction in made:
        assert correction["id"][-6:] in unit.words
        assert ("href", f"/results/{correction['result']}") in unit.attributes
    assert unit.words.count("Make it current") == 2
    assert "beta_4" in unit.words


def test_one_is_rejected_approved_and_ends_through_rest(client: Client, made: list[dict]) -> None:
    one = f"{UNIT}/corrections/{made[0]['id']}"
    bare = client.http.post(f"{one}/reject", json={})
    assert bare.status_code == 422
    assert bare.json()["errors"][0]["field"] == "remark"
    rejected = client.http.post(f"{one}/reject", json={"by": "Ann", "remark": "the source was not warm"}).json()
    assert (rejected["approval"], rejected["decisions"][0]["remark"]) == ("rejected", "the source was not warm")
    assert "was rejected by Ann" in rejected["unusable"]
    unit = client.http.get(UNIT).json()
    assert unit["converter"] is None
    assert any("was rejected by Ann" in why for why in unit["withheld"])
    assert "the source was not warm" in page(client, "/units/SIM-0001").words
    until = "2099-01-01T00:00:00Z"
    approved = client.http.post(f"{one}/approve", json={"by": "Ann", "valid_until": until}).json()
    assert (approved["approval"], approved["unusable"], approved["valid_until"]) == ("approved", "", until)
    assert client.http.get(UNIT).json()["converter"] == made[0]["id"]
