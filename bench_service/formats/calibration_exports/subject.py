"""Subject of an export: one or two triads of a unit with their covariance, their noise and their origin."""

from dataclasses import dataclass, field
from typing import Any

from procedures.core.errors import BadParameter
from procedures.core.imu_model import TriadCalibration
from procedures.core.noise import NoiseCoefficients

SI_UNITS = {"gyro": "rad/s", "accelerometer": "m/s^2"}


@dataclass(frozen=True)
class TriadExport:
    """Calibration of one triad with the facts that travel with it, times as ISO 8601 text."""

    id: str
    value: TriadCalibration
    method: str
    origin: str
    """Source of entered coefficients; empty where a result is the origin."""
    verdict: str | None
    made_at: str
    simulated: bool
    current: bool
    approval: str
    unusable: str
    """Reason why it may not be used now; empty where it may."""
    valid_from: str | None
    valid_until: str | None
    temperature_c: tuple[float, float] | None = None
    """Lowest and highest chamber temperature of its stations [°C]; None: no station set one."""
    lineage: dict[str, Any] | None = None
    """Result, recordings with their hashes, parameters and code; None for entered coefficients."""
    mounting: dict[str, Any] | None = None
    """Mounting on which its job rested: id, plate, azimuth with its uncertainty; None: none was entered."""

    @property
    def triad(self) -> str:
        """Triad by its name, either "gyro" or "accelerometer"."""
        return self.value.triad


@dataclass(frozen=True)
class CalibrationSubject:
    """One or two triads of a unit, gyros first, with the declared noise of the unit."""

    unit: str
    rate_hz: float
    triads: tuple[TriadExport, ...]
    asked: str
    """Id of the calibration that was asked for; another one was added to it."""
    exported_at: str
    noise: dict[str, tuple[NoiseCoefficients, ...]] = field(default_factory=dict[str, tuple[NoiseCoefficients, ...]])
    """Triad -> noise of its channels x, y, z in SI."""
    noise_origin: dict[str, str] = field(default_factory=dict[str, str])

    def triad(self, name: str) -> TriadExport | None:
        """Return the calibration of a triad by its name; None where the subject has none."""
        return next((t for t in self.triads if t.triad == name), None)

    def required(self, name: str, form: str) -> TriadExport:
        """Return the calibration of a triad that a form needs. Raises `BadParameter` with the way out where there is
        none.
        """
        found = self.triad(name)
        if found is None:
            allowed = f"a form that takes one triad: {form} needs the {name} triad too, give its calibration as `other`"
            raise BadParameter("format", form, allowed)
        return found

    def required_si(self, name: str, form: str) -> TriadExport:
        """Return the calibration of a triad whose outputs are in SI units. Raises `BadParameter` for one of counts, or
        none.
        """
        found = self.required(name, form)
        if found.value.output_unit != SI_UNITS[name]:
            allowed = (
                f"json, c, python, matlab or imucal: calibration {found.id} is of outputs in "
                f"{found.value.output_unit}, and {form} takes outputs in {SI_UNITS[name]}"
            )
            raise BadParameter("format", form, allowed)
        return found

    def require_noise(self, form: str) -> None:
        """Check that the noise of both triads is known. Raises `BadParameter` with the way out."""
        for name in SI_UNITS:
            if name not in self.noise:
                raise BadParameter(
                    "format",
                    form,
                    f"a unit with known noise: nothing is known of the {name}s' noise; declare it with "
                    f"PUT /api/v1/units/{self.unit}",
                )

    def remarks(self) -> tuple[str, ...]:
        """Return the sentences that begin a file as its comments: origin, validity, and what else must be known."""
        lines = [f"calibration of unit {self.unit}, exported at {self.exported_at}"]
        for t in self.triads:
            source = f"origin {t.origin}" if t.origin else f"verdict {t.verdict}"
            lines.append(f"{t.triad}: calibration {t.id}, made at {t.made_at} by {t.method}, {source}, {t.approval}")
            if t.id != self.asked:
                lines.append(
                    f"calibration {t.id} was added to the one that was asked for: both triads belong in this file"
                )
            if t.valid_from or t.valid_until:
                lines.append(f"{t.triad}: valid from {t.valid_from or 'the start'} until {t.valid_until or 'no end'}")
            if t.temperature_c is not None:
                lines.append(f"{t.triad}: measured at {t.temperature_c[0]:g} to {t.temperature_c[1]:g} degC")
            if t.simulated:
                lines.append(f"{t.triad}: SIMULATED, from a simulated bench and no real unit")
            if t.unusable:
                lines.append(f"{t.triad}: NOT FOR USE: {t.unusable}")
        return tuple(line.replace("\n", " ").replace("\r", " ") for line in lines)


def commented(subject: CalibrationSubject, mark: str, *more: str) -> list[str]:
    """Return lines of comment for a file: the subject's remarks and those of the form, each begun by `mark`."""
    return [f"{mark} {line}".rstrip() for line in (*subject.remarks(), *more)]
