"""Small files of the kinds that people have, and what the product says of them."""

import io
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pytest

from bench_service.formats.description import ImportDescription
from bench_service.formats.import_file import ImportedRecording, ImportFile, read_import
from procedures.core.errors import DomainError

Numbers = np.ndarray[Any, np.dtype[Any]]


def chance(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(seed))


def triad(kind: str, columns: Sequence[str | int], unit: str, **more: Any) -> list[dict[str, Any]]:
    quantity = {"gyro": "angular_rate", "accelerometer": "specific_force"}[kind]
    return [
        {"name": f"{kind}_{axis}", "column": column, "quantity": quantity, "unit": unit, **more}
        for axis, column in zip("xyz", columns, strict=True)
    ]


def table(names: Sequence[str], rows: Iterable[Sequence[object]], delimiter: str = ",", end: str = "\n") -> str:
    return end.join(delimiter.join(str(cell) for cell in row) for row in [names, *rows]) + end


def read(data: str | bytes, **description: Any) -> ImportedRecording:
    given = {"unit": "CASE-1", **description}
    content = data if isinstance(data, bytes) else data.encode()
    return read_import([ImportFile("x.csv", io.BytesIO(content))], ImportDescription.model_validate(given))


def samples(recording: ImportedRecording) -> Numbers:
    found = np.concatenate(list(recording.blocks()))
    assert len(found) == recording.count
    return found


def refusal(data: str | bytes, **description: Any) -> str:
    with pytest.raises(DomainError) as refused:
        read(data, **description)
    assert len(str(refused.value)) < 2000
    return str(refused.value)


def warnings(recording: ImportedRecording) -> str:
    return " | ".join(recording.source["warnings"])


def timed(stamps: Sequence[object] | Numbers, seed: int = 1, **description: Any) -> tuple[str, dict[str, Any]]:
    """A table of one gyro with the given stamps, and its description."""
    values = chance(seed).normal(0.0, 0.01, len(stamps)).round(6)
    text = table(["t", "gx"], zip(stamps, values, strict=True))
    gyro = {"name": "gyro_x", "column": "gx", "quantity": "angular_rate", "unit": "rad/s"}
    return text, {"time_column": "t", "channels": [gyro], **description}
