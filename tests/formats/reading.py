"""A known motion, written in a format by others, proposed and read by ours: what every format's test compares."""

import io
from typing import Any

import numpy as np

from bench_service.formats.description import ImportDescription
from bench_service.formats.import_file import ImportedRecording, read_import
from bench_service.formats.import_request import ImportFile
from bench_service.formats.proposal.model import Proposal
from bench_service.formats.proposal.propose import propose
from procedures.core.recording import ACCELEROMETER, GYRO

ROWS = 600
RATE_HZ = 200.0
_T = np.arange(ROWS) / RATE_HZ
RATES = np.column_stack([0.1 + 0.01 * np.sin(7 * _T), -0.2 + 0.01 * np.cos(5 * _T), 0.3 + 1e-3 * _T])
"""Rates about x, y, z [rad/s], (n, 3): no axis can pass for another, no sign for the other."""
FORCES = np.column_stack([0.5 + 0.01 * np.cos(3 * _T), -1.5 + 0.01 * np.sin(2 * _T), 9.7 + 1e-3 * _T])
"""Specific force along x, y, z [m/s²], (n, 3); its size is near gravity."""
START_NS = 1_700_000_000_123_456_789
TIMES_NS = START_NS + np.arange(ROWS, dtype=np.int64) * 5_000_000


def proposed(data: bytes, name: str = "log", **known: Any) -> Proposal:
    """Propose a description of a file's bytes."""
    file = ImportFile(name, io.BytesIO(data))
    return propose(file, known.get("unit", "SN-1"), known.get("format"), known.get("table"))


def read(data: bytes, description: dict[str, Any], name: str = "log") -> tuple[ImportedRecording, np.ndarray[Any, Any]]:
    """Read a file's bytes by a description; returns the recording and its values in SI units, (n, channels)."""
    recording = read_import([ImportFile(name, io.BytesIO(data))], ImportDescription.model_validate(description))
    raw = np.concatenate(list(recording.blocks()))
    values = np.column_stack([c.value(raw[:, i].astype(float)) for i, c in enumerate(recording.channels)])
    return recording, values


def require_motion(
    data: bytes, tolerance: float, name: str = "log", increments: bool = False, **known: Any
) -> tuple[Proposal, ImportedRecording]:
    """Check that the proposal of a file reads to the known motion: axes in order, SI units, rate from its own stamps.

    `tolerance`: of a value, absolute, that the format's own resolution allows.
    """
    proposal = proposed(data, name, **known)
    recording, values = read(data, proposal.description, name)
    assert [c.name for c in recording.channels][:6] == [*GYRO, *ACCELEROMETER]
    assert recording.count == ROWS
    np.testing.assert_allclose(recording.rate_hz, RATE_HZ, rtol=1e-9)
    size = 1.0 / RATE_HZ if increments else 1.0
    np.testing.assert_allclose(values[:, :3], RATES * size, atol=tolerance, rtol=0)
    np.testing.assert_allclose(values[:, 3:6], FORCES * size, atol=tolerance, rtol=0)
    return proposal, recording
