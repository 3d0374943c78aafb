"""Result of `temperature_dependence`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict
from bench_client.results.shared_by_two import GyroThermalCorrection


class SoakFit(Part):
    """Fit of a channel within one soak of one recording."""

    recording: int
    temperature_c: float
    from_below: bool | None
    level: float
    level_sd: float
    slope: float | None
    slope_sd: float | None
    preferred_order: int | None


class Repeatability(Part):
    """Levels of one soak over several recordings, or over several visits in one."""

    temperature_c: float
    count: int
    spread: float
    expected: float
    p_value: float
    up_less_down: float | None
    up_less_down_sd: float | None


class ChannelFound(Part):
    """Dependence of one channel. Coefficients in the channel's rate unit a °C^k."""

    channel: str
    rate_unit: str
    sensor: str
    p_value: float
    order: int
    preferred_order: int
    reason: str
    bic: tuple[float, ...]
    f_tests: tuple[float, ...]
    coefficients: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    before_sd: float
    after_sd: float
    p_unseen: float | None
    soaks: tuple[SoakFit, ...]
    repeatability: tuple[Repeatability, ...]


class TemperatureDependenceDocument(Part):
    """Dependence of each channel, and a correction of the gyros where they have sensors."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    channels: tuple[ChannelFound, ...]
    reference_c: float
    range_c: tuple[float, ...]
    thermometers: str
    gyro_correction: GyroThermalCorrection | None
    trace_c: tuple[tuple[float, ...], ...]


class TemperatureDependenceResult(ResultHead):
    """A result: Dependence of recordings on temperature."""

    kind: Literal["method"]
    name: Literal["temperature_dependence"]
    document: TemperatureDependenceDocument
