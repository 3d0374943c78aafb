"""Result of `table_program`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class ChannelMean(Part):
    """Mean output of one channel over one dwell, in its `unit` (an increment as a rate)."""

    channel: str
    unit: str
    mean: float
    standard_uncertainty: float | None
    from_noise: bool


class DwellRecord(Part):
    """Results of one dwell: position, duration, completeness of its recording, and the channel means."""

    station: int
    label: str
    outer_deg: float
    middle_deg: float
    inner_deg: float
    start_s: float
    samples_planned: int
    samples_recorded: int
    means: tuple[ChannelMean, ...]


class TableProgramDocument(Part):
    """Program as it was read, and the means of every dwell's recording."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    program: str
    dwells: tuple[DwellRecord, ...]


class TableProgramResult(ResultHead):
    """A result: Program of table positions."""

    kind: Literal["procedure"]
    name: Literal["table_program"]
    document: TableProgramDocument
