"""Noise of a unit in a printed report: its record, the change of it by a result, and its trend over static launches."""

from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any

from bench_service.evidence.stores import EvidenceStores
from bench_service.formats.printed.document import PrintedTable
from bench_service.model.records import StoredResult
from procedures.core.recording import TRIADS
from procedures.core.report import Figure, Series
from procedures.core.unit import TriadRecord, Unit
from procedures.core.units import NOISE_DISPLAY

RATE_UNIT = {"gyro": "rad/s", "accelerometer": "m/s^2"}
NOISE_RESULTS = 20
"""Most results of a noise trend."""
MOST_READ = 100
"""Results that a trend looks at, those of the other origin and older analyses too: each may have a megabyte."""
LAUNCHES = "static_run"
"""Procedure whose results give the noise of a unit."""
NOT_SEEN = "≤: no launch showed the process; the value is the one to plan with, from its upper limit."


def origin(record: TriadRecord | None) -> str:
    """Return the origin of a triad's noise in the record as text: a data sheet, or a result. None: the noise is not
    known.
    """
    return "nothing is known" if record is None else record.noise_origin


def noise(unit: Unit) -> Iterator[PrintedTable]:
    """Yield a table of the noise of each triad whose noise is known, in the units that people read."""
    for triad, channels in TRIADS.items():
        record = unit.triad(triad)
        if record is None:
            continue
        known = NOISE_DISPLAY[RATE_UNIT[triad]]
        rows = tuple(
            (channel, *(_noise_cell(record, i, process, RATE_UNIT[triad]) for process in known))
            for i, channel in enumerate(channels)
        )
        columns = ("channel", *(f"{process.replace('_', ' ')}, {label}" for process, (label, _) in known.items()))
        note = f"Origin: {origin(record)}. {NOT_SEEN}"
        yield PrintedTable(f"Noise of the {triad}s", columns, rows, tuple(range(1, 6)), note)


def noise_change(before: Unit, after: Unit) -> Iterator[PrintedTable]:
    """Yield a table of the noise of channels whose record the result changed, as found and as left."""
    rows: list[tuple[str, ...]] = []
    for triad, channels in TRIADS.items():
        old, new = before.triad(triad), after.triad(triad)
        if new is None or old == new:
            continue
        for i, channel in enumerate(channels):
            for process, (unit, _) in NOISE_DISPLAY[RATE_UNIT[triad]].items():
                cells = (_noise_cell(record, i, process, RATE_UNIT[triad]) for record in (old, new))
                rows.append((channel, process.replace("_", " "), unit, *cells))
    if rows:
        columns = ("channel", "process", "unit", "as found", "as left")
        yield PrintedTable("Noise in the record of the unit", columns, tuple(rows), (3, 4), NOT_SEEN)


def noise_trends(
    stores: EvidenceStores, serial: str, simulated: bool, newest: StoredResult | None = None
) -> Iterator[Figure]:
    """Yield figures of noise coefficients over the unit's static launches, oldest first; none with fewer than two
    results.

    `simulated`: of recordings of a simulated bench, or of real ones. `newest`: only this result and older ones; None:
    up to the unit's newest.
    """
    documents = [d["channels"] for d in _documents(stores, serial, simulated, newest)][::-1]
    if len(documents) < 2:
        return
    for triad, channels in TRIADS.items():
        for process, (unit, size) in NOISE_DISPLAY[RATE_UNIT[triad]].items():
            series = tuple(s for name in channels if (s := _series(documents, name, process, size)) is not None)
            if series:
                name = process.replace("_", " ").capitalize()
                title = f"{name} of the {triad}s"
                note = "Mean over the launches of a result; bars are standard uncertainties. Not observed: no mark."
                yield Figure(title, "static run, oldest first", f"{name}, {unit}", series, note=note)


def _documents(
    stores: EvidenceStores, serial: str, simulated: bool, newest: StoredResult | None
) -> Iterator[dict[str, Any]]:
    """Documents of the unit's static launches, newest first, the newest analysis of each job."""
    jobs: set[str | None] = set()
    for result in islice(_launches(stores, serial, newest), MOST_READ):
        if result.simulated == simulated and result.job_id not in jobs:
            jobs.add(result.job_id)
            yield result.document
        if len(jobs) == NOISE_RESULTS:
            return


def _launches(stores: EvidenceStores, serial: str, newest: StoredResult | None) -> Iterator[StoredResult]:
    """Results of the unit's static launches, newest first, read one by one; `newest`: this result and older ones."""
    if newest is not None:
        yield newest
    after, more = None if newest is None else newest.id, True
    while more:
        page = stores.results.list(unit=serial, name=LAUNCHES, after=after, limit=1)
        yield from page.items
        after, more = page.next, page.next is not None


def _series(documents: Sequence[list[dict[str, Any]]], channel: str, process: str, size: float) -> Series | None:
    """One channel's coefficient over the documents that show it; None where fewer than two do."""
    found: list[tuple[float, float, float]] = []
    for number, channels in enumerate(documents, start=1):
        means = next((c["means"] for c in channels if c["channel"] == channel), ())
        found += [
            (float(number), mean["mean"] / size, (mean["sd"] or 0.0) / size)
            for mean in means
            if mean["process"] == process and mean["mean"] is not None
        ]
    if len(found) < 2:
        return None
    x, y, error = zip(*found, strict=True)
    return Series(channel, x, y, error, "line_points")


def _noise_cell(record: TriadRecord | None, axis: int, process: str, rate_unit: str) -> str:
    """A coefficient in the unit that people read, marked where no launch showed it; a dash for none."""
    if record is None:
        return "–"
    _, size = NOISE_DISPLAY[rate_unit][process]
    value = getattr(record.noise[axis], process)
    if not value:
        return "–"
    text = f"{value / size:.4g}"
    return f"≤ {text}" if process in record.not_observed[axis] else text
