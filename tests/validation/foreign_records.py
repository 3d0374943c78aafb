"""Records whose noise the analysis may have no model of, made by filters and sums of their own.

Nothing here is the product's: spectra are shaped by a transform of white noise, processes by recursions. Every kind
gives samples (n,) of a rate, the sample rate, and the true coefficients of what is in it; all in units of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import butter, lfilter, sosfilt

Samples = np.ndarray
Dice = np.random.Generator
WALK = 3e-4
"""N of every record [rate/√Hz]."""
SETTLED = 4096
"""Samples before the record: filters have settled."""


@dataclass(frozen=True)
class Record:
    """One record and its truth."""

    samples: Samples
    rate_hz: float
    truth: dict[str, float] = field(default_factory=dict[str, float])
    """Of random_walk, bias_instability, rate_random_walk…; a process that is not named is absent."""
    temperature_c: Samples | None = None
    counts: bool = False
    """The samples are whole counts of angle."""
    codes: bool = False
    """The samples are whole codes of a rate."""


def white(dice: Dice, n: int, rate_hz: float, walk: float = WALK) -> Samples:
    """White noise of density N²."""
    return walk * np.sqrt(rate_hz) * dice.standard_normal(n)


def shaped(dice: Dice, n: int, rate_hz: float, density: Callable[[Samples], Samples]) -> Samples:
    """Noise of a two-sided density; a stretch of four times as long, so that nothing repeats in it."""
    m = 1 << int(np.ceil(np.log2(4 * n)))
    f = np.fft.rfftfreq(m, 1.0 / rate_hz)
    modes = np.fft.rfft(dice.standard_normal(m))
    modes[0] = 0.0
    modes[1:] *= np.sqrt(density(f[1:]) * rate_hz)
    return np.fft.irfft(modes, m)[:n]


def flicker(dice: Dice, n: int, rate_hz: float, b: float, corner_s: float) -> Samples:
    """B²/(2πf), two-sided, falling by another order above 1/(2π·corner)."""
    return shaped(
        dice, n, rate_hz, lambda f: b**2 / (2.0 * np.pi * f) / np.sqrt(1.0 + (2.0 * np.pi * f * corner_s) ** 2)
    )


def walk(dice: Dice, n: int, rate_hz: float, k: float) -> Samples:
    """Random walk of the rate."""
    return np.cumsum(dice.standard_normal(n)) * k / np.sqrt(rate_hz)


def size(dice: Dice) -> tuple[int, float]:
    """Length and sample rate: 20 to 60 min at 20 to 200 Hz."""
    rate = float(dice.choice([20.0, 50.0, 100.0, 200.0]))
    return int(dice.uniform(1200.0, 3600.0) * rate), rate


def clean(dice: Dice) -> Record:
    """White noise alone."""
    n, rate = size(dice)
    return Record(white(dice, n, rate), rate, {"random_walk": WALK})


def clean_walk(dice: Dice) -> Record:
    """White noise and a rate random walk, equal at 30 to 300 s."""
    n, rate = size(dice)
    k = WALK / dice.uniform(30.0, 300.0) * np.sqrt(3.0)
    return Record(white(dice, n, rate) + walk(dice, n, rate, k), rate, {"random_walk": WALK, "rate_random_walk": k})


def clean_reading(dice: Dice) -> Record:
    """White noise and white reading errors of the angle."""
    n, rate = size(dice)
    q = WALK * dice.uniform(0.05, 0.5)
    y = white(dice, n, rate) + np.diff(q * dice.standard_normal(n + 1)) * rate
    return Record(y, rate, {"random_walk": WALK, "quantization": q})


def low_pass(order: int) -> Callable[[Dice], Record]:
    """White noise behind a Butterworth low-pass at 2 to 45 % of the rate."""

    def make(dice: Dice) -> Record:
        n, rate = size(dice)
        sections = butter(order, 2.0 * dice.uniform(0.02, 0.45), output="sos")
        return Record(sosfilt(sections, white(dice, n + SETTLED, rate))[SETTLED:], rate, {"random_walk": WALK})

    return make


def means(dice: Dice) -> Record:
    """Moving means of 2 to 5 samples."""
    n, rate = size(dice)
    m = int(dice.integers(2, 6))
    y = np.convolve(white(dice, n + m - 1, rate), np.ones(m) / m, "valid")
    return Record(y, rate, {"random_walk": WALK})


def held(dice: Dice) -> Record:
    """A slower stream copied into a faster table, every value 2 to 5 times: two rates."""
    n, rate = size(dice)
    m = int(dice.integers(2, 6))
    y = np.repeat(white(dice, n // m + 1, rate / m), m)[:n]
    return Record(y + 1e-9 * dice.standard_normal(n), rate, {"random_walk": WALK})


def interpolated(dice: Dice) -> Record:
    """A slower stream interpolated to a faster rate."""
    n, rate = size(dice)
    ratio = dice.uniform(0.25, 0.8)
    slow = white(dice, int(n * ratio) + 2, rate * ratio)
    return Record(np.interp(np.arange(n) * ratio, np.arange(len(slow)), slow), rate, {"random_walk": WALK})


def resonance(dice: Dice) -> Record:
    """A resonance of 0.05 to 5 Hz, quality 3 to 30, as strong as the white noise at its peak or up to 100 times."""
    n, rate = size(dice)
    f0, quality = np.exp(dice.uniform(np.log(0.05), np.log(min(5.0, 0.2 * rate)))), dice.uniform(3.0, 30.0)
    radius = np.exp(-np.pi * f0 / quality / rate)
    angle = 2.0 * np.pi * f0 / rate
    a = [1.0, -2.0 * radius * np.cos(angle), radius**2]
    at_peak = 1.0 / abs(np.polyval(a, np.exp(1j * angle)))
    gain = np.sqrt(dice.uniform(1.0, 100.0)) / at_peak
    # zeros at 0 Hz and at half the rate: the peak adds nothing to the random walk
    driven = lfilter([gain, 0.0, -gain], a, white(dice, n + SETTLED, rate)) / (2.0 * np.sin(angle))
    return Record(white(dice, n, rate) + driven[SETTLED:], rate, {"random_walk": WALK})


def lines(low: float, high: float) -> Callable[[Dice], Record]:
    """One to three sines between two frequencies (of the rate, if negative), of 0.1 to 3 times the noise of 1 s."""

    def make(dice: Dice) -> Record:
        n, rate = size(dice)
        n = max(n, int(4.0 / max(low, 1e-9) * rate)) if 0.0 < low < 0.01 else n
        ends = [abs(x) * rate if x < 0 else x for x in (low, high)]
        t = np.arange(n) / rate
        y = white(dice, n, rate)
        for _ in range(int(dice.integers(1, 4))):
            f = np.exp(dice.uniform(np.log(ends[0]), np.log(min(ends[1], 0.49 * rate))))
            y += WALK * dice.uniform(0.1, 3.0) * np.sin(2.0 * np.pi * (f * t + dice.uniform()))
        return Record(y, rate, {"random_walk": WALK})

    return make


def air(dice: Dice) -> Record:
    """Two hours and more beside a laboratory's air: a cycle of 10 to 25 min that wanders, seen through a lag."""
    rate = 20.0
    n = int(dice.uniform(2.0, 4.0) * 3600.0 * rate)
    period = dice.uniform(600.0, 1500.0)
    phase = np.cumsum(1.0 + 0.02 * walk(dice, n, rate, 0.03)) / rate / period
    on = np.where(np.mod(phase, 1.0) < dice.uniform(0.3, 0.7), 1.0, -1.0)
    lag = np.exp(-1.0 / rate / dice.uniform(60.0, 300.0))
    y = white(dice, n, rate) + WALK * dice.uniform(0.1, 1.0) * lfilter([1.0 - lag], [1.0, -lag], on)
    return Record(y, rate, {"random_walk": WALK})


