"""The spectrum of a record in bins: of the whole record from its cell means, and of its segments at the full rate.

Slow: the orthonormal cosine transform (DCT-II) of all cell means. Its modes of white noise, of a random walk and, its
first and last reading left free, of quantization are independent; those of a flicker nearly so (correlations of a few
per cent between the lowest). A ramp is a mean of the modes, not a power: bins keep the products that its least squares
need. Fast: tapered segments, overlapped so that every sample counts once. Cell means of a second alias the reading
noise of all frequencies into their band; the fast modes separate it from the slower processes by its f².
"""

from dataclasses import dataclass
from math import ceil, log2, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.special import chdtri

from procedures.analysis.allan.statistic import FEWEST_SAMPLES
from procedures.analysis.noise_fit import columns
from procedures.analysis.noise_fit.columns import FlickerBand
from procedures.analysis.noise_fit.lines import SpectralLine, find_lines
from procedures.analysis.noise_fit.restricted import Spectrum, maximum
from procedures.analysis.noise_fit.slow_lines import without_lines
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.noise import NoiseCoefficients

FLICKER_BAND_S = NoiseCoefficients().flicker_band_s
"""Default flicker band, that of `core.noise`."""
SINGLE_MODES = 50
"""Lowest modes of the whole record that form a bin each."""
BINS = 300
"""Bins over the others, evenly in the logarithm of frequency."""
CROSSOVER_HZ = 0.03
"""Frequency from which on the full-rate segments are used, if any."""
_MODES_AT_CROSSOVER = 4
_CUT, _ROUNDS = 1e-5, 6
"""Probability of a power that is clipped before the noise about a line is fitted, and the number of rounds."""
VARIANCES = range(4)
_EDGE = 8
"""The taper rises over this fraction, 1/8, of a segment."""
_TOGETHER = 2
"""Segments that are transformed at once."""


@dataclass(frozen=True)
class Powers:
    """A spectrum of a rate in bins; a white noise of variance s² a sample has the power s² in every mode."""

    frequency_hz: Array
    """Mean frequency of each bin, ascending, (b,)."""
    power: Array
    """Mean power of its modes [rate²], (b,)."""
    dof: Array
    """Degrees of freedom of that mean, (b,)."""
    columns: Array
    """Expected power for unit Q², N², B², K², (b, 4)."""
    products: Array
    """Sums over the bin's modes of coefficient × regressor: unit ramp, first and last reading, others, (b, r)."""
    gram: Array
    """Sums of products of those regressors, (b, r, r)."""
    period_s: float
    """Sampling period of the data behind the modes."""
    lines: tuple[SpectralLine, ...] = ()
    """Spectral lines that were cut out of the bins."""


def slow_powers(
    cells: Array, cell_s: float, *, regressors: Array | None = None, flicker_band_s: FlickerBand = FLICKER_BAND_S
) -> Powers:
    """The whole record's spectrum from its cell means, (n,) [rate], less its lines.

    `regressors` (r, n): quantities that the rate may follow (a temperature, a shift of the level), in any units.
    Raises `UnfitRecording` and `BadParameter`.
    """
    _check_rate("cell_s", cell_s)
    y = _checked(cells, 0)
    n = len(y)
    if n < FEWEST_SAMPLES:
        raise UnfitRecording(f"{n} cell means are too few for noise coefficients; the least is {FEWEST_SAMPLES}")
    if np.all(y == y[0]):
        raise UnfitRecording(f"the channel is constant ({y[0]!r}): a stuck channel has no noise to analyse")
    expected = columns.of_cells(n, cell_s, flicker_band_s)
    ends = np.zeros((2, n))
    ends[0, 0] = ends[1, -1] = 1.0
    time = (np.arange(n) - 0.5 * (n - 1)) * cell_s
    others = np.empty((0, n)) if regressors is None else regressors
    follows = np.stack([_cosines(one) for one in (time, *ends, *others)])
    rest = _less(y, np.asarray(others, dtype=np.float64))
    clean = without_lines(
        rest, cell_s, _expected_powers(_cosines(_less(rest, np.asarray(time[None], dtype=np.float64))), expected)
    )
    coefficients = _cosines(y - np.mean(y) - (rest - clean.cells))
    kept = np.flatnonzero(~clean.beside)
    bins = _Bins.over(kept + 1, SINGLE_MODES, BINS)
    pairs = follows[:, None, kept] * follows[None, :, kept]
    return Powers(
        frequency_hz=bins.mean((kept + 1) / (2.0 * n * cell_s)),
        power=bins.mean(coefficients[kept] ** 2),
        dof=bins.count,
        columns=bins.mean(expected[:, kept]).T,
        products=bins.sum(coefficients[kept] * follows[:, kept]).T,
        gram=np.ascontiguousarray(np.moveaxis(bins.sum(pairs), -1, 0)),
        period_s=cell_s,
        lines=clean.lines,
    )


