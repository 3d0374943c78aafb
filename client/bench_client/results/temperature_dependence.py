"""Result of `temperature_dependence`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict
from bench_client.results.shared_by_two import GyroThermalCorrection


class SoakFit(Part):
    """Fit of a channel within one soak of one recording."""

    recording: int
    """Index of the recording, from 0"""
    temperature_c: float
    """Mean of the sensor [°C]"""
    from_below: bool | None
    """True if the soak before was colder, False if it was warmer; None for a recording's first."""
    level: float
    """Mean less that of the recording's reference soak, brought to no other temperature."""
    level_sd: float
    """Standard uncertainty of the level"""
    slope: float | None
    """Slope by temperature within the soak; None where the temperature stood still."""
    slope_sd: float | None
    """Standard uncertainty of the slope"""
    preferred_order: int | None
    """Order of 1 … 5 that the criterion prefers within the soak; None where the temperature stood still."""


class Repeatability(Part):
    """Levels of one soak over several recordings, or over several visits in one."""

    temperature_c: float
    """Temperature [°C]"""
    count: int
    """Number of soaks near this temperature"""
    spread: float
    """Sample standard deviation, n − 1."""
    expected: float
    """Spread that the levels' own uncertainties give."""
    p_value: float
    """Chance of as much spread from these alone."""
    up_less_down: float | None
    """Mean level reached from below less that reached from above; None where one way is missing."""
    up_less_down_sd: float | None
    """Standard uncertainty of the difference"""


class ChannelFound(Part):
    """Dependence of one channel. Coefficients in the channel's rate unit a °C^k."""

    channel: str
    """Name of the channel"""
    rate_unit: str
    """Unit of the channel as a rate"""
    sensor: str
    """Temperature channel that was used"""
    p_value: float
    """Chance of as much dependence from the channel's own noise, all recordings together."""
    order: int
    """Order of the polynomial"""
    preferred_order: int
    """Order that the information criterion prefers"""
    reason: str
    """Reason, as a sentence"""
    bic: tuple[float, ...]
    """Bayesian information criterion by order; the least is best"""
    f_tests: tuple[float, ...]
    """p-value of F tests of each order against the next lower one"""
    coefficients: tuple[float, ...]
    """Coefficients of the polynomial, from the first power on"""
    covariance: tuple[tuple[float, ...], ...]
    """Covariance matrix of the coefficients, in their order"""
    before_sd: float
    """Spread of the cells about each recording's mean, before correction."""
    after_sd: float
    """Spread of the cells about each recording's mean, after correction."""
    p_unseen: float | None
    """p-value of "no dependence is left" in each recording after a fit to the others; None with a single
    recording.
    """
    soaks: tuple[SoakFit, ...]
    """Soaks, in order"""
    repeatability: tuple[Repeatability, ...]
    """Spread of the levels of soaks at the same temperature"""


class TemperatureDependenceDocument(Part):
    """Dependence of each channel, and a correction of the gyros where they have sensors."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    channels: tuple[ChannelFound, ...]
    """Channels, in order"""
    reference_c: float
    """Temperature at which the correction does nothing [°C]"""
    range_c: tuple[float, ...]
    """Range of the temperature [°C]"""
    thermometers: str
    """Id of the calibration of thermometers that was used; empty: readings as they are."""
    gyro_correction: GyroThermalCorrection | None
    """Polynomials that correct the gyros; null: none was needed"""
    trace_c: tuple[tuple[float, ...], ...]
    """Temperature of each recording in cells, by the first channel's sensor [°C]"""
    recordings: tuple[str, ...] = ()
    """Title of each recording; empty in results from before titles were stored."""


class TemperatureDependenceResult(ResultHead):
    """A result: Dependence of recordings on temperature."""

    kind: Literal["method"]
    name: Literal["temperature_dependence"]
    document: TemperatureDependenceDocument
