"""True values of one simulated bench and one simulated unit, as frozen values.

Knows numbers and their allowed ranges; knows neither files nor motion.
"""

from dataclasses import dataclass, field
from math import isfinite, sqrt

import numpy as np

from procedures.bench.description import BenchDescription
from procedures.core import units
from simulators.truth.ranges import ZERO, Matrix, TruthError, Vector, check_fields, within
from simulators.truth.thermal import ChamberFault, ChamberTruth, UnitThermalTruth


@dataclass(frozen=True)
class SiteTruth:
    """True gravity and true rotation of the Earth at the bench."""

    latitude_deg: float
    gravity_m_s2: float
    earth_rate_rad_s: float = units.EARTH_RATE

    def __post_init__(self) -> None:
        ranges = {
            "latitude_deg": (-90.0, 90.0),
            "gravity_m_s2": (0.0, 20.0),
            "earth_rate_rad_s": (0.0, 1e-3),
        }
        check_fields("site_truth", self, ranges)


@dataclass(frozen=True)
class TableTruth:
    """Deviations of the table from an ideal one. All angles in arcsec; all zero is the ideal table.

    With ``R_a(φ)`` a right-hand turn about axis a, ``W`` the wobble of an axis and B the base, the attitude is
    ``rot_enu_b = B · W_o·R_y(outer) · R_x(ε_om) · W_m·R_z(middle) · R_y(ε_mi) · W_i·R_x(inner)``.
    """

    outer_middle_nonorthogonality_arcsec: float = 0.0
    """Angle ε_om: the middle axis z is turned by it about x; its angle with the outer axis is 90° + ε_om."""
    middle_inner_nonorthogonality_arcsec: float = 0.0
    """Angle ε_mi: the inner axis x is turned by it about y; its angle with the middle axis is 90° + ε_mi."""
    base_tilt_north_arcsec: float = 0.0
    """Tilt of the outer axis to the north."""
    base_tilt_east_arcsec: float = 0.0
    """Tilt of the outer axis to the east."""
    azimuth_error_arcsec: float = 0.0
    """True heading of x at zero angles minus the declared azimuth, clockwise from north."""
    pointing_sd_arcsec: float = 0.0
    """Standard deviation by which each axis stops off its encoder's reading, drawn independently at each move."""
    outer_wobble_arcsec: float = 0.0
    """The axis sways in its bearing by amplitude·sin(angle): outer about z, middle about x, inner about y."""
    middle_wobble_arcsec: float = 0.0
    inner_wobble_arcsec: float = 0.0

    def __post_init__(self) -> None:
        signed = (-36000.0, 36000.0)
        ranges = {
            "outer_middle_nonorthogonality_arcsec": signed,
            "middle_inner_nonorthogonality_arcsec": signed,
            "base_tilt_north_arcsec": signed,
            "base_tilt_east_arcsec": signed,
            "azimuth_error_arcsec": signed,
            "pointing_sd_arcsec": (0.0, 3600.0),
            "outer_wobble_arcsec": (0.0, 3600.0),
            "middle_wobble_arcsec": (0.0, 3600.0),
            "inner_wobble_arcsec": (0.0, 3600.0),
        }
        check_fields("table_truth", self, ranges)


@dataclass(frozen=True)
class OperatorTruth:
    """Accuracy and speed of the person at the bench who sets the unit by hand. Ours."""

    fixture_tilt_sd_arcsec: float = 300.0
    """Standard deviation of the unit's lean about each axis of its seat, a manual table; independent each time."""
    set_by_hand_s: float = 300.0
    """Bench time from the door's opening to its closing; the unit is set halfway."""

    def __post_init__(self) -> None:
        check_fields(
            "operator_truth", self, {"fixture_tilt_sd_arcsec": (0.0, 36000.0), "set_by_hand_s": (0.0, 86400.0)}
        )


