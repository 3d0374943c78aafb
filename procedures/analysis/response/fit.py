"""Fit of a delay and a first-order lag to responses: gain, delay, time constant and bandwidth of a channel.

``H(ω) = G·exp(−iω(D − T))/(1 + iωT)``: D is the delay of slow motion, T the lag's time constant, D − T a pure delay.
Fitted are ln G, D and q = T², in which the gain ``ln G − ½·ln(1 + ω²q)`` and the phase ``−ωD + ωT − atan ωT`` are
smooth at T = 0, where T itself cannot be told from a delay. q may come out below zero by noise, and is left there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
from scipy.optimize import brentq, least_squares

from procedures.analysis.least_squares.chi_square import tail_probability
from procedures.analysis.response.phasors import Response, require_known
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording

PARAMETERS = 3
"""Number of fitted parameters, ln G, D and q, and least number of frequencies."""
LEVEL = 1e-3
"""Probability below which residuals are not the noise's alone."""
ONE_SIDED = 1.645
"""Factor of a limit that holds with 95 % (normal)."""
SIGNIFICANT = 3.0
"""Standard uncertainties by which q must be above zero for a time constant to be stated."""
MOST_SCATTER_S = 1.0
"""Largest standard deviation of the delay from recording to recording that is taken for scattered stamps [s]."""


@dataclass(frozen=True)
class Lag:
    """Fitted response of one channel; covariance of ln G, D [s] and q [s²], (3, 3)."""

    log_gain: float
    delay_s: float
    q_s2: float
    covariance: Array
    gain_residuals: Array
    """ln|H| less the model's, over its standard deviation, (n,)."""
    phase_residuals: Array

    @property
    def chi_square(self) -> float:
        """Sum of squares of all residuals."""
        return float(self.gain_residuals @ self.gain_residuals) + self.phase_chi_square

    @property
    def degrees_of_freedom(self) -> int:
        """Number of residuals less that of parameters."""
        return 2 * len(self.gain_residuals) - PARAMETERS

    @property
    def phase_freedom(self) -> int:
        """Phases less the delay: the lag is known from the gains."""
        return len(self.phase_residuals) - 1

    @property
    def phase_chi_square(self) -> float:
        """Sum of squares of the phases' residuals."""
        return float(self.phase_residuals @ self.phase_residuals)

    @property
    def phase_excess(self) -> float:
        """Sum of squares of the phases' residuals beyond what noise makes of them on average."""
        return self.phase_chi_square - self.phase_freedom

    @property
    def p_value(self) -> float | None:
        """Probability of residuals at least as large; None without degrees of freedom."""
        return tail_probability(self.chi_square, self.degrees_of_freedom) if self.degrees_of_freedom > 0 else None

    @property
    def q_sd_s2(self) -> float:
        """Standard uncertainty of q [s²]."""
        return sqrt(float(self.covariance[2, 2]))

    @property
    def delay_sd_s(self) -> float:
        """Standard uncertainty of D by noise, scatter and linearity [s]."""
        return sqrt(float(self.covariance[1, 1]))

    @property
    def time_constant_s(self) -> tuple[float, float] | None:
        """T and its standard uncertainty [s]; None where q is not well above zero."""
        if self.q_s2 < SIGNIFICANT * self.q_sd_s2:
            return None
        t = sqrt(self.q_s2)
        return t, self.q_sd_s2 / (2.0 * t)

    @property
    def bandwidth_hz(self) -> tuple[float, float] | None:
        """Frequency of −3 dB, ``1/(2πT)``, and its standard uncertainty [Hz]; None as for the time constant."""
        if (found := self.time_constant_s) is None:
            return None
        t, sd = found
        return 1.0 / (2.0 * pi * t), sd / (2.0 * pi * t * t)

    @property
    def bandwidth_above_hz(self) -> float:
        """Limit above which the bandwidth lies with 95 % [Hz]."""
        return 1.0 / (2.0 * pi * sqrt(max(self.q_s2, 0.0) + ONE_SIDED * self.q_sd_s2))


@dataclass(frozen=True)
class Lags:
    """Fits of all channels, and the scatter of their recordings' stamps."""

    lags: tuple[Lag, ...]
    scatter_s: float
    """Standard deviation of the delay from recording to recording beyond the noise [s]; 0: none shows."""
    p_value_without: float | None
    """Chance of the phases' residuals where the stamps keep one delay; None without degrees of freedom."""


