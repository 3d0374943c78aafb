"""Conditions in a printed report: the site, the chamber, the room, the supply and the time of the recordings."""

from collections.abc import Iterator, Sequence
from typing import Any

from bench_service.evidence.reports.context_parts import NOT_RECORDED
from bench_service.formats.printed.document import Block, Facts, Heading
from bench_service.model.records import StoredRecording
from procedures.core.measured import MeasuredEnvironment, MeasuredSupply
from procedures.core.recording import Station

Row = tuple[str, str]


def conditions(context: dict[str, Any], recordings: Sequence[StoredRecording]) -> Iterator[Block]:
    """Yield the section on conditions: site, temperatures, room, supply, rate and time of the recordings."""
    yield Heading("Conditions")
    site = (context.get("bench") or {}).get("site")
    rows: list[Row] = []
    if site is not None:
        rows.append(("latitude", f"{site['latitude_deg']:g}°"))
        rows.append(
            ("gravity", f"{site['gravity_m_s2']!r} m/s², standard uncertainty {site['gravity_sd_m_s2']:g} m/s²")
        )
    stations = [r.info.station for r in recordings if r.info.station is not None]
    rows += _chamber(stations)
    measured = [r.info.measured for r in recordings if r.info.measured is not None]
    rows += _room([m.environment for m in measured if m.environment is not None])
    rows += _supply(stations, [m.supply for m in measured if m.supply is not None])
    rows += _time(recordings)
    yield Facts(tuple(rows))


def _chamber(stations: Sequence[Station]) -> Iterator[Row]:
    """Set points of the chamber: of each station, and of the legs of its temperature profile."""
    fixed = sorted({s.temperature_c for s in stations if s.temperature_c is not None})
    profiles = list(dict.fromkeys(tuple(leg.target_c for leg in s.profile.legs) for s in stations if s.profile))
    if profiles and not fixed:
        legs = "; ".join(", ".join(f"{target:g}" for target in targets) for targets in profiles)
        yield "set points of the chamber", f"{legs} °C, in this order"
    elif fixed:
        yield "set points of the chamber", f"{_range(fixed)} °C"
    else:
        yield "set points of the chamber", "none: it was not used"


def _room(read: Sequence[MeasuredEnvironment]) -> Iterator[Row]:
    """Ranges of the room's conditions over the recordings."""
    for name, field, unit in (
        ("temperature of the room", "temperature_c", "°C"),
        ("humidity of the room", "humidity_percent", "%"),
        ("air pressure", "pressure_hpa", "hPa"),
    ):
        values = [value for one in read if (value := getattr(one, field)) is not None]
        yield name, f"{_range(values)} {unit}" if values else NOT_RECORDED


def _supply(stations: Sequence[Station], read: Sequence[MeasuredSupply]) -> Iterator[Row]:
    """The voltage that was set, and what the supply read."""
    volts = sorted({s.supply_voltage_v for s in stations if s.supply_voltage_v is not None})
    if volts:
        yield "supply voltage, set", ", ".join(f"{v:g} V" for v in volts)
    if read:
        voltage, current = [s.voltage_v for s in read], [s.current_a for s in read]
        yield "supply, measured", f"{_range(voltage)} V, {_range(current)} A"
        if any(s.limiting for s in read):
            yield "supply, current limit", "reached"


def _time(recordings: Sequence[StoredRecording]) -> Iterator[Row]:
    """Rates, lengths and times since the launch."""
    if not recordings:
        return
    rates = sorted({r.info.rate_hz for r in recordings})
    yield "sample rate", ", ".join(f"{r:g} Hz" for r in rates)
    count = f"{len(recordings)} recording{'s' if len(recordings) > 1 else ''}"
    yield "recorded", f"{count}, {sum(r.info.duration_s for r in recordings):g} s in all"
    since = [r.info.since_launch_s for r in recordings if r.info.launched_s is not None]
    if since:
        yield "time from switching on to the first sample", f"{_range(since)} s"


def _range(values: Sequence[float]) -> str:
    """The least and the greatest of some values, to four digits; one number where they print alike."""
    low, high = f"{min(values):.4g}", f"{max(values):.4g}"
    return low if low == high else f"{low} … {high}"
