"""Calibrations that the service exported as its JSON document, read back and applied."""

import json
import warnings
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.imu_model import TriadCalibration, correct
from procedures.library.arguments import Samples, vectors

FORMAT, VERSION = "bench-calibration", 1


@dataclass(frozen=True)
class ExportedCalibration:
    """Calibration of one triad of a unit, with where it comes from and whether it may be used."""

    triad: TriadCalibration
    unit: str
    id: str
    unusable: str
    """Reason why it could not be used when it was exported (rejected, expired); empty: it could."""
    document: dict[str, Any] = field(repr=False)
    """The triad's part of the file: validity, temperatures, lineage."""

    def correct(self, outputs: Samples) -> Array:
        """``v̂ = K⁻¹(U − b)`` of nominal outputs (n, 3) or (3,) in `triad.output_unit`. Raises `BadParameter`."""
        one = np.ndim(outputs) == 1
        corrected = correct(vectors("outputs", np.asarray([outputs]) if one else outputs), self.triad)
        return corrected[0] if one else corrected

    def __str__(self) -> str:
        said = f"calibration {self.id} of the {self.triad.triad} triad of unit {self.unit}"
        said += f", U in {self.triad.output_unit}, v in {self.triad.input_unit}"
        return f"{said}; NOT FOR USE: {self.unusable}" if self.unusable else said


def load_calibration(file: str, triad: str | None = None) -> ExportedCalibration:
    """Read a calibration from the service's JSON export; `triad` (gyro, accelerometer) where the file has both.

    One that could not be used when it was exported gives a warning. Raises `BadParameter` for another file or triad.
    """
    allowed = "a calibration that the service exported with format=json"
    try:
        with open(file, encoding="utf-8") as lines:
            document = json.load(lines)
        if (document["format"], document["version"]) != (FORMAT, VERSION):
            raise ValueError(f"format {document['format']!r}, version {document['version']!r}")
        parts = {part["triad"]: part for part in document["triads"]}
        found = {name: _triad(part) for name, part in parts.items()}
        facts = {name: (str(part["calibration"]), str(part["validity"]["unusable"])) for name, part in parts.items()}
        unit = str(document["unit"])
    except KeyError as error:
        raise BadParameter("file", file, f"{allowed}; this one has no field {error}") from error
    except (OSError, ValueError, TypeError) as error:
        raise BadParameter("file", file, f"{allowed}; this one cannot be read: {error}") from error
    if not found:
        raise BadParameter("file", file, f"{allowed}; this one has no triad")
    names = ", ".join(found)
    if triad is None and len(found) != 1:
        raise BadParameter("triad", None, f"one of {names}: the file has both")
    name = triad or next(iter(found))
    if name not in found:
        raise BadParameter("triad", triad, f"what the file has: {names}")
    made = ExportedCalibration(found[name], unit, *facts[name], parts[name])
    if made.unusable:
        warnings.warn(f"{made}", UserWarning, stacklevel=2)
    return made


def _triad(part: dict[str, Any]) -> TriadCalibration:
    forward = part["forward"]
    return TriadCalibration(
        part["triad"],
        part["output_unit"],
        part["input_unit"],
        tuple(forward["b"]),
        tuple(map(tuple, forward["K"])),
        tuple(map(tuple, part["covariance"]["matrix"])),
        part["model"],
    )
