"""Result of `converter_bench`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, ConverterModel, Statement, Verdict


class ChannelResult(Part):
    """Result of one channel: its model, the fitted data, and how the orders were chosen."""

    name: str
    model: ConverterModel
    target_c: tuple[float, ...]
    sensor_c: tuple[float, ...]
    scale_code_per_ma: tuple[float, ...]
    zero_code: tuple[float, ...]
    zero_ma: tuple[float, ...]
    scale_bic: tuple[float, ...]
    zero_bic: tuple[float, ...]


class ConverterBenchDocument(Part):
    """Models of the three channels."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    channels: tuple[ChannelResult, ...]


class ConverterBenchResult(ResultHead):
    """A result: Signal converter over temperature."""

    kind: Literal["procedure"]
    name: Literal["converter_bench"]
    document: ConverterBenchDocument
