"""Whether a column of time is uniform: it grows, and each step is the median step within a tolerance."""

import numpy as np

from bench_service.formats.errors import UnreadableFile
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording


class TimeSteps:
    """The time column of one file, block by block. The median is that of the first block's steps."""

    def __init__(self, name: str, tolerance: float) -> None:
        self._name = name
        self._tolerance = tolerance
        self._median_s: float | None = None
        self._first_s = 0.0
        self._last_s = 0.0
        self._rows = 0
        self._block = np.empty(0)

    def add(self, time_s: Array) -> None:
        """The next rows. Raises `UnfitRecording` at the first step that does not fit, naming its row."""
        if not self._rows:
            self._first_s = float(time_s[0])
        with_last = time_s if not self._rows else np.concatenate([[self._last_s], time_s])
        steps = np.diff(with_last)
        row = max(self._rows, 1)  # of the sample before the first step, counted from 1
        backward = np.flatnonzero(steps <= 0.0)
        if len(backward):
            at = int(backward[0])
            raise UnfitRecording(
                f"{self._name}: the time does not grow: {with_last[at]:.9g} s in row {row + at}, "
                f"{with_last[at + 1]:.9g} s in row {row + at + 1}"
            )
        if self._median_s is None and len(steps):
            self._median_s = float(np.median(steps))
        if self._median_s is not None:
            odd = np.flatnonzero(np.abs(steps - self._median_s) > self._tolerance * self._median_s)
            if len(odd):
                at = int(odd[0])
                raise UnfitRecording(
                    f"{self._name}: a gap between rows {row + at} and {row + at + 1}: the step is {steps[at]:.6g} s "
                    f"where {self._median_s:.6g} s ± {100 * self._tolerance:g} % is expected"
                )
        self._rows += len(time_s)
        self._last_s = float(time_s[-1])
        self._block = time_s

    def agree_with(self, other: "TimeSteps") -> None:
        """The last rows of two files have the same times, within the tolerance. Raises `UnfitRecording`."""
        allowed = self._tolerance * (self._median_s or 0.0)
        apart = np.flatnonzero(np.abs(self._block - other._block) > allowed)
        if len(apart):
            at = int(apart[0])
            row = self._rows - len(self._block) + at + 1
            raise UnfitRecording(
                f"{self._name}: row {row} is of {self._block[at]:.9g} s, in {other._name} of {other._block[at]:.9g} s"
            )

    def rate_hz(self) -> float:
        """Steps over time, first to last. Raises `UnreadableFile` where there is no step."""
        if self._rows < 2:
            raise UnreadableFile(self._name, "has fewer than two rows: no rate can be found in its time column")
        return (self._rows - 1) / (self._last_s - self._first_s)
