"""``python -m tests.benchmarks.allan [band samples]``: the Allan and band budgets, beside allantools and exact sums."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: the service has BLAS in one thread

import resource
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from bench_service.wall_clock import monotonic_s
from procedures.analysis.allan.band import Band, BandStream, start_sums
from procedures.analysis.allan.deviation import Deviation, DeviationStream, deviation
from procedures.analysis.allan.family import deviations
from procedures.analysis.allan.statistic import STATISTICS, decade_sizes, log_sizes

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


def kinds() -> Iterator[tuple[str, np.ndarray]]:
    """Records of the benchmark's length whose deviations the fast sums reach by different ways."""
    rng = np.random.default_rng(2)
    readings = rng.normal(0.0, np.sqrt(64.0 * RATE_HZ / 3.0), SAMPLES + 1)
    yield "quantization below 64 s", np.diff(readings) + rng.normal(size=SAMPLES)
    yield "quantization alone", np.diff(readings)
    yield "white", rng.normal(size=SAMPLES)
    spectrum = np.fft.rfft(rng.normal(size=SAMPLES))
    spectrum[1:] /= np.sqrt(np.arange(1, len(spectrum)))
    yield "flicker", np.fft.irfft(spectrum, SAMPLES)
    yield "random walk", np.cumsum(rng.normal(size=SAMPLES))


def cpu_s(work: Callable[[], object]) -> float:
    """Median processor time of three rounds [s]: all of this is one thread's, and machines are shared."""
    times: list[float] = []
    for _ in range(3):
        begun = time.process_time()
        work()
        times.append(time.process_time() - begun)
    return sorted(times)[1]


def theirs(y: np.ndarray, found: Deviation) -> np.ndarray:
    """The peer at the same cluster sizes; it leaves out the last, of a single term."""
    _, peer, _, _ = allantools.oadev(y, rate=RATE_HZ, data_type="freq", taus=found.tau_s)
    return peer


def overlapping() -> None:
    """Overlapping Allan of a long record against allantools at the same cluster sizes."""
    y = np.concatenate(list(noise(SAMPLES, 20.0)))  # angle noise rules below about 1200 samples
    counts, sizes = np.round(50.0 * y).astype(np.int32), log_sizes(SAMPLES // 2, SIZES)
    found = deviation(y, RATE_HZ, sizes=sizes)
    peer = cpu_s(lambda: theirs(y, found))
    print(f"overlapping Allan, {SAMPLES} samples, {len(found.sizes)} cluster sizes, with intervals")
    print("  processor time, medians of 3")
    for name, samples in (("float64 rates", y), ("int32 increments", counts)):
        increments = samples.dtype == np.int32
        ours = cpu_s(partial(deviation, samples, RATE_HZ, sizes=sizes, increments=increments))
        print(f"  {name:17}: ours {ours:.2f} s, allantools {peer:.1f} s: 1/{peer / ours:.0f}; budget 1/65")
    for name, record in (("mixture", y), *kinds()):
        some = sizes if name == "mixture" else sizes[::4]
        result = deviation(record, RATE_HZ, sizes=some)
        reference = theirs(record, result)
        off = np.abs(result.deviation[: len(reference)] / reference - 1.0)
        exact = result.strides[: len(reference)] == 1
        print(
            f"  {name:24} off by {off[exact].max():.1e} up to {result.sizes[: len(reference)][exact].max()} samples, "
            f"{off[~exact].max():.3%} beyond; budget 0.10 %"
        )
    took: dict[str, float] = {}
    for statistic in STATISTICS.values():
        some = log_sizes(statistic.largest(SAMPLES), SIZES)
        took[statistic.name] = cpu_s(partial(deviation, y, RATE_HZ, statistic, sizes=some))
        print(f"  {statistic.name:22} {took[statistic.name]:.2f} s")
    every = {statistic: log_sizes(statistic.largest(SAMPLES), SIZES) for statistic in STATISTICS.values()}
    together, one = cpu_s(partial(deviations, y, RATE_HZ, every)), took["overlapping_allan"]
    print(f"  all six: {together / one:.1f} times the overlapping Allan; budget 3")
    print(f"  one after another: {sum(took.values()) / one:.1f} times")


def launch() -> None:
    """Six channels in blocks, as a static launch gives them; and what is asked of means of a second."""
    block = np.random.default_rng(3).normal(size=BLOCK)
    for samples, hours in ((SAMPLES, 6), (93_600_000, 65)):
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        streams = [DeviationStream(RATE_HZ, samples, sizes=log_sizes(samples // 2, 100)) for _ in range(6)]
        begun = time.process_time()
        for start in range(0, samples, BLOCK):
            for stream in streams:
                stream.add(block[: samples - start])
        for stream in streams:
            stream.finish()
        took = (time.process_time() - begun) / 6
        grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1e3
        print(f"six channels of {hours} h: {took:.2f} s a channel, peak memory grown by {grown:.0f} MB")
    y = np.concatenate(list(noise(SAMPLES, 0.0)))
    for number in (60, 100):
        took = cpu_s(partial(banded, [y], log_sizes(SAMPLES // 2, number)))
        print(f"band of {SAMPLES} samples, {number} sizes: {took:.2f} s a channel; budget 0.30 s")
    for cells in (21_600, 234_000):
        took = cpu_s(partial(deviation, y[:cells], 1.0, sizes=log_sizes(cells // 2, 60)))
        print(f"deviation of {cells} cells, 60 sizes: {1e3 * took:.0f} ms; budget {20 if cells < 1e5 else 200} ms")


def banded(blocks: list[np.ndarray], sizes: np.ndarray) -> Band:
    """The band of a record in blocks."""
    stream = BandStream(RATE_HZ, sum(map(len, blocks)), sizes=sizes)
    for block in blocks:
        stream.add(block)
    return stream.finish()


def band(samples: int) -> None:
    """Band with a 0.002-decade step against exact sums at some sizes."""
    blocks = list(noise(samples, 0.0))
    begun = monotonic_s()
    ours = banded(blocks, decade_sizes(samples // 2, 0.002))
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
    launch()
    overlapping()
    band(int(sys.argv[1]) if len(sys.argv) > 1 else BAND_SAMPLES)
