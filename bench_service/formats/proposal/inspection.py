"""Inspection of a file's rows for a proposal: the clocks, as an import inspects them, and plain statistics."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import log
from typing import Any

import numpy as np

from bench_service.formats.bounds import Bounds
from bench_service.formats.description import SECONDS, ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.joined_files import Opened, in_order, joined, surveyed
from bench_service.formats.logs.table import LogClock
from bench_service.formats.proposal.model import InspectedClock
from bench_service.formats.survey import Findings
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording

USUAL_HZ = 200.0
FASTEST_HZ, SLOWEST_HZ = 20_000.0, 1.0
LENIENT: dict[str, Any] = {"gaps": "mark", "repeats": "drop", "unwrap_clock": True}


@dataclass
class Values:
    """Running sums over all rows of some channels, raw values. `rows`: how many there are."""

    rows: int = 0
    sums: Array = field(default_factory=lambda: np.zeros(0))
    squares: Array = field(default_factory=lambda: np.zeros(0))
    finite: Array = field(default_factory=lambda: np.zeros(0))
    largest: Array = field(default_factory=lambda: np.zeros(0))
    whole: Array = field(default_factory=lambda: np.zeros(0))
    """1 where all finite values of a channel are whole numbers."""
    shift: Array = field(default_factory=lambda: np.zeros(0))

    def add(self, block: Array) -> None:
        """Add rows, (n, channels); sums are about the first row, so that they keep their digits."""
        if not self.rows:
            width = block.shape[1]
            self.shift = np.where(np.isfinite(block[0]), block[0], 0.0)
            self.sums, self.squares, self.finite, self.largest = (np.zeros(width) for _ in range(4))
            self.whole = np.ones(width)
        good = np.isfinite(block)
        moved = np.where(good, block - self.shift, 0.0)
        self.sums += moved.sum(axis=0)
        self.squares += (moved**2).sum(axis=0)
        self.finite += good.sum(axis=0)
        self.largest = np.maximum(self.largest, np.where(good, np.abs(block), 0.0).max(axis=0))
        self.whole *= np.all(~good | (block == np.rint(block)), axis=0)
        self.rows += len(block)

    @property
    def means(self) -> Array:
        """Mean of each channel; NaN where it has no finite value."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(self.finite > 0, self.sums / self.finite, np.nan) + self.shift

    @property
    def deviations(self) -> Array:
        """Standard deviation of each channel; NaN where it has no finite value."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.sqrt(np.maximum(self.squares / self.finite - (self.sums / self.finite) ** 2, 0.0))


def values_of(opened: Sequence[Opened], fields: dict[str, Any], channels: Sequence[dict[str, Any]]) -> Values:
    """Read all rows of some channels and return their sums. Raises `UnreadableFile`."""
    description = ImportDescription.model_validate(
        {**fields, "unit": "U", "rate_hz": 1.0, "gaps": "mark", "channels": list(channels)}
    )
    found = Values()
    for parts in joined(opened, description, Bounds.of(_size(opened))):
        found.add(in_order(parts, description))
    return found


def inspected(
    opened: Sequence[Opened], fields: dict[str, Any], channel: dict[str, Any], clock: LogClock, unit: str
) -> tuple[InspectedClock, dict[str, Any], list[str]]:
    """Inspect a clock; return what was found, the description's fields that it needs, and sentences on what is not
    known.

    `unit`: unit of time that its name gives; empty: it gives none.
    """
    asks: list[str] = []
    column = int(clock.column) if fields.get("header") is False else clock.column
    plain = {**fields, "unit": "U", "channels": [channel], "time_column": column}
    if clock.unit_s is not None:
        unit = next((u for u, s in {**SECONDS, "100us": 1e-4}.items() if s == clock.unit_s), "s")
    elif not unit:
        unit, sure = _likely_unit(opened, plain)
        if not sure:
            asks.append(
                f"the unit of time of {clock.column!r} is taken as {unit} by its steps: other units fit as well"
            )
    own = {"time_column": column} | ({} if unit == "s" else {"time_unit": unit})
    found, problem, needed = _judged(opened, {**plain, **own})
    judged = found.clock if found is not None else None
    document: dict[str, Any] = {} if judged is None else judged.document
    view = InspectedClock(
        column=column,
        meaning=clock.meaning,
        time_unit=unit,
        rate_hz=None if judged is None else judged.rate_hz,
        arrival=document.get("arrival"),
        lost_samples=document.get("lost_samples", 0),
        repeated_rows=document.get("repeated_rows", 0),
        problem=problem,
        warnings=[] if judged is None else list(judged.warnings),
    )
    return view, {**own, **needed}, asks


def _judged(opened: Sequence[Opened], asked: dict[str, Any]) -> tuple[Findings | None, str | None, dict[str, Any]]:
    """Survey strictly, then with gaps, repeats and wraps allowed; return which of these are needed."""
    bounds = Bounds.of(_size(opened))
    try:
        return surveyed(opened, ImportDescription.model_validate(asked), bounds), None, {}
    except (UnfitRecording, UnreadableFile):
        pass
    try:
        found = surveyed(opened, ImportDescription.model_validate({**asked, **LENIENT}), bounds)
    except (UnfitRecording, BadParameter, UnreadableFile) as error:
        return None, str(error), {}
    document: dict[str, Any] = {} if found.clock is None else found.clock.document
    needed: dict[str, Any] = {}
    if document.get("repeated_rows"):
        needed["repeats"] = "drop"
    if document.get("wraps"):
        needed["unwrap_clock"] = True
    if document.get("lost_samples") or any("empty or NaN" in warning for warning in found.warnings):
        needed["gaps"] = "mark"
    return found, None, needed


def _likely_unit(opened: Sequence[Opened], asked: dict[str, Any]) -> tuple[str, bool]:
    """Guess the unit of stamps from their usual step: the one that gives a likely rate; whether it is the only one."""
    description = ImportDescription.model_validate({**asked, **LENIENT})
    blocks = next(joined(opened, description, Bounds.of(_size(opened))), None)
    stamps = None if blocks is None else blocks[0].stamps
    steps = np.diff(stamps.astype(np.float64)) if stamps is not None and len(stamps) > 1 else np.zeros(0)
    steps = steps[steps > 0.0]
    if not len(steps):
        return "s", False
    per_unit = 1.0 / float(np.median(steps))
    likely = {u: per_unit / s for u, s in SECONDS.items() if SLOWEST_HZ <= per_unit / s <= FASTEST_HZ}
    if not likely:
        return "s", False
    return min(likely, key=lambda u: abs(log(likely[u] / USUAL_HZ))), len(likely) == 1


def _size(opened: Sequence[Opened]) -> int:
    size = 0
    for one in opened:
        size += one.file.stream.seek(0, 2)
        one.file.stream.seek(0)
    return size
