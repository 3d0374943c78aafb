"""Faults put into sound recordings, each with what the inspection is to say: the kind, the channels, place and size."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tests.validation.inspection_records import NOISES, Array, Record, Rng, counts, decimals, means, size, white

GYROS, ACCELEROMETERS = (0, 1, 2), (3, 4, 5)


@dataclass(frozen=True)
class Fault:
    """A broken recording, and the truth about it."""

    record: Record
    kind: str
    columns: tuple[int, ...]
    index: int | None = None
    within: float = 0.0
    """Samples that the place may be off."""
    says: tuple[str, ...] = ()
    """Words or figures that the sentence must have."""
    count: int | None = None
    temperature: Array | None = None
    """A seventh channel, in degrees Celsius."""


def _sound(rng: Rng) -> Record:
    names = ("white", "low-passed", "flicker", "random walk")
    return counts(rng, names[int(rng.integers(4))], least_sd=4.0)


def _some(rng: Rng) -> tuple[int, ...]:
    """One channel, or a triad."""
    return (GYROS, ACCELEROMETERS, (int(rng.integers(6)),))[int(rng.integers(3))]


def _held(x: Array, columns: tuple[int, ...], begin: int, length: int) -> None:
    x[begin + 1 : begin + 1 + length, list(columns)] = x[begin, list(columns)]


def stands_still(rng: Rng) -> Fault:
    record, columns = _sound(rng), _some(rng)
    x, times = record.samples.copy(), int(rng.integers(1, 5))
    n = len(x)
    places = np.sort(rng.choice(np.arange(1, 20), times, replace=False)) * (n // 20)
    lengths = rng.integers(30, n // 25, times)
    for begin, length in zip(places, lengths, strict=True):
        _held(x, columns, int(begin), int(length))
    longest = int(np.argmax(lengths))
    said = (f"longest {int(lengths[longest])}", "once" if times == 1 else f"{times} times")
    return Fault(replace(record, samples=x), "stands_still", columns, int(places[longest]) + 1, 3.0, said)


def hung_rows(rng: Rng) -> Fault:
    """The whole row, in one to four places."""
    record = _sound(rng)
    x, times = record.samples.copy(), int(rng.integers(1, 5))
    places = np.sort(rng.choice(np.arange(1, 20), times, replace=False)) * (len(x) // 20)
    for begin in places:
        _held(x, (*GYROS, *ACCELEROMETERS), int(begin), 40)
    said = () if times == 1 else (f"{times} such runs", *(str(int(p) + 1) for p in places))
    return Fault(replace(record, samples=x), "repeated", (0,), int(places[0]) + 1, 1e9, said)


def two_rates(rng: Rng) -> Fault:
    record = _sound(rng)
    x, k = record.samples.copy(), int(rng.integers(2, 11))
    columns = (GYROS, ACCELEROMETERS)[int(rng.integers(2))]
    x[:, list(columns)] = np.repeat(x[::k, list(columns)], k, axis=0)[: len(x)]
    return Fault(replace(record, samples=x), "copied", columns, says=(f"rate {record.rate_hz / k}",))


def rows_repeated(rng: Rng) -> Fault:
    record, k = _sound(rng), int(rng.integers(2, 8))
    x = np.repeat(record.samples, k, axis=0)
    return Fault(replace(record, samples=x), "repeated", (0, 1, 2, 3, 4, 5), says=("sent more than once",))


def read_as_unsigned(rng: Rng) -> Fault:
    bits = int(rng.choice([12, 14, 16, 18, 20, 24]))
    record, c = _sound(rng), int(rng.integers(6))
    x, n = record.samples.copy(), len(record.samples)
    sd = min(2.0 ** (bits - 6), 200.0)
    x[:, c] = np.rint(rng.uniform(-1.5, 1.5) * sd + sd * rng.normal(0.0, 1.0, n)).astype(np.int32) % 2**bits
    return Fault(replace(record, samples=x), "wrapped", (c,), says=(f"2^{bits}", "unsigned"))


def wraps_24_bits(rng: Rng) -> Fault:
    """A channel near the end of its range that steps over it."""
    bits = int(rng.choice([16, 20, 24]))
    record, c = _sound(rng), int(rng.integers(6))
    x, n, half = record.samples.copy(), len(record.samples), 2 ** (bits - 1)
    sd = 2.0 ** (bits - 7)
    over = half + rng.uniform(-1.5, 1.5) * sd + sd * rng.normal(0.0, 1.0, n)
    x[:, c] = ((np.rint(over).astype(np.int64) + half) % (2 * half) - half).astype(np.int32)
    return Fault(replace(record, samples=x), "wrapped", (c,), says=(f"2^{bits}", "wrap"))


def temperature_wraps(rng: Rng) -> Fault:
    record = _sound(rng)
    n = len(record.samples)
    t = 60.0 + rng.uniform(2.0, 8.0) * np.linspace(0.0, 1.0, n) + rng.normal(0.0, 0.02, n)
    edge = float(t[int(rng.uniform(0.2, 0.8) * n)])
    first = int(np.argmax(t > edge))
    return Fault(record, "wrapped", (6,), first, 3.0, ("128 K",), temperature=np.where(t > edge, t - 128.0, t))


def steps(rng: Rng) -> Fault:
    """Steps of 1 … 30 standard deviations of a sample, on white or low-passed noise."""
    record, c = counts(rng, ("white", "low-passed")[int(rng.integers(2))], least_sd=4.0), int(rng.integers(6))
    x, n = record.samples.copy(), len(record.samples)
    at = int(rng.uniform(0.15, 0.85) * n)
    height = float(x[:, c].std() * 10 ** rng.uniform(0.0, 1.5) * rng.choice([-1, 1]))
    x[at:, c] += round(height)
    return Fault(replace(record, samples=x), "step", (c,), at, 0.01 * n, (f"height {round(height)}",), 1)


def noise_changes(rng: Rng) -> Fault:
    """By a factor of 1.8 … 6, up or down."""
    name, c = ("white", "low-passed", "flicker")[int(rng.integers(3))], int(rng.integers(6))
    n, rate = size(rng)
    sd = 10 ** rng.uniform(np.log10(4.0), 2.5, 6)
    at, factor = int(rng.uniform(0.15, 0.85) * n), float(rng.uniform(1.8, 6.0)) ** float(rng.choice([-1, 1]))
    x = sd * NOISES[name](rng, n)
    x[:, c] *= np.where(np.arange(n) < at, max(1.0, 1.0 / factor), max(1.0, factor))
    x = np.rint(means(rng) + x).astype(np.int32)
    return Fault(Record(x, rate), "noise_change", (c,), at, 0.01 * n, (f"factor {factor}",), 1)


def outliers(rng: Rng) -> Fault:
    record, c = _sound(rng), int(rng.integers(6))
    x, n, count = record.samples.copy(), len(record.samples), int(rng.integers(1, 6))
    places = np.sort(rng.choice(np.arange(1, 40), count, replace=False)) * (n // 40)
    noise = float(np.abs(np.diff(x[:, c])).mean()) / 1.128
    for place in places:
        x[place, c] += round(float(rng.choice([-1, 1])) * noise * 10 ** rng.uniform(1.3, 2.5))
    return Fault(replace(record, samples=x), "outlier", (c,), int(places[0]), 0.0, (str(int(places[-1])),), count)


def piles_up(rng: Rng) -> Fault:
    """Full scale below the rail, one end or both, 0.5 … 40 % of the samples."""
    record, c = _sound(rng), int(rng.integers(6))
    x, n = record.samples.copy(), len(record.samples)
    full, share = int(rng.integers(20_000, 32_000)), float(10 ** rng.uniform(-2.3, -0.4))
    if rng.random() < 0.5:
        wave = full * 1.2 * np.sin(np.arange(n) * rng.uniform(0.01, 0.5)) + rng.normal(0.0, 60.0, n)
        x[:, c] = np.clip(np.rint(wave), -full, full).astype(np.int32)
    else:
        high = np.quantile(sample := rng.normal(0.0, 400.0, n), 1.0 - share)
        x[:, c] = np.minimum(np.rint(sample - high + full), full).astype(np.int32)
    return Fault(replace(record, samples=x), "saturated", (c,), says=(f"{full}",))


def wrong_rate(rng: Rng) -> Fault:
    """Increments over another time than is declared."""
    n, rate = size(rng)
    factor = float(rng.choice([0.2, 0.25, 0.5, 2.0, 4.0, 5.0]))
    up = rng.normal(0.0, 1.0, 3)
    per_s = np.concatenate([rng.normal(0.0, 1e-4, 3), 9.8 * rng.uniform(0.97, 1.03) * up / np.linalg.norm(up)])
    sd = np.concatenate([np.full(3, 2e-7), np.full(3, 2e-4)]) / np.array([1e-9] * 3 + [2e-8] * 3)
    x = per_s * factor / rate / np.array([1e-9] * 3 + [2e-8] * 3) + sd * white(rng, n)
    record = Record(np.rint(x).astype(np.int32), rate, increments=True, scale=(1e-9, 2e-8))
    return Fault(record, "wrong_rate", (0, 1, 2, 3, 4, 5), says=(f"{rate / factor:.6g} Hz", f"{factor:g} times"))


def wrong_unit(rng: Rng) -> Fault:
    record = decimals(rng, ("white", "low-passed")[int(rng.integers(2))])
    x = record.samples.copy()
    factor = float(rng.choice([0.5, 2.0, 4.0, 5.0, 9.80665, 1 / 9.80665, 57.29578, 1 / 57.29578, 1000.0, 0.001]))
    x[:, 3:] *= factor
    return Fault(replace(record, samples=x), "wrong_unit", ACCELEROMETERS)


def degrees(rng: Rng) -> Fault:
    """A MEMS gyro's degrees a second, declared as radians."""
    n, rate = size(rng)
    bias, walk = rng.uniform(-1.0, 1.0, 3), 10 ** rng.uniform(-2.2, -1.5)
    x = np.hstack(
        [bias + walk * np.sqrt(rate) * rng.normal(0.0, 1.0, (n, 3)), white(rng, n)[:, 3:] * 0.01 + [0, 0, 9.8]]
    )
    return Fault(Record(x, rate, scale=(1.0, 1.0)), "wrong_unit", GYROS, says=("deg/s",))