def _less(y: Array, rows: Array) -> Array:
    """A series (n,) without its mean and its least-squares fit by rows (r, n)."""
    centred = np.concatenate([rows - np.mean(rows, axis=1, keepdims=True), np.ones((1, len(y)))])
    size = np.sqrt(np.sum(centred**2, axis=1, keepdims=True))
    centred /= np.where(size > 0.0, size, 1.0)
    return y - np.linalg.lstsq(centred @ centred.T, centred @ y, rcond=None)[0] @ centred


def _expected_powers(coefficients: Array, expected: Array) -> Array:
    """Expected power (n−1,) of Q, N, B and K as fitted to most of the modes; lines are clipped to the level of noise.

    `expected` (4, n−1): the powers for unit coefficients.
    """
    bins = _Bins.over(np.arange(1, expected.shape[1] + 1), SINGLE_MODES, BINS)
    none = np.zeros((len(bins.count), 1))
    squares, unit = bins.sum(coefficients**2), bins.mean(expected).T
    shown = np.asarray(chdtri(bins.count, _CUT))
    gram = none[:, :, None] + 1.0
    found = maximum(Spectrum(squares, bins.count, unit, none, gram), VARIANCES)
    for _ in range(_ROUNDS):
        most = shown * found.power
        if not np.any(squares > most):
            break
        squares = np.minimum(squares, most)
        found = maximum(Spectrum(squares, bins.count, unit, none, gram), VARIANCES)
    return found.variances @ expected


def _cosines(values: NDArray[np.floating]) -> Array:
    """Modes 1…n−1 of the orthonormal DCT-II of (n,)."""
    return np.asarray(fft.dct(values, norm="ortho"), dtype=np.float64)[1:]


