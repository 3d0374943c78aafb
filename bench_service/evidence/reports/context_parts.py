"""Parts of a printed report that a job's context gives: the unit as it was, mounting, instruments, raw data."""

from collections.abc import Iterator, Sequence
from datetime import datetime
from typing import Any

from bench_service.formats.printed.document import Block, Facts, Heading, Paragraph, PrintedTable
from bench_service.model.job import Job
from bench_service.model.records import StoredRecording, StoredResult
from procedures.bench.declared_device import DeclaredCertificate

NOT_RECORDED = "not recorded"


def identity(context: dict[str, Any], serial: str) -> Iterator[Block]:
    """Yield the section on the unit as the job found it: serial, declaration, channels."""
    unit = context.get("unit") or {}
    declared = unit.get("declaration") or {}
    channels = ", ".join(c["name"] for c in unit.get("channels", ()))
    yield Heading("Unit")
    rows = [("serial", serial)]
    rows += [(name, declared.get(name) or NOT_RECORDED) for name in ("model", "part", "firmware")]
    rate = unit.get("sample_rate_hz")
    rows.append(("channels", channels or NOT_RECORDED))
    rows.append(("sample rate", NOT_RECORDED if rate is None else f"{rate:g} Hz"))
    yield Facts(tuple(rows))
    stated = [
        (c["state"], c["day"], c["certificate"], c["triad"], ", ".join(f"{b:.6g}" for b in c["bias"]))
        for c in declared.get("coefficients", ())
    ]
    if stated:
        columns = ("state", "day", "certificate", "triad", "bias")
        yield PrintedTable("Coefficients by former certificates", columns, tuple(stated))


def mounting(context: dict[str, Any]) -> Iterator[Block]:
    """Yield the section on the mounting, and the azimuth on which the job rested."""
    yield Heading("Mounting")
    found = context.get("mounting")
    if found:
        yield Facts(
            (
                ("mounting", found["id"]),
                ("plate", found["plate"]),
                ("mounted", f"{found['mounted_at']} by {found['by'] or NOT_RECORDED}"),
                ("azimuth", f"{found['azimuth_deg']:.6f}° ± {found['azimuth_sd_arcsec']:g}″ (standard uncertainty)"),
            )
        )
        return
    site = (context.get("bench") or {}).get("site")
    said = "" if site is None else f": {site['azimuth_deg']:.6f}° ± {site['azimuth_sd_arcsec']:g}″"
    yield Paragraph(f"No mounting was entered; the azimuth is the one that the bench declares{said}.")


def instruments(context: dict[str, Any], at: datetime) -> Iterator[Block]:
    """Yield the section on devices of the bench with their certificates, those overdue at a time marked, and the
    table's accuracy.

    `at`: the time of the recordings (`recorded_at`).
    """
    bench = context.get("bench") or {}
    yield Heading("Instruments")
    rows: list[tuple[str, ...]] = []
    for device in bench.get("devices", ()):
        found, certificate = device.get("identity") or {}, device.get("certificate") or {}
        named = " ".join(filter(None, (found.get("maker"), found.get("model"))))
        kind = "simulated" if device["simulated"] else named or device["driver"] or NOT_RECORDED
        number = " ".join(filter(None, (certificate.get("number"), certificate.get("laboratory"))))
        due = _due(certificate, at)
        rows.append((device["name"], kind, found.get("serial") or "–", number or "none", due))
    if rows:
        columns = ("instrument", "device", "serial", "certificate", "due")
        yield PrintedTable("", columns, tuple(rows))
    else:
        yield Paragraph(f"Bench {bench.get('id', NOT_RECORDED)} declares no instruments with certificates.")
    accuracy = bench.get("accuracy")
    if accuracy is not None:
        names = {
            "orthogonality_sd_arcsec": "orthogonality",
            "pointing_sd_arcsec": "pointing",
            "level_sd_arcsec": "level",
        }
        said = ", ".join(f"{word} {accuracy[key]:g}″" for key, word in names.items() if key in accuracy)
        yield Facts((("table, standard uncertainties", said),))


def recorded_at(result: StoredResult, job: Job | None, recordings: Sequence[StoredRecording]) -> datetime:
    """Return the time by which certificates of instruments are judged: a result that is computed again later has the
    same.

    It is the job's, as of the result's own warnings; without a job, that of the first recording.
    """
    if job is not None:
        return job.created_at
    return min((recording.created_at for recording in recordings), default=result.created_at)


def _due(certificate: dict[str, Any], at: datetime) -> str:
    """The due day of a certificate, marked where it was over already."""
    if not certificate.get("due"):
        return "–"
    declared = DeclaredCertificate(certificate.get("number", ""), certificate.get("laboratory", ""), certificate["due"])
    return f"{declared.due}, OVERDUE" if declared.overdue(at.date().isoformat()) else declared.due


def hashes(recordings: Sequence[tuple[str, str]]) -> Iterator[Block]:
    """Yield the section on raw data: recordings with their content hashes."""
    yield Heading("Raw data")
    rows = tuple((str(number), one, digest) for number, (one, digest) in enumerate(recordings, start=1))
    note = "The hash is the SHA-256 of channels, scales, rate and samples."
    yield PrintedTable("", ("", "recording", "content hash"), rows, (), note)
