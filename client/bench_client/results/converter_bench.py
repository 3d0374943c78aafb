"""Result of `converter_bench`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, ConverterModel, Statement, Verdict


class ChannelResult(Part):
    """Result of one channel: its model, the fitted data, and how the orders were chosen."""

    name: str
    """Name of the procedure or method"""
    model: ConverterModel
    """Model of the channel of the converter"""
    target_c: tuple[float, ...]
    """Temperature of the soak by the plan [°C]"""
    sensor_c: tuple[float, ...]
    """Reading of the converter's sensor at each soak [°C]"""
    scale_code_per_ma: tuple[float, ...]
    """Scale of the channel at each soak [code/mA]"""
    zero_code: tuple[float, ...]
    """Zero of the channel at each soak"""
    zero_ma: tuple[float, ...]
    """Zero at the input of thesis 3.13 [mA]"""
    scale_bic: tuple[float, ...]
    """Information criterion of the scale's polynomial, by order"""
    zero_bic: tuple[float, ...]
    """Information criterion of the zero's polynomial, by order"""
    scale_p_values: tuple[float, ...] = ()
    """F tests of order 2 against 1, 3 against 2; empty in results of older versions, whose order had the least
    BIC.
    """
    zero_p_values: tuple[float, ...] = ()
    """F tests of the zero's polynomial: order 2 against 1, 3 against 2"""


class ConverterBenchDocument(Part):
    """Models of the three channels."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    channels: tuple[ChannelResult, ...]
    """Channels, in order"""


class ConverterBenchResult(ResultHead):
    """A result: Signal converter over temperature."""

    kind: Literal["procedure"]
    name: Literal["converter_bench"]
    document: ConverterBenchDocument
