"""A certificate's numbers beside those of a second analysis: the same, nearly the same, changed, other raw data."""

import json
from copy import deepcopy
from dataclasses import replace

import pytest

from bench_service.formats.calibration_exports.own_json import own_json
from bench_service.formats.certificate.errors import CertificateRefused
from bench_service.formats.certificate.recomputed import compared, require_issuable, results_of
from tests.kit.exported_calibrations import a_subject

DOCUMENT = json.loads(own_json(a_subject(1)))


def answer() -> dict:
    """The service's answer where nothing has changed."""
    again = [
        {"triad": t["triad"], "coefficients": [row["value"] for row in t["coefficients"]]} for t in DOCUMENT["triads"]
    ]
    recordings = [{"id": "x", "stated": "f00d", "found": "f00d"}]
    return {"recordings": recordings, "calibrations": again, "stored_version": "1.0.0", "version": "1.1.0"}


def test_equal_numbers_of_equal_data_are_the_same() -> None:
    assert results_of(DOCUMENT) == ("r-1",)
    found = compared(DOCUMENT, {"r-1": answer()})
    assert [one.same for one in found] == [True, True]
    assert "to the last digit" in found[0].sentence


@pytest.mark.parametrize(
    ("change", "same", "says"), [(1e-8, True, "1.0e-08"), (0.5, False, "0.5 uncertainties (version 1.0.0 then")]
)
def test_a_change_is_measured_in_uncertainties(change: float, same: bool, says: str) -> None:
    given = answer()
    row = DOCUMENT["triads"][1]["coefficients"][3]
    given["calibrations"][1]["coefficients"][3] = row["value"] + change * row["standard_uncertainty"]
    found = compared(DOCUMENT, {"r-1": given})
    assert [one.same for one in found] == [True, same]
    assert says in found[1].sentence


def test_other_raw_data_and_no_calibration_are_seen() -> None:
    other, none = answer(), answer()
    other["recordings"][0]["found"] = "beef"
    none["calibrations"].pop()
    assert "raw data changed" in compared(DOCUMENT, {"r-1": other})[0].sentence
    assert [one.same for one in compared(DOCUMENT, {"r-1": none})] == [True, False]


def test_an_entered_calibration_has_nothing_to_analyse() -> None:
    document = deepcopy(DOCUMENT)
    for triad in document["triads"]:
        triad |= {"lineage": None, "origin": "passport 17"}
    assert results_of(document) == ()
    assert "entered from passport 17" in compared(document, {})[0].sentence


def test_rejected_expired_and_failed_calibrations_get_no_certificate() -> None:
    require_issuable(DOCUMENT, failed=False)
    for changes, failed, says in (
        (
            {"unusable": "calibration c-gyro of the gyro triad was rejected by Ann: dropped"},
            True,
            "was rejected by Ann",
        ),
        ({"unusable": "calibration c-gyro of the gyro triad expired at 2026-01-01"}, True, "expired at"),
        ({"verdict": "fail"}, False, "is fail; with --failed"),
        ({"verdict": "error"}, False, "is error"),
    ):
        subject = a_subject(1)
        altered = replace(subject, triads=(replace(subject.triads[0], **changes), subject.triads[1]))
        with pytest.raises(CertificateRefused, match=says):
            require_issuable(json.loads(own_json(altered)), failed)
    failed = replace(a_subject(1), triads=tuple(replace(t, verdict="fail") for t in a_subject(1).triads))
    require_issuable(json.loads(own_json(failed)), failed=True)