def corner(dice: Dice) -> Record:
    """Flicker whose corner lies at 0.3 to 30 s, the white noise far below it at 100 s."""
    n, rate = size(dice)
    b = WALK * dice.uniform(0.3, 2.0)
    y = white(dice, n, rate) + flicker(dice, n, rate, b, float(np.exp(dice.uniform(np.log(0.3), np.log(30.0)))))
    return Record(y, rate, {"random_walk": WALK, "bias_instability": b})


def hyperbola(dice: Dice) -> Record:
    """Flicker up to half of the rate: as strong as the white noise at 0.1 Hz to a tenth of the rate."""
    n, rate = size(dice)
    equal_hz = np.exp(dice.uniform(np.log(0.1), np.log(0.1 * rate)))
    b = WALK * np.sqrt(2.0 * np.pi * equal_hz)
    y = white(dice, n, rate) + flicker(dice, n, rate, b, 0.0)
    return Record(y, rate, {"random_walk": WALK, "bias_instability": b})


def correlated(dice: Dice, n: int, rate_hz: float, sigma: float, time_s: float) -> Samples:
    """Gauss–Markov process of a standard deviation and a correlation time."""
    keep = np.exp(-1.0 / rate_hz / time_s)
    drive = sigma * np.sqrt(1.0 - keep**2) * dice.standard_normal(n)
    drive[0] = sigma * dice.standard_normal()
    return lfilter([1.0], [1.0, -keep], drive)