class FastPowers:
    """Mean spectrum of a channel's segments at its full rate, from blocks; memory of a few segments.

    A segment is the power of two of samples that has at least four modes below `crossover_hz`. Its edges, an eighth
    each, are tapered by a quarter of a sine and shared with its neighbours; an incomplete last segment is
    not used. Samples are rates. Raises `UnfitRecording` (NaN) and `BadParameter`.
    """

    def __init__(
        self, rate_hz: float, crossover_hz: float = CROSSOVER_HZ, *, flicker_band_s: FlickerBand = FLICKER_BAND_S
    ) -> None:
        _check_rate("rate_hz", rate_hz)
        if not 0.0 < crossover_hz < 0.25 * rate_hz:
            raise BadParameter(
                "crossover_hz", crossover_hz, f"0 < crossover < {0.25 * rate_hz:g} Hz, half of Nyquist's"
            )
        self._rate_hz, self._crossover_hz, self._band_s = rate_hz, crossover_hz, flicker_band_s
        self._length = 1 << ceil(log2(_MODES_AT_CROSSOVER * rate_hz / crossover_hz))
        self._edge = self._length // _EDGE
        self._taper = columns.sine_edged_taper(self._length, self._edge)
        self._taper /= sqrt(float(np.sum(self._taper**2)))
        self._weights = self._taper / float(np.sum(self._taper))
        self._segment = np.empty(self._length)
        self._filled, self._count = 0, 0
        self._sum = np.zeros(self._length // 2 + 1)
        # Several segments are transformed at once: their rows share the processor's wide registers. The memory is kept
        # from one to the next: fresh memory would cost more time than the transform.
        self._tapered = np.empty((_TOGETHER, self._length))
        self._waiting = 0
        self.segments = 0
        """Segments taken so far; `finish` needs one."""

    def add(self, block: Array | NDArray[np.int32]) -> None:
        """Add the next samples of the channel, (n,) [rate]."""
        y = _checked(block, self._count)
        self._count += len(y)
        done = 0
        while done < len(y):
            step = min(len(y) - done, self._length - self._filled)
            self._segment[self._filled : self._filled + step] = y[done : done + step]
            self._filled += step
            done += step
            if self._filled == self._length:
                self._take()

    def _take(self) -> None:
        tapered = self._tapered[self._waiting]
        np.multiply(self._weights, self._segment, out=tapered)  # not np.dot: BLAS would start its threads
        np.subtract(self._segment, np.sum(tapered), out=tapered)
        tapered *= self._taper
        self._waiting += 1
        if self._waiting == _TOGETHER:
            self._transform()
        self.segments += 1
        self._filled = self._edge
        self._segment[: self._edge] = self._segment[-self._edge :].copy()

    def _transform(self) -> None:
        modes = np.asarray(fft.rfft(self._tapered[: self._waiting]))
        parts = modes.view(np.float64)
        squares = np.square(parts, out=parts).sum(axis=0)
        self._sum += squares[0::2] + squares[1::2]
        self._waiting = 0

    def finish(self) -> Powers:
        """Return the spectrum from the crossover up, without its lines. Call once, after the last sample. Raises
        `UnfitRecording` where no segment was whole.
        """
        if self.segments == 0:
            raise UnfitRecording(f"{self._count} samples are less than one segment of {self._length}")
        if self._waiting:
            self._transform()
        length, hop = self._length, self._length - self._edge
        power = self._sum[:-1] / self.segments
        # The squared tapers of all segments add to 1 over the record but at its ends: (∫W)²/∫W² of white noise.
        whole = self.segments * hop
        dof = 2.0 * whole**2 / (whole - 0.25 * self._edge) / length
        is_line, lines = find_lines(power, dof, length, self._rate_hz)
        mode = np.arange(len(power))
        kept = ~is_line & (mode * self._rate_hz / length >= self._crossover_hz)
        if not np.any(kept):
            raise UnfitRecording("the full-rate spectrum consists of lines alone")
        expected = columns.of_segments(length, self._edge, self._rate_hz, self._band_s)[:, :-1]
        bins = _Bins.over(mode[kept], 0, BINS)
        zeros = np.zeros((len(bins.count), 3, 3))
        return Powers(
            frequency_hz=bins.mean(mode[kept] * self._rate_hz / length),
            power=bins.mean(power[kept]),
            dof=dof * bins.count,
            columns=bins.mean(expected[:, kept]).T,
            products=zeros[:, 0],
            gram=zeros,
            period_s=1.0 / self._rate_hz,
            lines=lines,
        )


@dataclass(frozen=True)
class _Bins:
    """Consecutive modes put together: where each bin begins, and how many modes it has, (b,)."""

    starts: NDArray[np.int64]
    count: Array

    @classmethod
    def over(cls, modes: NDArray[np.int64], single: int, bins: int) -> "_Bins":
        """Bins of ascending mode numbers (m,): the first `single` alone, the rest in at most `bins` even ratios."""
        single = min(single, len(modes) - 1)
        edges = np.geomspace(modes[single], modes[-1] + 1, bins + 1)
        starts = np.concatenate([np.arange(single), np.searchsorted(modes, edges[:-1])])
        starts = np.unique(starts[starts < len(modes)]).astype(np.int64)
        return cls(starts, np.diff(np.append(starts, len(modes))).astype(np.float64))

    def sum(self, values: Array) -> Array:
        """Sums over each bin of (…, m): (…, b)."""
        return np.asarray(np.add.reduceat(values, self.starts, axis=-1))

    def mean(self, values: Array) -> Array:
        """Means over each bin of (…, m): (…, b)."""
        return self.sum(values) / self.count


def _check_rate(field: str, value: float) -> None:
    if not 0.0 < value < float("inf"):
        raise BadParameter(field, value, "finite and positive")


def _checked(values: Array | NDArray[np.int32], before: int) -> Array:
    """The values as floats, (n,). Raises `BadParameter` and `UnfitRecording`."""
    if values.ndim != 1:
        raise BadParameter("samples", values.shape, "one channel, (n,)")
    y = np.asarray(values, dtype=np.float64)
    if not np.isfinite(np.sum(y)) and not np.all(np.isfinite(y)):
        first = int(np.argmin(np.isfinite(y)))
        raise UnfitRecording(f"sample {before + first} is {y[first]}: cut the gap before noise coefficients are sought")
    return y
