"""Parts of a printed report that a job's context gives: the unit as it was, mounting, instruments, conditions."""

from collections.abc import Iterator, Sequence
from typing import Any

from bench_service.formats.printed.document import Block, Facts, Heading, Paragraph, PrintedTable
from bench_service.model.records import StoredRecording

NOT_RECORDED = "not recorded"


def identity(context: dict[str, Any], serial: str) -> Iterator[Block]:
    """The unit as the job found it."""
    unit = context.get("unit") or {}
    declared = unit.get("declaration") or {}
    channels = ", ".join(c["name"] for c in unit.get("channels", ()))
    yield Heading("Unit")
    rows = [("serial", serial)]
    rows += [(name, declared.get(name) or NOT_RECORDED) for name in ("model", "part", "firmware")]
    rate = unit.get("sample_rate_hz")
    rows.append(("channels", channels or NOT_RECORDED))
    rows.append(("sample rate", NOT_RECORDED if rate is None else f"{rate:g} Hz"))
    known = ", ".join(unit.get("calibration_ids", ())) or "none"
    rows.append(("calibrations in use when the job began", known))
    yield Facts(tuple(rows))
    stated = [
        (c["state"], c["day"], c["certificate"], c["triad"], ", ".join(f"{b:.6g}" for b in c["bias"]))
        for c in declared.get("coefficients", ())
    ]
    if stated:
        columns = ("state", "day", "certificate", "triad", "bias")
        yield PrintedTable("Coefficients by former certificates", columns, tuple(stated))


def mounting(context: dict[str, Any]) -> Iterator[Block]:
    """The mounting, and the azimuth on which the job rested."""
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


def instruments(context: dict[str, Any]) -> Iterator[Block]:
    """Devices of the bench with their certificates and due days, and the table's declared accuracy."""
    bench = context.get("bench") or {}
    yield Heading("Instruments")
    rows: list[tuple[str, ...]] = []
    for device in bench.get("devices", ()):
        found, certificate = device.get("identity") or {}, device.get("certificate") or {}
        named = " ".join(filter(None, (found.get("maker"), found.get("model"))))
        kind = "simulated" if device["simulated"] else named or device["driver"] or NOT_RECORDED
        number = " ".join(filter(None, (certificate.get("number"), certificate.get("laboratory"))))
        rows.append((device["name"], kind, found.get("serial") or "–", number or "none", certificate.get("due") or "–"))
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


def conditions(context: dict[str, Any], recordings: Sequence[StoredRecording]) -> Iterator[Block]:
    """Site, temperatures, rate and time of the recordings."""
    yield Heading("Conditions")
    site = (context.get("bench") or {}).get("site")
    rows: list[tuple[str, str]] = []
    if site is not None:
        rows.append(("latitude", f"{site['latitude_deg']:g}°"))
        rows.append(("gravity", f"{site['gravity_m_s2']!r} ± {site['gravity_sd_m_s2']:g} m/s²"))
    stations = [r.info.station for r in recordings if r.info.station is not None]
    temperatures = sorted({s.temperature_c for s in stations if s.temperature_c is not None})
    ends = f"{temperatures[0]:g} … {temperatures[-1]:g} °C" if temperatures else "not set"
    rows.append(("temperature of the chamber", ends))
    volts = sorted({s.supply_voltage_v for s in stations if s.supply_voltage_v is not None})
    if volts:
        rows.append(("supply voltage", ", ".join(f"{v:g} V" for v in volts)))
    rows.append(("humidity and pressure", NOT_RECORDED))
    if recordings:
        rates = sorted({r.info.rate_hz for r in recordings})
        rows.append(("sample rate", ", ".join(f"{r:g} Hz" for r in rates)))
        rows.append(("recorded", f"{len(recordings)} recordings, {sum(r.info.duration_s for r in recordings):g} s"))
        since = [r.info.since_launch_s for r in recordings if r.info.launched_s is not None]
        if since:
            rows.append(("time from switching on to the first sample", f"{min(since):g} … {max(since):g} s"))
    yield Facts(tuple(rows))


def hashes(recordings: Sequence[tuple[str, str]]) -> Iterator[Block]:
    """Raw data by their content hashes."""
    yield Heading("Raw data")
    rows = tuple((str(number), one, digest) for number, (one, digest) in enumerate(recordings, start=1))
    note = "The hash is the SHA-256 of channels, scales, rate and samples."
    yield PrintedTable("", ("", "recording", "content hash"), rows, (), note)
