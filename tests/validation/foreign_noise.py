"""Noise from outside the model: does every claim hold, or is it said that it does not?

``python -m tests.validation.foreign_noise [--records N] [--kind TEXT]``. Whole channels, from samples to the result of
``noise_analysis``, with its default parameters. Exit code 1 if a kind misses its goal by more than chance allows.
"""

import argparse
import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread

from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table
from scipy.stats import binom

from procedures.core.errors import DomainError
from procedures.core.recording import Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.inspection import analyse_method
from procedures.methods.noise_analysis import METHOD, Params
from procedures.procedure import Evidence
from tests.validation.foreign_records import CLEAN, FOREIGN, Record

GOAL = 0.95
LEVEL = 1e-3
"""Probability that a kind which just meets its goal fails by chance."""
BAND = ("left out", "is not that of the slow part", "is not that of white reading noise")
"""Sentences on the fitted band: they say where the fit ends, not that a coefficient is doubtful, unless by name."""
FLICKER = ("flicker", "Gauss–Markov")
"""Sentences on a slow process: a random walk that misses beside them is not excused."""
PROCESSES = ("quantization", "random_walk", "bias_instability", "rate_random_walk", "rate_ramp")


@dataclass(frozen=True)
class Claim:
    """Claims about one record."""

    holds: dict[str, bool]
    """Of each process: the truth lies in the interval, or below the limit where none is given."""
    valued: bool
    """A random walk was given."""
    width: float
    """Of the interval of the random walk, over its truth; NaN where there is none."""
    named: bool
    """A sentence was said about the record."""
    refused: bool
    excused: dict[str, bool]
    """Of each process: a sentence names the cause, or the coefficient, that makes its interval doubtful."""


def recording(record: Record, name: str = "made") -> MemoryRecording:
    """One channel, with the temperature beside it where there is one."""
    raw: Any
    if record.codes:
        gyro, raw = Channel("gyro_x", Quantity.ANGULAR_RATE, "count"), record.samples.astype(np.int32)[:, None]
    elif record.counts:
        gyro = Channel("gyro_x", Quantity.ANGLE_INCREMENT, "count")
        raw = record.samples.astype(np.int32)[:, None]
    else:
        gyro, raw = Channel("gyro_x", Quantity.ANGULAR_RATE, "rad/s"), record.samples[:, None]
    channels = [gyro]
    if record.temperature_c is not None:
        channels.append(Channel("temperature", Quantity.TEMPERATURE, "degC"))
        raw = np.column_stack([raw, record.temperature_c])
    return MemoryRecording(RecordingInfo(name, "MADE", tuple(channels), record.rate_hz, len(raw)), raw)


def analysed(record: Record) -> Any:
    """The result document of ``noise_analysis``."""
    return analyse_method(METHOD, Evidence(recordings=(recording(record),)), Params.model_validate({}), None)


def claim(record: Record) -> Claim:
    """Claim about a record, and whether it holds."""
    try:
        result = analysed(record)
    except DomainError:
        every: dict[str, bool] = dict.fromkeys(PROCESSES, True)
        return Claim(every, valued=False, width=np.nan, named=True, refused=True, excused=every)
    (channel,) = result.launches[0].channels
    holds: dict[str, bool] = {}
    width = np.nan
    for process in PROCESSES:
        reading, true = channel.coefficient(process).likelihood, record.truth.get(process, 0.0)
        if reading.value is None:
            holds[process] = reading.upper_limit is None or true <= reading.upper_limit
        else:
            holds[process] = reading.lower <= true <= reading.upper
            if process == "random_walk" and true:
                width = (reading.upper - reading.lower) / true
    valued = channel.coefficient("random_walk").likelihood.value is not None
    excused = {p: any(names(sentence, p) for sentence in result.warnings) for p in PROCESSES}
    return Claim(holds, valued, width, bool(result.warnings), refused=False, excused=excused)


