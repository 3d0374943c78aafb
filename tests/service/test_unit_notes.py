"""Remarks about a unit: kept with their author, newest first, once for a key."""

from tests.service.client import Client

PATH = "/api/v1/units/SIM-0001/notes"


def test_a_remark_stays_with_the_unit_and_stands_on_its_page(sqlite_client: Client) -> None:
    http = sqlite_client.http
    first = http.post(PATH, json={"text": "connector <loose>", "by": "Олена"})
    assert first.status_code == 201, first.text
    http.post(PATH, json={"text": "repaired"}, headers={"X-Requested-By": "Bo"})
    found = http.get(PATH).json()["items"]
    assert [(one["text"], one["by"], one["proven"]) for one in found[:2]] == [
        ("repaired", "Bo", False),
        ("connector <loose>", "Олена", False),
    ]
    assert "connector &lt;loose&gt;" in http.get("/units/SIM-0001", headers={"Accept": "text/html"}).text


def test_a_remark_that_is_sent_again_is_the_same_one(sqlite_client: Client) -> None:
    http = sqlite_client.http
    key = {"Idempotency-Key": "note-1"}
    made = [http.post(PATH, json={"text": "once"}, headers=key).json()["id"] for _ in range(2)]
    assert made[0] == made[1]
    assert http.post(PATH, json={"text": "other"}, headers=key).status_code == 409


def test_an_empty_remark_and_an_unknown_unit_are_refused(sqlite_client: Client) -> None:
    refused = sqlite_client.http.post(PATH, json={"text": "  "})
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] == "text"
    assert sqlite_client.http.post("/api/v1/units/NOBODY/notes", json={"text": "x"}).status_code == 404
