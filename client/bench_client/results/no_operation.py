"""Result of `no_operation`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict


class NoOperationDocument(Part):
    """Result without any measurement."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""


class NoOperationResult(ResultHead):
    """A result: No operation."""

    kind: Literal["procedure"]
    name: Literal["no_operation"]
    document: NoOperationDocument
