"""The facts that an export of this service carries in itself, and the description of an import that follows."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any

from bench_service.formats.samples_out.sheet import CALIBRATION, CORRECTION, TEMPERATURE

MARKS = ("recording", "unit", "rate_hz", "simulated", "content_hash_of_whole_recording")
"""Facts by which an export of this service is recognised."""
KEPT = ("recording", "unit", "simulated", "origin", "content_hash_of_whole_recording", "first_sample",
        "samples_of_whole_recording", "values", "decimated_by", "began_utc")  # fmt: skip
"""Facts that stay with what is imported."""
UNREAL = ("mixed", "simulated", "synthetic")
"""Origins that an import keeps: a file cannot prove that its samples are real."""


@dataclass(frozen=True)
class OwnExport:
    """Statements of an exported file of this service about itself."""

    facts: Mapping[str, str]
    channels: tuple[dict[str, Any], ...] = ()
    """Channels of the import that brings the samples back; empty: the format has no place for them."""

    @property
    def simulated(self) -> bool:
        """True where the recording was simulated."""
        return self.facts.get("simulated") == "true"

    @property
    def origin(self) -> str | None:
        """Origin of the recording where it was not wholly real; None: it was, or is not known."""
        said = self.facts.get("origin")
        return said if said in UNREAL else "simulated" if self.simulated else None

    @property
    def decimated_by(self) -> int:
        """Samples of the recording in each row."""
        said = self.facts.get("decimated_by", "1")
        return int(said) if said.isdecimal() else 1

    @property
    def corrected_by(self) -> dict[str, str]:
        """Triad -> id of the calibration by which its samples are corrected."""
        return {k.removeprefix(CALIBRATION): v for k, v in self.facts.items() if k.startswith(CALIBRATION)}

    @property
    def kept(self) -> dict[str, str]:
        """Facts that stay with what is imported, with the corrections and their formulas."""
        more = [k for k in self.facts if k.startswith((CALIBRATION, CORRECTION, TEMPERATURE))]
        return {k: self.facts[k] for k in (*KEPT, *more) if k in self.facts}

    def description(self) -> dict[str, Any]:
        """Return the import description, as JSON, that brings the samples back. Raises `ValueError` for facts that are
        no numbers.
        """
        rate_hz, start_s = float(self.facts["rate_hz"]), float(self.facts.get("start_s", "0"))
        if not (isfinite(rate_hz) and rate_hz > 0.0 and isfinite(start_s)):
            raise ValueError("rate_hz and start_s are no finite numbers")
        found: dict[str, Any] = {
            "unit": self.facts["unit"],
            "channels": [dict(channel) for channel in self.channels],
            "rate_hz": rate_hz,
            "start_s": start_s + (self.decimated_by - 1) / (2.0 * rate_hz * self.decimated_by),
            "simulated": self.simulated,
        }
        return found

    def cautions(self) -> list[str]:
        """Return sentences on why what comes of the file is no raw output of a real unit as it was recorded."""
        found = [
            f"the {triad}s are corrected by calibration {known}: what comes of them is no output of the unit as it is, "
            "and a calibration of it would correct twice"
            for triad, known in self.corrected_by.items()
        ]
        found += [
            f"corrected for temperature by {known} ({name.removeprefix(TEMPERATURE)}): "
            "what comes of it is no output of the unit as it is"
            for name, known in self.facts.items()
            if name.startswith(TEMPERATURE)
        ]
        if self.decimated_by > 1:
            found.append(f"each row is the mean of {self.decimated_by} samples: its noise is not that of the unit")
        if self.origin == "mixed":
            found.append("it was recorded on a bench with real and simulated devices")
        return found

    def notes(self, rows: int) -> list[str]:
        """Return sentences on how much of the recording a file of so many rows has, and as which values."""
        known = self.facts["recording"]
        physical = self.facts.get("values") == "physical"
        parts = self._parts(rows)
        if not parts and not physical:
            return [f"an export of our recording {known}: its description is as it was"]
        found = [f"an export of our recording {known}{' in SI units, not as it is stored' if physical else ''}"]
        return [*found, *(["it is a part of the recording: " + "; ".join(parts)] if parts else [])]

    def _parts(self, rows: int) -> list[str]:
        """Say what of the recording is not in the file."""
        whole = [name for name in self.facts.get("channels_of_whole_recording", "").split(",") if name]
        have = {channel["name"] for channel in self.channels}
        missing = [name for name in whole if name not in have]
        found = [f"without the channels {', '.join(missing[:12])}"] if missing else []
        said = self.facts.get("samples_of_whole_recording", "")
        samples = int(said) if said.isdecimal() else None
        first = self.facts.get("first_sample", "0")
        if samples is not None and (first != "0" or rows != samples // self.decimated_by):
            found.append(f"{rows} rows of its {samples} samples, from sample {first} on")
        return found
