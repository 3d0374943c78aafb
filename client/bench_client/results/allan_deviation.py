"""Result of `allan_deviation`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import BandCurve, Check, Density, Statement, Verdict


class LaunchCurvesCurve(Part):
    """The deviation of one channel of one recording; all lists go with `tau_s`."""

    recording: str
    """Recording, by its id"""
    channel: str
    """Name of the channel"""
    unit: str
    """Unit of the deviation: that of the channel's nominal rate, times s for the time deviation."""
    tau_s: tuple[float, ...]
    """Averaging times [s]"""
    deviation: tuple[float, ...]
    """Deviation at each averaging time, in the channel's unit"""
    lower: tuple[float, ...]
    """Lower end of the interval"""
    upper: tuple[float, ...]
    """Upper end of the interval"""
    terms: tuple[int, ...]
    """Squared differences that were averaged."""
    edf: tuple[float, ...]
    """Equivalent degrees of freedom."""
    noise_exponent: tuple[float, ...]
    """α of the rate's spectral density f^α that the degrees of freedom were taken for."""
    density: Density | None = None
    """Power spectral density of the nominal rate; None where it was not asked for or cannot be computed."""
    band: BandCurve | None = None
    """Least, mean and greatest deviation over the starts; of sampled intervals the deviation and one sigma about
    it.
    """


class AllanDeviationDocument(Part):
    """Every curve, in the order of recordings and channels."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    statistic: str
    """Statistic: allan, overlapping_allan, modified_allan …"""
    confidence: float
    """Confidence level of the intervals"""
    curves: tuple[LaunchCurvesCurve, ...]
    """One curve a channel and recording"""


class AllanDeviationResult(ResultHead):
    """A result: Allan deviation and its relatives."""

    kind: Literal["method"]
    name: Literal["allan_deviation"]
    document: AllanDeviationDocument
