"""Record of a unit before a job: its channels, its noise, its stability from launch to launch."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from procedures.core.arrays import Array
from procedures.core.converter import ConverterTriad
from procedures.core.errors import BadParameter, NoCalibration
from procedures.core.imu_model import TriadCalibration
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import TRIADS, Channel
from procedures.core.temperature.gyros import GyroThermalCorrection
from procedures.core.temperature.thermometers import ThermometerCorrection
from procedures.core.thermal_correction import ThermalCorrection
from procedures.core.unit_correction import CorrectionKind

SERIAL = r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$"
"""Pattern of a serial that is safe in an address and in a file name."""
CORRECTION_IDS: dict[CorrectionKind, str] = {
    "thermal": "thermal_correction_id",
    "converter": "converter_id",
    "thermometers": "thermometers_id",
    "gyros": "gyro_correction_id",
}
"""Kind of a correction -> the field of `Unit`, and of its stored form, with the id of the one in use."""


@dataclass(frozen=True)
class TriadRecord:
    """Record of one triad: noise of its channels x, y, z, and its stability from one power-up to the next."""

    noise: tuple[NoiseCoefficients, NoiseCoefficients, NoiseCoefficients]
    bias_run_to_run_sd: float = 0.0
    """Standard deviation of the bias from run to run [rad/s] or [m/s²]."""
    scale_factor_run_to_run_sd: float = 0.0
    """Standard deviation of the scale factor from run to run, relative."""
    noise_origin: str = "data sheet"
    """Origin of the coefficients: a data sheet, or the result that found them."""
    not_observed: tuple[tuple[str, ...], ...] = ((), (), ())
    """Processes of x, y, z that no launch showed: their coefficients come from upper limits, and are no finding."""
    dither_frequency_hz: tuple[float, float, float] | None = None
    """Frequencies of the mechanical dithers of x, y, z, by the data sheet; 0: no dither. None: not declared."""

    def __post_init__(self) -> None:
        for name, value in zip("xyz", self.dither_frequency_hz or (), strict=False):
            if not 0.0 <= value <= 1e5:
                raise BadParameter(f"dither_frequency_hz.{name}", value, "within 0 … 100 000 Hz")

    @property
    def observed_noise(self) -> tuple[NoiseCoefficients, ...]:
        """The noise that was declared or found, x, y, z: zero for what no launch showed."""
        return tuple(
            replace(noise, **dict.fromkeys(absent, 0.0))
            for noise, absent in zip(self.noise, self.not_observed, strict=True)
        )

    def launch_covariance(self, outputs: Array) -> Array:
        """Return the covariance by which outputs K·v (n, 3) of one launch depart from the unit's mean, per channel, (3,
        n, n).

        ``σ_b² + σ_s²·a_i·a_j``: the bias is common to all of them, and a scale factor carries its whole row of K.
        """
        relative = self.scale_factor_run_to_run_sd**2 * np.einsum("ic,jc->cij", outputs, outputs)
        return self.bias_run_to_run_sd**2 + relative


@dataclass(frozen=True)
class CoefficientsAt:
    """Coefficients of a triad by a certificate: ``U = bias + matrix·v`` in the rate unit of its channels."""

    state: str
    """"as found" or "as left"."""
    day: str
    """Day of the calibration, ISO 8601."""
    certificate: str
    triad: str
    bias: tuple[float, float, float]
    matrix: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class UnitDeclaration:
    """Declaration of a real unit by its laboratory: for people and for lineage, not used by analyses."""

    model: str = ""
    part: str = ""
    firmware: str = ""
    lags_s: dict[str, float] = field(default_factory=dict[str, float])
    """Delay of each channel's samples against their stamps, by the data sheet."""
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])
    """Smallest and largest value of a channel, in its unit."""
    coefficients: tuple[CoefficientsAt, ...] = ()
    """Coefficients as found and as left at former calibrations."""


@dataclass(frozen=True)
class Withheld:
    """A calibration or correction that would be in use, but was rejected or has expired."""

    subject: str
    """Triad of a calibration ("gyro"), or kind of a correction ("gyros"): no triad has the name of a kind."""
    id: str
    why: str
    """Sentence that says why it is not used, and what to do."""


