"""Printed reports through REST: their text has the database's numbers, their attached files are whole, PDF/A-3."""

import base64
import json
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import timedelta
from pathlib import Path

import pytest

from bench_service.cli.asking.client import connect
from bench_service.evidence.catalogue import Catalogue
from bench_service.evidence.reports.calibration_parts import found_by
from bench_service.evidence.reports.result_report import gathered, result_report
from bench_service.evidence.reports.unit_report import unit_report
from bench_service.formats.certificate.document import certificate
from bench_service.formats.certificate.laboratory import laboratory_of
from bench_service.formats.certificate.rules import faults
from bench_service.formats.certificate.signature import KeyPair, new_key, signed, verified
from bench_service.model.calibrations import Approval
from bench_service.persistence.stores import open_stores
from bench_service.settings import Settings
from procedures.core.limits import Verdict
from tests.kit.pdf_a import attached, structural_faults, text_of
from tests.kit.printed_words import words_of
from tests.service.client import Client
from tests.service.entries import PATH, enter

LABORATORY = """
identifier = "K-2026-007"
laboratory = { name = "Bench & Söhne <Lab>", country = "UA", city = "Київ" }
customer = { name = "A customer 漢", country = "DE", city = "Braunschweig" }
people = [{ name = "Олена", role = "head of laboratory", main_signer = true }]
equipment = [{ name = "rate table", serial = "T-1", certificate = "PTB 12345" }]
"""


@dataclass(frozen=True)
class Calibrated:
    """A service whose unit was calibrated twice, and its file."""

    client: Client
    books: Path
    first: dict[str, str]
    second: dict[str, str]

    def calibration(self, triad: str) -> dict:
        return self.client.http.get(f"{PATH}/{self.second[triad]}").json()

    @property
    def result(self) -> str:
        return self.calibration("gyro")["result"]


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Calibrated]:
    folder = tmp_path_factory.mktemp("printed")
    settings = Settings(database_url=f"sqlite:///{folder / 'bench.sqlite'}", device_folder=folder / "devices")
    with connect(settings, None, drive=True) as http:
        client = Client(http)
        first, second = client.calibrate(seed=1), client.calibrate(seed=2)
        yield Calibrated(client, folder / "bench.sqlite", first, second)


@pytest.fixture(scope="module")
def pair() -> KeyPair:
    return new_key("Bench Lab")


def pdf(calibrated: Calibrated, path: str) -> bytes:
    answer = calibrated.client.http.get(path)
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "application/pdf"
    return answer.content


def numbers(calibration: dict) -> list[str]:
    value = calibration["calibration"]
    rows = [[b, *row] for b, row in zip(value["bias"], value["matrix"], strict=True)]
    return [repr(x) for row in rows for x in row]


def certified(calibrated: Calibrated, pair: KeyPair) -> bytes:
    text = calibrated.client.http.get(f"{PATH}/{calibrated.second['gyro']}/export", params={"format": "json"}).text
    return signed(certificate(json.loads(text), text, laboratory_of(LABORATORY), "1.2.3"), pair)


def test_a_result_s_report_has_the_stored_numbers_and_says_who_what_and_how(calibrated: Calibrated) -> None:
    data = pdf(calibrated, f"/api/v1/results/{calibrated.result}/report.pdf")
    assert structural_faults(data) == []
    text = text_of(data)
    for triad in ("gyro", "accelerometer"):
        assert [x for x in numbers(calibrated.calibration(triad)) if x not in text] == []
    result = calibrated.client.http.get(f"/api/v1/results/{calibrated.result}").json()
    for recording in result["lineage"]["recordings"]:
        assert recording["content_hash"] in text
    for words in (
        "SIMULATED",
        "simple acceptance",
        "as found",
        "U (k = 2)",
        "Instruments",
        "gravity",
        "Bias of the gyro",
    ):
        assert words in text, words
    for known in (
        *calibrated.first.values(),
        calibrated.result,
        result["lineage"]["job"],
        result["lineage"]["code_version"],
    ):
        assert known in text, text[text.find("History") :]
    document = json.loads(attached(data)["result.json"])
    assert document["document"] == result["document"]
    assert pdf(calibrated, f"/api/v1/results/{calibrated.result}/report.pdf") == data, "equal documents, equal bytes"


def test_digits_follow_the_expanded_uncertainty(calibrated: Calibrated) -> None:
    """Worked by hand from the stored numbers: two digits of U = 2u, and the value to the same place."""
    text = text_of(pdf(calibrated, f"/api/v1/results/{calibrated.result}/report.pdf"))
    one = calibrated.calibration("accelerometer")
    k11, u = one["calibration"]["matrix"][0][0], one["calibration"]["covariance"][1][1] ** 0.5
    expanded = f"{2 * u:.1e}"
    places = 1 - int(expanded.partition("e")[2])
    assert f"K11 1 {k11:.{places}f} {2 * u:.{places}f}" in text