@dataclass(frozen=True)
class CurrentSourceTruth:
    """The precision current source of the converter's bench. Ours: a calibrated laboratory source."""

    gain_error_ppm: float = 4.0
    zero_error_ma: float = 5e-5
    noise_ma: float = 2e-4
    """Standard deviation of the noise within one cycle of the converter."""

    def __post_init__(self) -> None:
        ranges = {"gain_error_ppm": (-1e5, 1e5), "zero_error_ma": (-1.0, 1.0), "noise_ma": (0.0, 1.0)}
        check_fields("current_source_truth", self, ranges)


@dataclass(frozen=True)
class BenchTruth:
    """True values of a bench's site, table, chamber and operator, and the description that its laboratory declares.

    A description without a chamber is a bench without one, whatever `chamber` says.
    """

    site: SiteTruth
    table: TableTruth
    description: BenchDescription
    chamber: ChamberTruth = field(default_factory=ChamberTruth)
    chamber_faults: tuple[ChamberFault, ...] = ()
    operator: OperatorTruth = field(default_factory=OperatorTruth)
    current_source: CurrentSourceTruth = field(default_factory=CurrentSourceTruth)

    def __post_init__(self) -> None:
        declared, true = self.description.chamber, self.chamber
        if declared is None:
            return
        where = "description.chamber"
        within(f"{where}.minimum_c", declared.minimum_c, true.least_c, true.most_c)
        within(f"{where}.maximum_c", declared.maximum_c, declared.minimum_c, true.most_c)
        within(f"{where}.ambient_c", declared.ambient_c, declared.minimum_c, declared.maximum_c)
        within(f"{where}.ramp_c_min", declared.ramp_c_min, 1e-3, true.ramp_c_min)