def model(parameters: Array, omega: Array) -> tuple[Array, Array]:
    """Return ln|H| and the phase [rad] at some angular frequencies, (n,) each; `parameters`: ln G, D, q."""
    log_gain, delay_s, q = parameters
    time_constant = np.sqrt(max(q, 0.0))
    gain = log_gain - 0.5 * np.log(np.maximum(1.0 + omega**2 * q, 1e-9))
    return gain, -omega * delay_s + omega * time_constant - np.arctan(omega * time_constant)


def fit_lags(channels: Mapping[str, Sequence[Response]], linearity: float) -> Lags:
    """Fit the responses at three or more frequencies of each channel, by its name; the fits are in their order.

    `linearity`: relative standard deviation of the gain from frequency to frequency by the gyro's scale factor, whose
    rates differ. Where the phases are not the noise's alone, the delay is taken to differ from recording to recording,
    with the standard deviation that makes the phases' residuals as large as their degrees of freedom (Paule-Mandel).
    Gains that misfit say nothing of the delay: `gain_p_value` judges them.
    Raises `UnfitRecording` where a channel does not follow, or its delay differs by more than `MOST_SCATTER_S`.
    """
    for r in (r for responses in channels.values() for r in responses):
        require_known(r.label, max(r.gain_sd, r.phase_sd))

    def fitted(scatter_s: float) -> tuple[Lag, ...]:
        return tuple(_fit(responses, linearity, scatter_s) for responses in channels.values())

    def excess(scatter_s: float) -> float:
        return sum(lag.phase_excess for lag in fitted(scatter_s))

    alone = fitted(0.0)
    degrees = sum(lag.phase_freedom for lag in alone)
    p = tail_probability(sum(lag.phase_chi_square for lag in alone), degrees) if degrees > 0 else None
    if p is None or p >= LEVEL:
        return Lags(alone, 0.0, p)
    most = fitted(MOST_SCATTER_S)
    if sum(lag.phase_excess for lag in most) > 0.0:
        worst, _ = max(zip(channels, most, strict=True), key=lambda pair: pair[1].phase_excess)
        raise UnfitRecording(
            f"{worst}: the delay differs from recording to recording by more than {MOST_SCATTER_S:g} s: the stamps of "
            "the unit's samples or the table's readings are wrong"
        )
    scatter = float(brentq(excess, 0.0, MOST_SCATTER_S, xtol=1e-10, rtol=1e-6))
    return Lags(fitted(scatter), scatter, p)


def gain_p_value(lag: Lag) -> float | None:
    """Return the p-value of the gains' residuals alone, whose model has two parameters; None without degrees of
    freedom.
    """
    degrees = len(lag.gain_residuals) - 2
    return tail_probability(float(lag.gain_residuals @ lag.gain_residuals), degrees) if degrees > 0 else None


def _fit(responses: Sequence[Response], linearity: float, scatter_s: float) -> Lag:
    ordered = sorted(responses, key=lambda r: r.frequency_hz)
    omega = np.array([r.omega for r in ordered])
    values = np.array([r.value for r in ordered])
    own = np.array([(r.gain_sd, r.phase_sd) for r in ordered])
    if not values[0].real > 0.0:
        raise UnfitRecording(
            f"station {ordered[0].label}: the channel answers with the opposite sign, or later than a quarter of a "
            "cycle: see polarity_check, or take lower frequencies"
        )
    phase = unwrapped(np.angle(values), omega)
    gain_sd, phase_sd = np.hypot(own[:, 0], linearity), np.hypot(own[:, 1], omega * scatter_s)
    log_gain = np.log(np.abs(values))
    unit = np.array([1.0, 1.0 / omega[-1], 1.0 / omega[-1] ** 2])

    def residuals(scaled: Array) -> Array:
        gain, turned = model(scaled * unit, omega)
        return np.concatenate([(log_gain - gain) / gain_sd, (phase - turned) / phase_sd])

    begin = np.array([log_gain[0], -phase[-1], max(0.0, 2.0 * (log_gain[0] - log_gain[-1]))])
    found = least_squares(residuals, begin, method="lm", xtol=1e-14, ftol=1e-14, gtol=1e-14)
    jacobian = np.asarray(found.jac)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * np.outer(unit, unit)
    log_g, delay, q = (found.x * unit).tolist()
    left = np.asarray(found.fun)
    return Lag(log_g, delay, q, covariance, left[: len(omega)], left[len(omega) :])


def unwrapped(phase: Array, omega: Array) -> Array:
    """Phases without jumps: each within half a turn of what the delay at the one before lets expect.

    `omega` must rise; the first phase is taken as it is: a delay below half the longest period.
    """
    found = [float(phase[0])]
    for k in range(1, len(phase)):
        expected = found[-1] * omega[k] / omega[k - 1]
        found.append(expected + float(np.angle(np.exp(1j * (phase[k] - expected)))))
    return np.array(found)
