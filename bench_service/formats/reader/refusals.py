"""Conversion of refusals that a reading process sent back into the errors that it raised."""

import logging
from typing import Any

from bench_service.formats.bounds import MEGABYTE, Bounds
from bench_service.formats.errors import UnreadableFile
from procedures.core.errors import BadParameter, UnfitRecording

logger = logging.getLogger(__name__)


class NoRoom(Exception):
    """Raised where the temporary folder is full."""


def refused(refusal: dict[str, Any], bounds: Bounds) -> Exception:
    """Return the error that a child met, rebuilt from what it sent."""
    kind = refusal["kind"]
    if kind == "unreadable":
        return UnreadableFile(refusal["name"], refusal["problem"])
    if kind == "parameter":
        return BadParameter(refusal["field"], refusal["value"], refusal["allowed"])
    if kind == "unfit":
        return UnfitRecording(refusal["message"])
    if kind == "full":
        return NoRoom(refusal["message"])
    if kind == "memory":
        return UnreadableFile(
            refusal["name"],
            f"takes more than {bounds.memory_bytes // MEGABYTE} MB of memory to read: write it in smaller pieces (row "
            "groups, batches or lines)",
        )
    logger.warning("a file could not be read: %s", refusal.get("log", ""))
    return UnreadableFile(refusal["name"], f"cannot be read ({refusal['problem']})")