@dataclass(frozen=True)
class TriadTruth:
    """Three channels x, y, z of one kind. SI: *rate* is angular rate [rad/s] or specific force [m/s²].

    With ``a = K·v``: ``U_i = b_i + a_i + ½·asymmetry_i·|a_i| + nonlinearity_i·a_i²/reference`` (both relative).
    Noise after IEEE Std 952; `startup` is a bias that decays as ``amplitude·exp(−t/time)`` from power-up. `dithered` is
    the random part of a gyro's mechanical dither, or the comparator's noise of a charge-balancing converter.
    """

    bias: Vector
    """Bias b of each channel [rate]."""
    matrix: Matrix
    """Matrix K, output per input, dimensionless."""
    quantization: Vector
    """Quantization Q [rate·s]: standard deviation of a reading's whole error; the pulse follows, see `pulse`."""
    random_walk: Vector = ZERO
    """Random walk coefficient N [rate·√s]."""
    bias_instability: Vector = ZERO
    """Bias instability coefficient B [rate]."""
    rate_random_walk: Vector = ZERO
    """Rate random walk coefficient K_rrw [rate/√s]."""
    rate_ramp: Vector = ZERO
    """Rate ramp coefficient R [rate/s]."""
    startup: Vector = ZERO
    """Amplitude of the start-up transient [rate]."""
    startup_time_s: float = 200.0
    self_heating_1: Vector = ZERO
    """Self-heating as thesis 3.1.3 fits it, ``A₁·exp(−t/T₁) + A₂·exp(−t/T₂)`` from power-up: A₁ [rate]."""
    self_heating_1_time_s: float = 1200.0
    """Time constant T₁ of the first self-heating [s]."""
    self_heating_2: Vector = ZERO
    """Amplitude A₂ of the second self-heating [rate]."""
    self_heating_2_time_s: float = 5400.0
    """Time constant T₂ of the second self-heating [s]."""
    dithered: bool = True
    """True where a triangular dither of one pulse either way precedes the counter, a new one at each reading."""
    dither_residue: Vector = ZERO
    """Amplitude of the mechanical dither's residue on the integrated output, after the notch filter [rate·s]."""
    dither_frequency_hz: Vector = ZERO
    """Frequency of the mechanical dither [Hz]; above half the sample rate it appears folded."""
    scale_factor_asymmetry_ppm: Vector = ZERO
    """Difference of the scale factors for positive and negative input."""
    scale_factor_nonlinearity_ppm: Vector = ZERO
    """Relative change of the output at the reference input by the quadratic term."""
    nonlinearity_reference: float = units.STANDARD_GRAVITY
    """Reference input of the nonlinearity [rate]."""
    bias_run_to_run_sd: float = 0.0
    """Standard deviation of the bias from run to run [rate]."""
    scale_factor_run_to_run_sd_ppm: float = 0.0
    flicker_band_s: tuple[float, float] = (0.5, 1.0e5)
    """Shortest and longest relaxation time of the bias instability."""

    def __post_init__(self) -> None:
        even = ("scale_factor_asymmetry_ppm", "scale_factor_nonlinearity_ppm")
        signed = ("bias", "rate_ramp", "startup", "self_heating_1", "self_heating_2", *even)
        noise = ("quantization", "random_walk", "bias_instability", "rate_random_walk")
        positive = (*noise, "dither_residue", "dither_frequency_hz")
        for name in signed + positive:
            value = getattr(self, name)
            if len(value) != 3 or not all(isfinite(v) for v in value):
                raise TruthError(f"{name} = {value!r} must be three finite numbers")
            if name in positive and min(value) < 0.0:
                raise TruthError(f"{name} = {value!r} must not be negative")
        if min(self.quantization) <= 0.0:
            raise TruthError(f"quantization = {self.quantization!r} must be above zero: the counter has pulses")
        matrix = np.array(self.matrix, dtype=np.float64)
        if matrix.shape != (3, 3) or not np.all(np.isfinite(matrix)) or abs(np.linalg.det(matrix)) < 1e-6:
            raise TruthError(f"matrix = {self.matrix!r} must be 3×3, finite and invertible")
        low, high = self.flicker_band_s
        if not 0.0 < low < high < float("inf"):
            raise TruthError(f"flicker_band_s = {self.flicker_band_s!r} must be 0 < shortest < longest")
        limits = {
            "startup_time_s": (1e-3, 1e7),
            "self_heating_1_time_s": (1e-3, 1e7),
            "self_heating_2_time_s": (1e-3, 1e7),
            "nonlinearity_reference": (1e-12, 1e6),
            "bias_run_to_run_sd": (0.0, 1e6),
            "scale_factor_run_to_run_sd_ppm": (0.0, 1e5),
        }
        check_fields("triad", self, limits)

    @property
    def pulse(self) -> Vector:
        """Weight of one count [rate·s]: 2·Q for each channel, Q·√12 without dither.

        A reading's error has the variance pulse²/12 of the rounding and, dithered, twice that of the dither.
        """
        factor = 2.0 if self.dithered else sqrt(12.0)
        x, y, z = (q * factor for q in self.quantization)
        return x, y, z

    @property
    def transients(self) -> tuple[tuple[Vector, float], ...]:
        """List everything that decays from power-up: amplitudes [rate] and times [s] of start-up and self-heating."""
        return (
            (self.startup, self.startup_time_s),
            (self.self_heating_1, self.self_heating_1_time_s),
            (self.self_heating_2, self.self_heating_2_time_s),
        )


@dataclass(frozen=True)
class UnitTruth:
    """True values of one unit: serial, sample rate, two triads (a channel's nominal scale is its pulse) and heat.

    The triads are what they are with the whole unit at `simulators.truth.thermal.REFERENCE_C`.
    """

    serial: str
    gyro: TriadTruth
    accelerometer: TriadTruth
    sample_rate_hz: float = 400.0
    thermal: UnitThermalTruth = field(default_factory=UnitThermalTruth)

    def __post_init__(self) -> None:
        within("unit.sample_rate_hz", self.sample_rate_hz, 1.0, 4000.0)
        if not self.serial:
            raise TruthError("unit.serial must not be empty")

    def triad(self, name: str) -> TriadTruth:
        """Return a triad by name, "gyro" or "accelerometer"."""
        return {"gyro": self.gyro, "accelerometer": self.accelerometer}[name]