def test_a_unit_s_report_has_its_history(calibrated: Calibrated) -> None:
    data = pdf(calibrated, "/api/v1/units/SIM-0001/report.pdf")
    assert structural_faults(data) == []
    text = text_of(data)
    for known in (*calibrated.first.values(), *calibrated.second.values(), "gyro_x", "Scale factor less one"):
        assert known in text, text[text.find("History") :]
    assert [x for x in numbers(calibrated.calibration("gyro")) if x not in text] == []
    assert calibrated.client.http.get("/api/v1/units/NONE/report.pdf").status_code == 404
    assert calibrated.client.http.get("/api/v1/results/none/report.pdf").status_code == 404


def test_a_certificate_is_printed_with_its_xml_inside(calibrated: Calibrated, pair: KeyPair) -> None:
    xml = certified(calibrated, pair)
    answer = calibrated.client.http.post(f"{PATH}/certificate.pdf", json={"certificate": xml.decode()})
    assert answer.status_code == 200, answer.text
    assert structural_faults(answer.content) == []
    inside = attached(answer.content)["certificate.xml"]
    assert inside == xml
    root, signer = verified(inside, pair.certificate)
    assert (faults(root), signer) == ([], "CN=Bench Lab")
    text = text_of(answer.content)
    for words in ("K-2026-007", "Bench & Söhne <Lab>", "Київ", "Олена", "PTB 12345", "[U+6F22]", "SIMULATED", "T-1"):
        assert words in text, words
    assert [x for t in ("gyro", "accelerometer") for x in numbers(calibrated.calibration(t)) if x not in text] == []


def test_no_certificate_and_one_of_other_numbers_are_not_printed(calibrated: Calibrated, pair: KeyPair) -> None:
    value = numbers(calibrated.calibration("gyro"))[0]
    xml = certified(calibrated, pair).decode()
    document = base64.b64encode(json.dumps({"unit": "SIM-0001", "triads": []}).encode()).decode()
    for text, says in (
        ("<a/>", "no certificate of version 3.3.0"),
        ("not XML", "certificate: not XML: Start tag"),
        (xml.replace(value, value + "1", 1), "not those of the attached"),
        (f"<a><dataBase64>{document}</dataBase64></a>", "no certificate of version 3.3.0"),
    ):
        refusal = calibrated.client.http.post(f"{PATH}/certificate.pdf", json={"certificate": text})
        assert refusal.status_code == 422, refusal.text
        assert says in refusal.text
    other = calibrated.client.http.post("/api/v1/units/OTHER/calibrations/certificate.pdf", json={"certificate": xml})
    assert (other.status_code, "stored here" in other.text) == (422, True)


def test_a_result_is_computed_again_from_its_raw_data(calibrated: Calibrated) -> None:
    found = calibrated.client.http.post(f"/api/v1/results/{calibrated.result}/recomputation")
    assert found.status_code == 200, found.text
    answer = found.json()
    assert (answer["raw_data_same"], answer["same"], answer["differences"]) == (True, True, [])
    assert [c["change"] for c in answer["calibrations"]] == [0.0, 0.0]
    assert [[repr(x) for x in c["coefficients"]] for c in answer["calibrations"]] == [
        numbers(calibrated.calibration(c["triad"])) for c in answer["calibrations"]
    ]


def test_a_recomputation_sees_other_numbers_and_other_raw_data(calibrated: Calibrated) -> None:
    """The stored document and the stated hash are altered in the database's file, then put back."""
    result = calibrated.calibration("gyro")["result"]
    path = f"/api/v1/results/{result}/recomputation"
    with sqlite3.connect(calibrated.books) as books:
        (document,) = books.execute("SELECT document FROM results WHERE id = ?", (result,)).fetchone()
        altered = json.loads(document)
        altered["checks"][0]["value"] *= 1 + 1e-15
        books.execute("UPDATE results SET document = ? WHERE id = ?", (json.dumps(altered), result))
        books.execute(
            "UPDATE result_recordings SET content_hash = 'f00d' WHERE result_id = ? AND position = 3", (result,)
        )
    answer = calibrated.client.http.post(path).json()
    assert (answer["raw_data_same"], answer["same"], answer["differences"]) == (False, False, ["/checks/0/value"])
    assert [r["stated"] == r["found"] for r in answer["recordings"]].count(False) == 1
    with sqlite3.connect(calibrated.books) as books:
        books.execute("UPDATE results SET document = ? WHERE id = ?", (document, result))
        sound = answer["recordings"][3]["found"]
        books.execute(
            "UPDATE result_recordings SET content_hash = ? WHERE result_id = ? AND position = 3", (sound, result)
        )
    assert calibrated.client.http.post(path).json()["raw_data_same"]


def test_a_result_of_a_method_is_printed_and_computed_again(calibrated: Calibrated) -> None:
    used = [calibrated.first["gyro"], calibrated.second["gyro"]]
    made = calibrated.client.analyse("run_to_run", calibrations=used)
    assert made.status_code == 201, made.text
    result = made.json()["id"]
    assert "run to run" in text_of(pdf(calibrated, f"/api/v1/results/{result}/report.pdf"))
    assert calibrated.client.http.post(f"/api/v1/results/{result}/recomputation").json()["same"]