def gauss_markov(dice: Dice) -> Record:
    """A Gauss–Markov process of 5 to 100 s, a third to thrice the white noise of its own time."""
    n, rate = size(dice)
    time_s = float(np.exp(dice.uniform(np.log(5.0), np.log(100.0))))
    sigma = WALK / np.sqrt(time_s) * dice.uniform(0.6, 3.0)
    truth = {"random_walk": WALK, "time_s": time_s, "driving": sigma * np.sqrt(2.0 / time_s)}
    return Record(white(dice, n, rate) + correlated(dice, n, rate, sigma, time_s), rate, truth)


def fast_gauss_markov(dice: Dice) -> Record:
    """A Gauss–Markov process of 0.03 s (3 samples at least) to 2 s; its low part is 0.5 to 10 times the white noise."""
    n, rate = size(dice)
    time_s = float(np.exp(dice.uniform(np.log(max(0.03, 3.0 / rate)), np.log(2.0))))
    sigma = WALK * np.sqrt(dice.uniform(0.5, 10.0) / 2.0 / time_s)
    return Record(
        white(dice, n, rate) + correlated(dice, n, rate, sigma, time_s),
        rate,
        {"random_walk": WALK, "time_s": time_s, "driving": sigma * np.sqrt(2.0 / time_s)},
    )


def filtered_and_read(dice: Dice) -> Record:
    """White noise behind a low-pass of order 1 at 2 to 15 % of the rate, then a reader's white noise far below it."""
    n, rate = size(dice)
    sections, reader = butter(1, 2.0 * dice.uniform(0.02, 0.15), output="sos"), WALK * dice.uniform(0.1, 0.4)
    y = sosfilt(sections, white(dice, n + SETTLED, rate))[SETTLED:] + white(dice, n, rate, reader)
    return Record(y, rate, {"random_walk": float(np.hypot(WALK, reader))})


def coarse(*, codes: bool) -> Callable[[Dice], Record]:
    """White noise of 0.02 to 0.3 of the steps that the samples are rounded to, its mean anywhere between two steps."""

    def make(dice: Dice) -> Record:
        n, rate = size(dice)
        sd = np.exp(dice.uniform(np.log(0.02), np.log(0.3)))
        rounded = np.rint(sd * dice.standard_normal(n) + dice.uniform(-100.0, 100.0))
        step = 1.0 if codes else WALK * np.exp(dice.uniform(-3.0, 3.0))
        return Record(rounded * step, rate, {"random_walk": sd * step / np.sqrt(rate)}, codes=codes)

    return make


