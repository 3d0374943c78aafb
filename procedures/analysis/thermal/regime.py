"""Static or dynamic? The regime of the unit's temperature, sample by sample (thesis 3.18).

The thesis compares |d²T/dt²| of the case with a threshold, which its text calls one of the *rate*. The second
derivative alone marks where a ramp begins and ends: on a ramp longer than the case's time constant it dies away while
the temperature still runs. So it opens the dynamic regime, and both must be quiet before the static one returns; with
`release_rate_c_s` infinite it is thesis 3.18 to the letter.
"""

from dataclasses import dataclass
from math import exp, isfinite

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording

POLES = 3
"""Number of poles of the derivative filter, all at exp(−Δ/memory)."""


@dataclass(frozen=True)
class RegimeSettings:
    """Filter and decision settings of the regime indicator.

    The defaults suit a case with a time constant of ten to twenty minutes and a chamber's fluctuation of
    ±0.5 °C: ramps of 0.25 °C/min and more are seen, soaks are quiet (`tests/simulation/test_chamber_cycle.py`).
    """

    memory_s: float = 120.0
    """Time constant of each of the filter's three poles; the indicator's delay is three of them."""
    enter_c_s2: float = 4.0e-6
    """ΔT of thesis 3.18: |second derivative| above it is dynamic [°C/s²]."""
    release_c_s2: float = 2.5e-6
    """Hysteresis limit: |second derivative| must fall below it [°C/s²] …"""
    release_rate_c_s: float = 2.5e-3
    """… and |rate| below this [°C/s] …"""
    hold_s: float = 300.0
    """… without a break for this time [s], before the regime is static again."""

    def __post_init__(self) -> None:
        for name in ("memory_s", "enter_c_s2", "release_c_s2"):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0.0):
                raise BadParameter(name, value, "finite and above 0")
        if self.release_c_s2 > self.enter_c_s2:
            raise BadParameter("release_c_s2", self.release_c_s2, f"at most enter_c_s2 = {self.enter_c_s2:g}")
        if not self.release_rate_c_s > 0.0:
            raise BadParameter("release_rate_c_s", self.release_rate_c_s, "above 0, infinite for the thesis's own rule")
        if not (isfinite(self.hold_s) and self.hold_s >= 0.0):
            raise BadParameter("hold_s", self.hold_s, "finite and not negative")

    @property
    def delay_s(self) -> float:
        """The filter's group delay at slow changes: three time constants [s]."""
        return POLES * self.memory_s

    def onset_delay_s(self, step_c_s2: float) -> float:
        """Time from a lasting step of the second derivative to the dynamic regime [s], without noise.

        Solves ``step·(1 − e^−x·(1 + x + x²/2)) = enter`` for x = t/memory: the step response of three equal poles.
        Raises `BadParameter` where the step never passes the threshold.
        """
        share = self.enter_c_s2 / abs(step_c_s2) if step_c_s2 else np.inf
        if not share < 1.0:
            raise BadParameter("step_c_s2", step_c_s2, f"of a size above enter_c_s2 = {self.enter_c_s2:g}")
        return self.memory_s * float(brentq(lambda x: 1.0 - exp(-x) * (1.0 + x + 0.5 * x * x) - share, 0.0, 700.0))


@dataclass(frozen=True)
class RegimeSample:
    """Output of the indicator after one sample of the temperature."""

    dynamic: bool
    rate_c_s: float
    """Smoothed first derivative [°C/s]."""
    acceleration_c_s2: float
    """Smoothed second derivative [°C/s²]."""


class RegimeIndicator:
    """Regime indicator of thesis 3.18 in real time, with a fixed state of five numbers.

    The derivatives are those of the discounted least-squares parabola (fading-memory filter of second degree;
    N. Morrison, Introduction to Sequential Smoothing and Prediction, 1969, ch. 13): with θ = exp(−Δ/memory), the state
    (T, Δ·T', Δ²·T''/2) is predicted and corrected by (1 − θ³, 1.5(1 − θ)²(1 + θ), 0.5(1 − θ)³) times the innovation,
    which puts all three poles at θ. Until it has been quiet for `hold_s` for the first time the regime is dynamic: a
    unit just switched on heats itself.
    """

    def __init__(self, sample_s: float, settings: RegimeSettings | None = None) -> None:
        """Start an indicator for samples of `sample_s`, at most a third of the memory. Raises `BadParameter`."""
        self.settings = settings or RegimeSettings()
        if not 0.0 < sample_s <= self.settings.memory_s / 3.0:
            raise BadParameter(
                "sample_s", sample_s, f"above 0, at most a third of memory_s ({self.settings.memory_s:g})"
            )
        theta = exp(-sample_s / self.settings.memory_s)
        self._gains = 1.0 - theta**3, 1.5 * (1.0 - theta) ** 2 * (1.0 + theta), 0.5 * (1.0 - theta) ** 3
        self._sample_s = sample_s
        self._state: tuple[float, float, float] | None = None
        self._dynamic = True
        self._quiet_s = 0.0

    def step(self, temperature_c: float) -> RegimeSample:
        """Return the regime after one more sample [°C]. Raises `UnfitRecording` where it is not a number."""
        if not isfinite(temperature_c):
            raise UnfitRecording(f"the case temperature {temperature_c!r} is not a number: no regime can be found")
        level, slope, bend = self._state or (temperature_c, 0.0, 0.0)
        ahead = level + slope + bend
        surprise = temperature_c - ahead
        first, second, third = self._gains
        slope += 2.0 * bend + second * surprise
        bend += third * surprise
        self._state = ahead + first * surprise, slope, bend
        rate, acceleration = slope / self._sample_s, 2.0 * bend / self._sample_s**2
        self._decide(abs(rate), abs(acceleration))
        return RegimeSample(self._dynamic, rate, acceleration)

    def _decide(self, rate: float, acceleration: float) -> None:
        s = self.settings
        if acceleration > s.enter_c_s2:
            self._dynamic, self._quiet_s = True, 0.0
        elif acceleration < s.release_c_s2 and rate < s.release_rate_c_s:
            self._quiet_s += self._sample_s
            if self._quiet_s >= s.hold_s:
                self._dynamic = False
        elif self._dynamic:
            self._quiet_s = 0.0


@dataclass(frozen=True)
class RegimeTrace:
    """The indicator over a whole record, each shape (n,)."""

    dynamic: NDArray[np.bool_]
    rate_c_s: Array
    acceleration_c_s2: Array


def regimes(temperature_c: Array, sample_s: float, settings: RegimeSettings | None = None) -> RegimeTrace:
    """The regime of a record of the case temperature (n,) [°C]: the very steps of `RegimeIndicator`, one after another.

    So post-processing and the live unit agree to the last bit. Raises `BadParameter`, `UnfitRecording`. `settings`
    None: the defaults of `RegimeSettings`.
    """
    indicator = RegimeIndicator(sample_s, settings)
    samples = [indicator.step(t) for t in np.asarray(temperature_c, dtype=np.float64).tolist()]
    return RegimeTrace(
        np.array([s.dynamic for s in samples], dtype=np.bool_),
        np.array([s.rate_c_s for s in samples], dtype=np.float64),
        np.array([s.acceleration_c_s2 for s in samples], dtype=np.float64),
    )