def test_a_rejected_calibration_is_marked(calibrated: Calibrated) -> None:
    one = enter(calibrated.client, "gyro")
    calibrated.client.http.post(f"{PATH}/{one['id']}/reject", json={"remark": "dropped the unit"})
    text = text_of(pdf(calibrated, "/api/v1/units/SIM-0001/report.pdf"))
    assert (one["id"] in text, "rejected" in text) == (True, True)


def test_as_found_is_the_calibration_in_use_before_and_no_rejected_one_after_it(calibrated: Calibrated) -> None:
    """A calibration that nobody used, rejected, lies between the two: its b0 of 0.01 rad/s is nowhere as found."""
    books = f"sqlite:///{calibrated.books}"
    stores, opened = open_stores(books)
    try:
        current = stores.calibrations.get(calibrated.second["gyro"])
        first = stores.calibrations.get(calibrated.first["gyro"])
        history = stores.calibrations.list("SIM-0001", limit=200).items
        between = replace(first, id="between", made_at=current.made_at - timedelta(microseconds=1))
        found = found_by(stores, current, [current, replace(between, approval=Approval.REJECTED), first])
        words = words_of(unit_report(stores, "SIM-0001"))
    finally:
        opened.dispose()
    assert current.id in {c.id for c in history}
    assert found is not None
    assert found.id == first.id
    assert "attached" not in words
    assert f"export of calibration {current.id}, format json" in words
    entered = replace(current, result_id=None, verdict=None)
    tried = replace(between, verdict=Verdict.FAIL)
    assert found_by(stores, entered, [entered, tried, replace(first, verdict=None)]) == replace(first, verdict=None)
    assert found_by(stores, entered, [entered, replace(between, approval=Approval.REJECTED)]) is None


def test_pages_lead_to_the_reports(calibrated: Calibrated) -> None:
    result = f"/results/{calibrated.result}"
    job = calibrated.client.http.get(f"/api/v1{result}").json()["lineage"]["job"]
    for page, reported in ((result, result), (f"/jobs/{job}", result), ("/units/SIM-0001", "/units/SIM-0001")):
        assert f"/api/v1{reported}/report.pdf" in calibrated.client.http.get(page).text
    assert "procedure=verification_9_orientations" in calibrated.client.http.get("/").text


def test_a_second_analysis_a_year_later_judges_certificates_by_the_day_of_the_recordings(
    calibrated: Calibrated,
) -> None:
    stores, opened = open_stores(f"sqlite:///{calibrated.books}")
    try:
        known = stores.results.get(calibrated.result)
        job = stores.jobs.get(known.job_id or "")
        for due, marked in ((job.created_at, False), (job.created_at - timedelta(days=1), True)):
            certificate = {"number": "PTB 1", "laboratory": "PTB", "due": due.date().isoformat()}
            device = {"name": "turntable", "simulated": True, "driver": "", "certificate": certificate}
            context = {**known.context, "bench": {**known.context["bench"], "devices": [device]}}
            again = replace(known, created_at=known.created_at + timedelta(days=365), context=context)
            for by in (job, None):
                words = words_of(result_report(stores, Catalogue(), gathered(stores, again, by)))
                assert f"PTB 1 PTB {due.date()}" in words
                assert ("OVERDUE" in words) is marked, (due, by)
    finally:
        opened.dispose()


def test_a_static_run_shows_the_noise_as_found_and_as_left_and_its_trend(calibrated: Calibrated) -> None:
    """Two short launches; the record of the second one's report begins where the first one's ended."""
    http = calibrated.client.http
    noted = http.post("/api/v1/units/SIM-0001/notes", json={"text": "a pin of J2 is bent", "by": "Олена"})
    assert noted.is_success, noted.text
    short = {"launches": 1, "duration_s": 600.0, "sample_rate_hz": 50.0, "off_time_s": 10.0}
    jobs = [calibrated.client.submit("static_run", seed=seed, parameters=short)["id"] for seed in (5, 6)]
    first, second = (calibrated.client.wait(job)["result"] for job in jobs)
    stores, opened = open_stores(f"sqlite:///{calibrated.books}")
    try:
        results = [stores.results.get(r) for r in (first, second)]
        one, two = (
            words_of(result_report(stores, Catalogue(), gathered(stores, r, stores.jobs.get(r.job_id))))
            for r in results
        )
        unit = words_of(unit_report(stores, "SIM-0001"))
    finally:
        opened.dispose()
    for words in ("noise of the gyros data sheet", f"result {first}", "a pin of J2 is bent", "Олена (name as given)"):
        assert words in one, words
    assert "Noise of the unit from one static run" not in one, "one result is no trend"
    for words in (f"noise of the gyros result {first}", f"result {second}", "Noise of the unit from one static run"):
        assert words in two, words
    for words in ("Quantization of the gyros", f"Origin: result {second}", "a pin of J2 is bent"):
        assert words in unit, words
    record = http.get("/api/v1/units/SIM-0001").json()
    assert record["gyro"]["noise_origin"] == f"result {second}"
