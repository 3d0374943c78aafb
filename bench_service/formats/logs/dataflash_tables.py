"""Tables of a DataFlash log: messages of inertial sensors, and the bursts of the batch sampler.

Units follow ArduPilot's logger structures: rates in rad/s, specific force in m/s², times in µs since power-on.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.table import LogClock, LogColumn, LogTable, Numbers, triad
from procedures.core.recording import Quantity

_SOURCE = "ArduPilot's logger structures"
_THINNED = (
    "IMU rows are written at the logger's rate, most samples between them are left out without a filter: noise that is "
    "found is that of unfiltered samples at a lower rate"
)
_KNOWN: dict[str, tuple[Quantity, str, str]] = {
    "Gyr": (Quantity.ANGULAR_RATE, "rad/s", "gyro"),
    "Acc": (Quantity.SPECIFIC_FORCE, "m/s^2", "accelerometer"),
}
_CLOCKS = (
    ("SampleUS", "the time of the sample, by the flight controller's clock"),
    ("TimeUS", "the time of logging, by the flight controller's clock"),
)
TYPES = ("accelerometer", "gyro")
SAMPLES = 32


def message_table(name: str, instance: int, fields: Sequence[str], form: str, rows: int) -> LogTable | None:
    """Return the table of a message type; None: it has no time, so no samples."""
    clocks = tuple(LogClock(field, 1e-6, words) for field, words in _CLOCKS if field in fields)
    if not clocks:
        return None
    columns: list[LogColumn] = []
    for field, letter in zip(fields, form, strict=True):
        known = _KNOWN.get(field[:3]) if field[3:] in ("X", "Y", "Z") else None
        if letter in "nNZa":
            continue
        if known is not None and name in ("IMU", "ACC", "GYR"):
            quantity, unit, kind = known
            columns.append(LogColumn(field, quantity, unit, channel=f"{kind}_{field[-1].lower()}", source=_SOURCE))
        elif name == "IMU" and field == "T":
            columns.append(LogColumn(field, Quantity.TEMPERATURE, "degC", channel="temperature", source=_SOURCE))
        else:
            columns.append(LogColumn(field, scale=0.01 if letter in "cCeE" else 1.0))
    notes = (_THINNED,) if name == "IMU" else ()
    return LogTable(f"{name}[{instance}]", tuple(columns), clocks, None, rows, notes)


@dataclass(frozen=True)
class Burst:
    """A burst of the batch sampler, as its header ISBH has it."""

    number: int
    kind: str
    instance: int
    multiplier: float
    count: int
    sample_us: int
    rate_hz: float

    @classmethod
    def of(cls, row: Any) -> "Burst":
        """Return the burst that a header record describes."""
        names = row.dtype.names
        kind = int(row["type"])
        return cls(
            number=int(row["N"]),
            kind=TYPES[kind] if kind < len(TYPES) else f"type {kind}",
            instance=int(row["instance"]),
            multiplier=float(row["mul"]),
            count=int(row["smp_cnt"]),
            sample_us=int(row["SampleUS"]) if "SampleUS" in names else int(row["TimeUS"]),
            rate_hz=float(row["smp_rate"]),
        )

    @property
    def title(self) -> str:
        """Name of the burst's table, with its number and instance."""
        return f"burst {self.number} of {self.kind}[{self.instance}]"


def burst_table(burst: Burst) -> LogTable:
    """Return the table of a burst: its own recording, since there are gaps between bursts."""
    gyro = burst.kind == "gyro"
    quantity, unit = (Quantity.ANGULAR_RATE, "rad/s") if gyro else (Quantity.SPECIFIC_FORCE, "m/s^2")
    scale = 1.0 / burst.multiplier if burst.multiplier else 1.0
    columns = triad(("x", "y", "z"), burst.kind, quantity, unit, scale, "counts divided by mul of the burst's header")
    clock = LogClock("sample_time", 1e-9, "SampleUS of the burst's header and its nominal rate")
    notes = (
        f"a burst of {burst.count} samples at {burst.rate_hz:g} Hz by its header; bursts of one sensor are apart, and "
        "each is a recording of its own",
    )
    return LogTable(burst.title, columns, (clock,), burst.rate_hz, burst.count, notes)


def burst_rows(burst: Burst, batches: Iterable[Any], columns: Sequence[str], name: str) -> Iterator[list[Numbers]]:
    """Yield blocks of the samples of a burst: for each named column its values, (n,). Raises `UnreadableFile` where a
    part of it is missing.
    """
    done = 0
    for rows in batches:
        part = rows[rows["N"] == burst.number]
        if not len(part):
            continue
        expected = np.arange(done, done + len(part))
        if not np.array_equal(part["seqno"], expected):
            at = int(np.flatnonzero(part["seqno"] != expected)[0])
            raise UnreadableFile(
                name,
                f"{burst.title}: part {expected[at]} is missing, part {part['seqno'][at]} follows: it was not logged",
            )
        count = min(len(part) * SAMPLES, burst.count - done * SAMPLES)
        step_ns = 1e9 / burst.rate_hz if burst.rate_hz else 0.0
        found: list[Numbers] = []
        for column in columns:
            if column == "sample_time":
                index = np.arange(done * SAMPLES, done * SAMPLES + count)
                found.append(burst.sample_us * 1000 + np.rint(index * step_ns).astype(np.int64))
            else:
                found.append(part[column].reshape(-1)[:count])
        yield found
        done += len(part)
    if done * SAMPLES < burst.count:
        raise UnreadableFile(
            name, f"{burst.title}: {done * SAMPLES} of {burst.count} samples are there: the rest was not logged"
        )