def unlikely_rates(rng: Rng) -> Fault:
    record = _sound(rng)
    rate = float(10 ** rng.uniform(-2.0, -0.5) if rng.random() < 0.5 else 10 ** rng.uniform(4.8, 6.0))
    return Fault(replace(record, rate_hz=rate), "unlikely_rate", (0,), says=(f"{rate:g} Hz",))


def twins(rng: Rng) -> Fault:
    """One sensor's values in two columns: as they are, negated, or in another unit."""
    record = _sound(rng)
    of, to = np.sort(rng.choice(6, 2, replace=False))
    factor = (1, -1, 57.29577951)[int(rng.integers(3))]
    x = record.samples.astype(np.float64) if isinstance(factor, float) else record.samples.copy()
    x[:, to] = x[:, of] * factor
    return Fault(replace(record, samples=x), "twin", (int(to),), says=(f"{'negated' if factor == -1 else 'repeats'}",))


FAULTS: dict[str, Callable[[Rng], Fault]] = {
    "channel or triad stands still": stands_still,
    "rows hang": hung_rows,
    "two rates by copying": two_rates,
    "rows sent more than once": rows_repeated,
    "signed read as unsigned": read_as_unsigned,
    "counts wrap": wraps_24_bits,
    "temperature wraps 128 K": temperature_wraps,
    "step of the bias": steps,
    "change of the noise": noise_changes,
    "outliers": outliers,
    "pile-up below the rail": piles_up,
    "rate off by a factor": wrong_rate,
    "unit off by a factor": wrong_unit,
    "degrees for radians": degrees,
    "unlikely rate": unlikely_rates,
    "one sensor in two channels": twins,
}

__all__ = ["FAULTS", "NOISES", "Any", "Fault", "means"]
