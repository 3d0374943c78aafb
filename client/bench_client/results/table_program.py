"""Result of `table_program`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class ChannelMean(Part):
    """Mean output of one channel over one dwell, in its `unit` (an increment as a rate)."""

    channel: str
    """Name of the channel"""
    unit: str
    """Unit of measurement"""
    mean: float
    """Mean value"""
    standard_uncertainty: float | None
    """Standard uncertainty; None where neither noise nor scatter is known: fewer samples than batches."""
    from_noise: bool
    """True if it comes from the unit's noise; else from the scatter of batch means, blind to noise slower than
    them.
    """


class DwellRecord(Part):
    """Results of one dwell: position, duration, completeness of its recording, and the channel means."""

    station: int
    """Station, from 0"""
    label: str
    """Name for people"""
    outer_deg: float
    """Angle of the outer axis [deg]"""
    middle_deg: float
    """Angle of the middle axis [deg]"""
    inner_deg: float
    """Angle of the inner axis [deg]"""
    start_s: float
    """Beginning, on the bench's clock [s]"""
    samples_planned: int
    """Number of samples that the program asks for"""
    samples_recorded: int
    """Number of samples that were recorded"""
    means: tuple[ChannelMean, ...]
    """Mean of each channel"""


class TableProgramDocument(Part):
    """Program as it was read, and the means of every dwell's recording."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    program: str
    """Text of the program, in the controller's language"""
    dwells: tuple[DwellRecord, ...]
    """Dwells, in order"""


class TableProgramResult(ResultHead):
    """A result: Program of table positions."""

    kind: Literal["procedure"]
    name: Literal["table_program"]
    document: TableProgramDocument
