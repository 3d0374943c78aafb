"""Wavelet split of a record at rest into its slow part and the noise of short times."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from procedures.analysis.wavelet_split import Level, most_levels, wavelet_split
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.library.arguments import Samples, positive, series
from procedures.library.figure import axes


@dataclass(frozen=True)
class Split:
    """``kept + removed`` is the record, to rounding; both (n,) in its unit."""

    rate_hz: float
    kept: Array
    removed: Array
    levels: tuple[Level, ...]
    """The thresholds of the levels, the finest first."""

    def plot(self, ax: Any = None) -> Any:
        """Draw the record and the part that is kept; returns the axes."""
        ax = axes(ax)
        time_s = np.arange(len(self.kept)) / self.rate_hz
        ax.plot(time_s, self.kept + self.removed, alpha=0.4, label="record")
        ax.plot(time_s, self.kept, label="kept")
        ax.set_xlabel("time, s")
        ax.legend()
        return ax


def split(y: Samples, rate_hz: float, *, levels: int | None = None, wavelet: str = "sym8") -> Split:
    """Split a record by soft thresholds of its wavelet details, rescaled level by level (thesis 3.1.2).

    Parameters
    ----------
    y : (n,) samples in any unit. rate_hz : [Hz]. levels : None takes six, or as many as the record has.
    wavelet : an orthogonal wavelet of PyWavelets.

    Raises `BadParameter`, `UnfitRecording`.
    """
    samples, rate = series("y", y), positive("rate_hz", rate_hz)
    try:
        most = most_levels(len(samples), wavelet)
    except ValueError as error:
        raise BadParameter("wavelet", wavelet, f"an orthogonal wavelet of PyWavelets: {error}") from error
    if most < 1:
        raise BadParameter("y", f"{len(samples)} samples", "more samples: a level of this wavelet needs them")
    found = wavelet_split(
        samples, 1.0 / rate, rule="rescaled", wavelet=wavelet, levels=min(6, most) if levels is None else levels
    )
    return Split(rate, found.kept, found.removed, found.levels)