@dataclass(frozen=True)
class Unit:
    """The device under test. `gyro` or `accelerometer` is None where nothing is known of its noise."""

    serial: str
    sample_rate_hz: float
    channels: tuple[Channel, ...]
    gyro: TriadRecord | None = None
    accelerometer: TriadRecord | None = None
    averaging_time_s: float = 70.0
    """Averaging time at which quantization falls below the rest of the noise (thesis 4.1.3: 70 s)."""
    calibrations: tuple[TriadCalibration, ...] = field(default=(), repr=False)
    """The current calibrations, at most one a triad; empty before the first."""
    calibration_ids: tuple[str, ...] = ()
    """Ids of the stored calibrations in use, in the order of `calibrations`."""
    withheld: tuple[Withheld, ...] = field(default=(), repr=False)
    """Current calibrations and corrections that may not be used."""
    thermal_correction: ThermalCorrection | None = field(default=None, repr=False)
    """The current correction of the kind "thermal", or None."""
    thermal_correction_id: str | None = None
    converter: ConverterTriad | None = field(default=None, repr=False)
    """Current models of the signal converter, x, y, z, or None."""
    converter_id: str | None = None
    thermometers: ThermometerCorrection | None = field(default=None, repr=False)
    """Current correction of the temperature sensors, or None: they are taken as they read."""
    thermometers_id: str | None = None
    gyro_correction: GyroThermalCorrection | None = field(default=None, repr=False)
    """Current correction of the gyros for temperature, or None."""
    gyro_correction_id: str | None = None
    declaration: UnitDeclaration | None = field(default=None, repr=False)
    """Declaration from the unit's own file; None for a simulated unit."""

    def calibration(self, triad: str) -> TriadCalibration | None:
        """Return the current calibration of a triad, or None. Raises `NoCalibration` for one that is rejected or
        expired.
        """
        for withheld in self.withheld:
            if withheld.subject == triad:
                raise NoCalibration(f"unit {self.serial}: {withheld.why}")
        return next((c for c in self.calibrations if c.triad == triad), None)

    def calibration_id(self, triad: str) -> str | None:
        """Return the id of the stored calibration in use of a triad, or None."""
        ids = {c.triad: known for c, known in zip(self.calibrations, self.calibration_ids, strict=False)}
        return ids.get(triad)

    def calibration_in_words(self, *triads: str) -> str:
        """Return the calibrations of triads as a result's basis names them: "calibration 1 (gyro), 2
        (accelerometer)".
        """
        named = [f"{known} ({triad})" for triad in triads if (known := self.calibration_id(triad)) is not None]
        return f"calibration {', '.join(named) or 'of the unit'}"

    def correction_ids(self, kinds: Iterable[CorrectionKind]) -> tuple[str, ...]:
        """Return the ids of the current corrections of some kinds, in their order, without those that the unit does not
        have.
        """
        known = (getattr(self, CORRECTION_IDS[kind]) for kind in kinds)
        return tuple(correction for correction in known if correction is not None)

    def why_withheld(self, kind: CorrectionKind) -> str:
        """Return the reason why the current correction of a kind may not be used; empty where it may, or there is
        none.
        """
        return next((w.why for w in self.withheld if w.subject == kind), "")

    def triad(self, triad: str) -> TriadRecord | None:
        """Return the record of a triad by name; None where nothing is known of its noise."""
        return {"gyro": self.gyro, "accelerometer": self.accelerometer}[triad]

    def channel_noise(self, channel: Channel) -> NoiseCoefficients | None:
        """Return the noise of a triad's channel; None where it is not known, as for a channel in counts: the record is
        in SI.
        """
        for triad, names in TRIADS.items():
            record = self.triad(triad)
            if channel.name in names and record is not None and channel.rate_unit != "count":
                return record.noise[names.index(channel.name)]
        return None

    def known_matrix(self, triad: str) -> Array | None:
        """Return K (3, 3) of the current calibration; None without one that may be used, and for one in counts."""
        calibration = next((c for c in self.calibrations if c.triad == triad), None)
        return None if calibration is None or calibration.output_unit == "count" else calibration.matrix_array

    def required_calibration(self, triad: str, purpose: str) -> TriadCalibration:
        """Return the current calibration of a triad for a purpose ("verify"). Raises `NoCalibration` with the
        remedy.
        """
        calibration = self.calibration(triad)
        if calibration is None:
            raise NoCalibration(
                f"unit {self.serial} has no calibration of its {triad} triad to {purpose}: calibrate it first, "
                "choose one of its history or enter known coefficients; one that failed counts only where it is chosen"
            )
        return calibration
