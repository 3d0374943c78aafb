"""``python -m tests.benchmarks.allan [band samples]``: the Allan and band budgets, beside allantools and exact sums."""

import resource
import sys
import warnings
from collections.abc import Iterator

import numpy as np

from bench_service.wall_clock import monotonic_s
from procedures.analysis.allan.band import BandStream, start_sums
from procedures.analysis.allan.deviation import deviation
from procedures.analysis.allan.statistic import log_sizes

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import allantools

RATE_HZ = 400.0
SAMPLES = 8_640_000
SIZES = 226
"""Log-spaced; 200 of them differ as whole numbers."""
BAND_SAMPLES = 180_000_000
BLOCK = 1 << 20
EXACT = (1, 30, 300, 3_000, 30_000, 300_000, 3_000_000, 30_000_000)


def noise(samples: int, quantization: float) -> Iterator[np.ndarray]:
    """White rate of unit density with a slow random walk, read with white angle noise; rad/s-like, in blocks."""
    rng = np.random.default_rng(1)
    walk, last = 0.0, 0.0
    for start in range(0, samples, BLOCK):
        count = min(BLOCK, samples - start)
        steps = rng.normal(0.0, 2e-5, count)
        steps[0] += walk
        slow = np.cumsum(steps, out=steps)
        walk = float(slow[-1])
        reading = rng.normal(0.0, quantization, count)
        yield slow + rng.normal(size=count) + np.diff(reading, prepend=last)
        last = float(reading[-1])


def overlapping() -> None:
    """Overlapping Allan of a long record against allantools at the same cluster sizes."""
    y = np.concatenate(list(noise(SAMPLES, 20.0)))  # angle noise rules below about 1200 samples
    ours: list[float] = []
    for _ in range(3):
        begun = monotonic_s()
        result = deviation(y, RATE_HZ, sizes=log_sizes(SAMPLES // 2, SIZES))
        ours.append(monotonic_s() - begun)
    begun = monotonic_s()
    _, theirs, _, _ = allantools.oadev(y, rate=RATE_HZ, data_type="freq", taus=result.tau_s)
    peer = monotonic_s() - begun
    difference = np.abs(result.deviation[: len(theirs)] / theirs - 1.0)
    exact = result.strides[: len(theirs)] == 1
    print(f"overlapping Allan, {SAMPLES} samples, {len(result.sizes)} cluster sizes, with intervals")
    print(f"  ours {sorted(ours)[1]:.2f} s (median of 3), allantools {peer:.1f} s: 1/{peer / sorted(ours)[1]:.0f}")
    print(
        f"  largest difference: {difference[exact].max():.1e} exact part, {difference[~exact].max():.2%} thinned part"
    )
    print(f"  budget: 1/60 and 0.10 %; peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3:.0f} MB")


def band(samples: int) -> None:
    """Band with a 0.002-decade step against exact sums at some sizes."""
    blocks = list(noise(samples, 0.0))
    begun = monotonic_s()
    stream = BandStream(RATE_HZ, samples)
    for block in blocks:
        stream.add(block)
    ours = stream.finish()
    took = monotonic_s() - begun
    print(f"band, {samples} samples, {len(ours.sizes)} cluster sizes (0.002 decade): {took:.1f} s; budget 30 s")
    x = np.zeros(samples + 1)
    at = 1
    while blocks:
        block = blocks.pop(0)
        x[at : at + len(block)] = block
        at += len(block)
    np.cumsum(x, out=x)
    for wanted in EXACT:
        if wanted > samples // 5:
            break
        i = int(np.argmin(np.abs(ours.sizes - wanted)))
        m = int(ours.sizes[i])
        begun = monotonic_s()
        sums, terms = start_sums(x, m)
        exact = np.sqrt(sums / terms / 2.0) / m
        off = [
            f"{found / true - 1:+.3%}"
            for found, true in zip(
                (ours.least[i], ours.mean[i], ours.greatest[i]), (exact.min(), exact.mean(), exact.max()), strict=True
            )
        ]
        print(f"  m = {m:>9}: {ours.starts[i]:>6} starts, least, mean, greatest off by {', '.join(off)}", end="")
        print(f"; exact {monotonic_s() - begun:.1f} s a size")


if __name__ == "__main__":
    overlapping()
    band(int(sys.argv[1]) if len(sys.argv) > 1 else BAND_SAMPLES)
