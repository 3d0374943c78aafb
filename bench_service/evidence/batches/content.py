"""The content of an analysis: a digest of everything that a method reads, by which its result is found again.

It holds the method and its version, the parameters, the content hashes of the recordings in order, the calibrations,
and the unit's record as it is (a method may correct by the unit's current calibration, or weigh by its noise). So a
result is taken again only where a new run could give no other one. The release of the service is not part of it: a
method that computes differently has another version.
"""

import dataclasses
import hashlib
import json
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any

import numpy as np

from bench_service.model.calibrations import StoredCalibration
from procedures.core.recording import RecordingInfo
from procedures.core.unit import Unit


def content_of(
    method: str,
    version: str,
    parameters: dict[str, Any],
    recordings: Sequence[RecordingInfo],
    calibrations: Sequence[StoredCalibration],
    unit: Unit | None,
) -> str:
    """Return the digest (SHA-256, hexadecimal) of all that an analysis reads. `parameters`: as JSON, with their
    defaults. `unit` None: the method uses no unit's record.
    """
    read = [
        ["method", method, version],
        ["parameters", parameters],
        [
            "recordings",
            [[r.content_hash, r.station, r.start_s, r.launched_s, r.measured, *_named(r)] for r in recordings],
        ],
        ["calibrations", [[c.id, c.value] for c in calibrations]],
        ["unit", unit],
    ]
    return hashlib.sha256(json.dumps(_plain(read), sort_keys=True).encode()).hexdigest()


def _named(recording: RecordingInfo) -> list[str]:
    """The name that stands in the result's texts, where the recording has one."""
    return [recording.name] if recording.name else []


def _plain(value: Any) -> Any:
    """Convert a value to JSON, floats by their exact spelling. Raises `TypeError` for a type without a known form."""
    if value is None or isinstance(value, (bool, int, str)):
        return value.value if isinstance(value, Enum) else value
    if isinstance(value, float):
        return value.hex()
    if isinstance(value, Enum):
        return _plain(value.value)
    if isinstance(value, (np.ndarray, np.generic)):
        return _plain(value.tolist())
    if dataclasses.is_dataclass(value):
        return {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(_plain(key)): _plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    if isinstance(value, (set, frozenset)):
        return sorted(json.dumps(_plain(each), sort_keys=True) for each in value)
    raise TypeError(f"{type(value).__name__} has no form in the content of an analysis: {value!r}")
