"""Lines in the slow part of a record: detected in the spectrum of all cell means, and removed by least squares.

A line of few cycles leaks into every mode of the whole record, so leaving modes out is not enough: the strongest one
that stands out of its neighbourhood is fitted, then the next in the residuals, and all lines are refitted each time.
The noise that the fit absorbs lies in the modes adjacent to the line, which are left out.
"""

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from procedures.analysis.noise_fit.lines import SpectralLine, levels_around, standing_out
from procedures.core.arrays import Array

LEVEL = 1e-4
"""Probability that noise alone shows one line in a record."""
MOST_LINES = 20
_FEWEST_CELLS = 64
_FIRST = 3
"""Fewest cycles in the record; anything with fewer is a drift."""
_BESIDE = 3
"""Modes (half a cycle in the record each) on each side of a line that are left out with it."""
_MANY = 100
"""Cycles from which on a mode has enough neighbours to estimate its level."""
_FINE = 65
_EFFICIENCY = 0.35
"""Efficiency of a median of neighbouring, overlapping modes, relative to a mean of independent ones."""


@dataclass(frozen=True)
class WithoutLines:
    """Cell means of a record without its spectral lines, and the lines that were removed."""

    cells: Array
    """Cell means without the lines, (n,) [rate]."""
    lines: tuple[SpectralLine, ...]
    """The lines, sorted by frequency."""
    beside: NDArray[np.bool_]
    """Modes 1…n−1 of the cosine transform that are adjacent to a line, (n−1,)."""


def without_lines(cells: Array, cell_s: float, expected: Array) -> WithoutLines:
    """Subtract spectral lines of at least three cycles from cell means (n,).

    `expected` (n−1,) is the expected noise power in modes 1…n−1 of the cosine transform. At many cycles, the level
    about a mode counts where it is higher: noise at a filter's edge is no line.
    """
    n = len(cells)
    found: list[float] = []
    rest, amplitudes = cells, np.empty(0)
    if n >= _FEWEST_CELLS:
        taper = np.hanning(n + 1)[:-1]
        while len(found) < MOST_LINES:
            cycles = _strongest(_detrended(rest), taper, expected)
            if cycles is None or any(abs(cycles - other) < 1.0 for other in found):
                break
            found.append(cycles)
            rest, amplitudes = _fitted(cells, found)
    frequency = np.array(found) / (n * cell_s)
    seen = amplitudes / np.sinc(frequency * cell_s)
    lines = sorted((SpectralLine(float(f), float(a)) for f, a in zip(frequency, seen, strict=True)), key=_frequency)
    beside = np.zeros(n - 1, dtype=bool)
    for cycles in found:
        first = max(0, round(2.0 * cycles) - _BESIDE - 1)
        beside[first : round(2.0 * cycles) + _BESIDE] = True
    return WithoutLines(rest, tuple(lines), beside)


def _frequency(line: SpectralLine) -> float:
    return line.frequency_hz


def _detrended(y: Array) -> Array:
    """The record without its mean and slope."""
    t = np.arange(len(y)) - 0.5 * (len(y) - 1)
    return y - np.mean(y) - t * (float(np.dot(t, y)) / float(np.dot(t, t)))


def _strongest(y: Array, taper: Array, expected: Array) -> float | None:
    """Cycles in the record of the most prominent mode; None where none is significant."""
    power = np.abs(np.fft.rfft(y * taper)) ** 2
    power = power[:-1]
    around, _ = levels_around(power, 2.0, _MANY)
    level = np.zeros(len(power))
    level[1:] = 0.5 * float(np.sum(taper**2)) * expected[1 : 2 * len(power) - 2 : 2]
    level[_MANY:] = np.maximum(level[_MANY:], around[_MANY:])
    limit = float(standing_out(2.0, np.array([_EFFICIENCY * _MANY]), LEVEL / len(power))[0])
    ratio = np.zeros(len(power))
    ratio[_FIRST:] = power[_FIRST:] / np.maximum(level[_FIRST:], np.finfo(float).tiny) / limit
    ratio[level <= 1e-24 * float(np.max(power))] = 0.0  # a noiseless record: rounding is no line
    first = int(np.argmax(ratio))
    if ratio[first] <= 1.0:
        return None
    fine = np.abs(_zoomed(y * taper, first - 1.0, 2.0 / (_FINE - 1), _FINE))
    at = int(np.clip(np.argmax(fine), 1, _FINE - 2))
    left, top, right = np.log(fine[at - 1 : at + 2])
    bend = left - 2.0 * top + right
    moved = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
    return float(first - 1.0 + 2.0 * (at + np.clip(moved, -1.0, 1.0)) / (_FINE - 1))


def _zoomed(y: Array, begin: float, step: float, count: int) -> NDArray[np.complex128]:
    """Transform of a record (n,) at `begin`, begin + step… cycles in the record, (count,): Bluestein's algorithm.

    With ``jk = (j² + k² − (j−k)²)/2`` it is a convolution by a chirp. `scipy.signal.zoom_fft` is the same, and imports
    all of scipy's statistics: longer than the analysis of a channel.
    """
    n, most = len(y), max(len(y), count)
    chirp = np.exp(-1j * pi * step / n * np.arange(most, dtype=np.float64) ** 2)
    length = fft.next_fast_len(n + count - 1)
    around = np.zeros(length, dtype=np.complex128)
    around[:count] = 1.0 / chirp[:count]
    around[length - n + 1 :] = 1.0 / chirp[n - 1 : 0 : -1]
    turned = y * np.exp(-2j * pi * begin / n * np.arange(n)) * chirp[:n]
    product = np.asarray(fft.fft(turned, length)) * np.asarray(fft.fft(around))
    return np.asarray(fft.ifft(product))[:count] * chirp[:count]


def _fitted(cells: Array, cycles: list[float]) -> tuple[Array, Array]:
    """Cells without the lines, and the lines' amplitudes; mean and slope are fitted too, and stay in the cells."""
    n = len(cells)
    t = (np.arange(n) - 0.5 * (n - 1)) / n
    phase = 2.0 * pi * np.outer(cycles, t)
    waves = np.concatenate([np.cos(phase), np.sin(phase), np.ones((1, n)), t[None]])
    solved = np.linalg.solve(waves @ waves.T, waves @ cells)[: 2 * len(cycles)]
    rest = cells - solved @ waves[: 2 * len(cycles)]
    return rest, np.hypot(*solved.reshape(2, -1))