def names(sentence: str, process: str) -> bool:
    """Return whether a sentence says that the interval of a process may not hold, and why.

    That a part of the band is left out does not: a reader takes the interval for that of the rest.
    """
    letter = "QNBKR"[PROCESSES.index(process)]
    if "given as limits only" in sentence:
        return letter in sentence.rpartition(":")[2]
    if any(words in sentence for words in BAND):
        return process == "quantization" and "Q is" in sentence
    if any(words in sentence for words in FLICKER):
        return process not in ("random_walk", "quantization")
    return True


def row(name: str, claims: list[Claim]) -> tuple[str, ...]:
    """A kind's figures."""
    count = len(claims)
    shares = [np.mean([c.holds[p] for c in claims]) for p in PROCESSES]
    told = [np.mean([c.holds[p] or c.excused[p] for c in claims]) for p in PROCESSES]
    median = np.nanmedian([c.width for c in claims]) if any(c.valued for c in claims) else np.nan
    return (
        name,
        str(count),
        *(f"{share:.3f}" for share in shares),
        f"{min(told):.3f}",
        f"{np.mean([c.named for c in claims]):.3f}",
        f"{np.mean([c.valued for c in claims]):.2f}",
        f"{median:.3f}",
        str(sum(c.refused for c in claims)),
    )


def failures(name: str, claims: list[Claim]) -> list[str]:
    """A sentence for everything that misses its goal by more than chance allows."""
    count = len(claims)
    least = float(binom.ppf(LEVEL, count, GOAL))
    found = [
        f"{name}: {process.replace('_', ' ')} holds or is named in {held} of {count}, goal {GOAL:.0%}"
        for process in PROCESSES
        if (held := sum(c.holds[process] or c.excused[process] for c in claims)) < least
    ]
    quiet = sum(not c.named for c in claims)
    if name in CLEAN and quiet < least:
        found.append(f"{name}: nothing is named in {quiet} of {count}, goal {GOAL:.0%}")
    return found


def main() -> int:
    """All kinds, one after the other."""
    parser = argparse.ArgumentParser(description="Noise from outside the model against its truth")
    parser.add_argument("--records", type=int, default=100, help="of each kind (at least 20)")
    parser.add_argument("--kind", default="", help="only kinds whose name contains this")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    if options.records < 20:
        parser.error("at least 20 records")
    kinds = {name: make for name, make in {**CLEAN, **FOREIGN}.items() if options.kind in name}
    if not kinds:
        parser.error(f"no kind's name contains {options.kind!r}; the kinds: {', '.join([*CLEAN, *FOREIGN])}")
    console = Console(width=150)
    table = Table(
        title=f"Claims about foreign noise, {options.records} records a kind of 20 to 60 min", title_style="bold"
    )
    columns = (
        "kind",
        "records",
        "Q",
        "N",
        "B",
        "K",
        "R",
        "least held or named",
        "named",
        "N given",
        "width of N",
        "refused",
    )
    for column in columns:
        table.add_column(column, justify="left" if column == "kind" else "right")
    failed: list[str] = []
    numbers = {name: number for number, name in enumerate([*CLEAN, *FOREIGN])}
    for name, make in kinds.items():
        seeds = track(range(options.records), name, console=Console(stderr=True))
        claims = [claim(make(np.random.default_rng((options.seed, numbers[name], seed)))) for seed in seeds]
        table.add_row(*row(name, claims))
        # A run of hours that is cut short has still shown the kinds that it has finished.
        console.print(dict(zip(columns, row(name, claims), strict=True)), highlight=False)
        failed += failures(name, claims)
    console.print(table)
    console.print(
        "Q to R: share of records where the truth lies in the interval, or below the limit where no value is given.",
        highlight=False,
    )
    for failure in failed:
        console.print(f"[red]FAIL[/red] {failure}")
    console.print("[red]FAILED[/red]" if failed else "[green]All within tolerance.[/green]")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