def counter(dice: Dice) -> Record:
    """A plain counter at rest: whole counts of an angle that turns evenly, with little noise."""
    n, rate = size(dice)
    walk_counts = np.exp(dice.uniform(np.log(0.002), np.log(0.3)))
    turn = np.exp(dice.uniform(np.log(3e-3), np.log(0.45))) * dice.choice([-1.0, 1.0])
    angle = dice.uniform() + np.cumsum(turn + walk_counts / np.sqrt(rate) * dice.standard_normal(n + 1))
    return Record(np.diff(np.floor(angle)), rate, {"random_walk": float(walk_counts)}, counts=True)


def step(dice: Dice) -> Record:
    """The level shifts once, by 0.3 to 5 times the noise of 1 s."""
    n, rate = size(dice)
    y = white(dice, n, rate)
    y[int(n * dice.uniform(0.1, 0.9)) :] += WALK * dice.uniform(0.3, 5.0) * dice.choice([-1.0, 1.0])
    return Record(y, rate, {"random_walk": WALK})


def outliers(dice: Dice) -> Record:
    """One to twenty samples off by 10 to 300 standard deviations."""
    n, rate = size(dice)
    y = white(dice, n, rate)
    at = dice.integers(0, n, int(dice.integers(1, 21)))
    y[at] += WALK * np.sqrt(rate) * dice.uniform(10.0, 300.0, len(at)) * dice.choice([-1.0, 1.0], len(at))
    return Record(y, rate, {"random_walk": WALK})


def warmed(dice: Dice) -> Record:
    """A drift that follows the temperature beside it, known to a noise of 0.02 K."""
    rate = 20.0
    n = int(dice.uniform(3600.0, 10_800.0) * rate)
    t = np.arange(n) / rate
    true = 25.0 + dice.uniform(1.0, 5.0) * (1.0 - np.exp(-t / dice.uniform(600.0, 4000.0)))
    true += dice.uniform(0.1, 0.5) * np.sin(2.0 * np.pi * (t / dice.uniform(1500.0, 4000.0) + dice.uniform()))
    true += walk(dice, n, rate, 0.003)
    slope = WALK * dice.uniform(0.2, 2.0) * dice.choice([-1.0, 1.0])
    y = white(dice, n, rate) + slope * (true - 25.0)
    seen = true + 0.02 * dice.standard_normal(n)
    return Record(y, rate, {"random_walk": WALK, "slope": slope}, temperature_c=seen)


def misread(dice: Dice) -> Record:
    """A drift that follows the temperature beside it, whose sensor sends an error code now and then."""
    record = warmed(dice)
    assert record.temperature_c is not None
    seen = record.temperature_c
    code, second = dice.choice([-127.0, 85.0, -273.15]), int(record.rate_hz)
    for at in dice.integers(second, len(seen) - 2 * second, int(dice.integers(1, 61))):
        seen[at : at + second] = code
    return record


CLEAN: dict[str, Callable[[Dice], Record]] = {
    "clean: N": clean,
    "clean: N, K": clean_walk,
    "clean: Q, N": clean_reading,
}
FOREIGN: dict[str, Callable[[Dice], Record]] = {
    **{f"low-pass of order {order}": low_pass(order) for order in (1, 2, 3, 4)},
    "means of 2 to 5": means,
    "two rates: held": held,
    "interpolated": interpolated,
    "resonance": resonance,
    "lines, 1/1200 to 0.01 Hz": lines(1.0 / 1200.0, 0.01),
    "lines, 0.01 to 0.7 Hz": lines(0.01, 0.7),
    "lines, 0.7 Hz to 0.49 of the rate": lines(0.7, -0.49),
    "laboratory's air": air,
    "flicker, corner 0.3 to 30 s": corner,
    "Gauss–Markov, 5 to 100 s": gauss_markov,
    "plain counter": counter,
    "level shift": step,
    "outliers": outliers,
    "temperature": warmed,
    "flicker up to half of the rate": hyperbola,
    "Gauss–Markov, 0.03 to 2 s": fast_gauss_markov,
    "filter, then white reading noise": filtered_and_read,
    "coarse steps as floats": coarse(codes=False),
    "coarse codes of a rate": coarse(codes=True),
    "temperature with error codes": misread,
}
