"""Comparison of a certificate's numbers with those that the raw data give when they are analysed again."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bench_service.formats.certificate.errors import CertificateRefused

NEGLIGIBLE = 1e-6
"""Change in standard uncertainties below which numbers are the same: another machine's last digits."""


@dataclass(frozen=True)
class Repeated:
    """Outcome of the comparison for one triad: whether its raw data and numbers are the same, with a sentence."""

    triad: str
    same: bool
    sentence: str


def results_of(document: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the ids of the results that the attached document rests on; none for entered coefficients."""
    found = [triad["lineage"]["result"] for triad in document["triads"] if triad.get("lineage")]
    return tuple(dict.fromkeys(found))


def compared(document: Mapping[str, Any], answers: Mapping[str, Mapping[str, Any]]) -> list[Repeated]:
    """Return the comparison of each triad with the recomputation of its result. `answers`: result id -> answer of the
    service.
    """
    return [_compared(triad, answers) for triad in document["triads"]]


def _compared(triad: Mapping[str, Any], answers: Mapping[str, Mapping[str, Any]]) -> Repeated:
    name, lineage = triad["triad"], triad.get("lineage")
    if not lineage:
        return Repeated(name, True, f"entered from {triad['origin']}: there are no raw data of it here")
    answer = answers[lineage["result"]]
    found = {one["id"]: one["found"] for one in answer["recordings"]}
    changed = [one["id"] for one in lineage["recordings"] if found.get(one["id"]) != one["content_hash"]]
    if changed:
        return Repeated(name, False, f"raw data changed since: recordings {', '.join(changed)}")
    again = next((one for one in answer["calibrations"] if one["triad"] == name), None)
    if again is None:
        return Repeated(name, False, f"the result {lineage['result']} gives no calibration of it any more")
    hashes = f"{len(lineage['recordings'])} recordings have the hashes of the certificate"
    versions = f"version {answer['stored_version']} then and {answer['version']} now"
    change = _largest_change(triad["coefficients"], again["coefficients"])
    if change == 0.0:
        return Repeated(name, True, f"{hashes}, and their analysis gives the same numbers to the last digit")
    if change <= NEGLIGIBLE:
        return Repeated(name, True, f"{hashes}, and the numbers change by {change:.1e} of their uncertainty")
    return Repeated(name, False, f"{hashes}, but the numbers change by {change:.2g} uncertainties ({versions})")


def _largest_change(stated: Sequence[Mapping[str, Any]], found: Sequence[float]) -> float:
    """Largest |new − stated|/u; infinite where a coefficient without uncertainty changed."""
    changes = [0.0]
    for row, new in zip(stated, found, strict=True):
        moved = abs(new - row["value"])
        if moved > 0.0:
            changes.append(moved / row["standard_uncertainty"] if row["standard_uncertainty"] else float("inf"))
    return max(changes)


def require_issuable(document: Mapping[str, Any], failed: bool) -> None:
    """Check that a certificate may be made. `failed`: one that states a failure is wanted.

    Raises `CertificateRefused` for a calibration that was rejected, has expired, or failed, with the way out.
    """
    for triad in document["triads"]:
        validity = triad["validity"]
        if validity["unusable"]:
            raise CertificateRefused(f"no certificate can be made of this calibration: {validity['unusable']}")
        if validity["verdict"] not in (None, "pass") and not failed:
            raise CertificateRefused(
                f"no certificate can be made of this calibration: the verdict on calibration {triad['calibration']} of "
                f"the {triad['triad']} triad is {validity['verdict']}; with --failed a certificate states that"
            )
