"""True values of the chamber, of the unit's heat and thermometers, and of the temperature's effect on the unit.

Knows numbers and their allowed ranges. Thesis 4.2.1 gives the chamber's make, its ±1 °C over the place and ±0.5 °C in
time; everything else of chamber and heat is ours, after a 1 m³ chamber and a unit of some 12 kg. Temperatures in °C.
"""

from dataclasses import dataclass, field, fields, replace
from math import isfinite

from simulators.truth.chance import keyed_generator
from simulators.truth.ranges import ZERO, TruthError, Vector, check_fields, within

REFERENCE_C = 20.0
"""Node temperature at which every effect of temperature is zero: the thesis's normal conditions (3.2.2) [°C]."""
NODES = ("air", "walls", "case", "converter", "accelerometer_block", "gyro_x", "gyro_y", "gyro_z")
THERMOMETERS = ("case", "converter", "gyro_x", "gyro_y", "gyro_z")


@dataclass(frozen=True)
class ChamberTruth:
    """True values of the chamber: its heat, its controller, its flaws."""

    ambient_c: float = 22.0
    air_j_k: float = 8.0e3
    """Heat capacity of the air with fan, coil and shelf [J/K]."""
    walls_j_k: float = 6.0e4
    air_to_walls_w_k: float = 60.0
    walls_to_ambient_w_k: float = 5.0
    heating_w: float = 4000.0
    cooling_w: float = 4000.0
    """Largest power that the plant can heat and cool with [W]; with too little, a set point is never reached."""
    proportional_w_k: float = 400.0
    integral_s: float = 300.0
    least_c: float = -60.0
    most_c: float = 100.0
    """Lowest and highest set point [°C]."""
    ramp_c_min: float = 5.0
    """Fastest ramp of the set point, up and down."""
    limiter_low_c: float = -70.0
    limiter_high_c: float = 110.0
    """Limits of the over-temperature limiter's own thermostat, which cuts the plant off for good beyond them."""
    fluctuation_c: float = 0.5
    """Amplitude within which the air at the unit's place wanders (thesis: WEISS 1000)."""
    fluctuation_s: float = 60.0
    """Correlation time of the air's wandering."""
    place_offset_c: float = 0.6
    """Air at the unit's place less that at the controller's sensor; within ±1 °C (thesis: WEISS 1000)."""
    door_open_w_k: float = 150.0
    """Conductance from the air to the room through the open door."""
    control_sensor_noise_c: float = 0.01

    def __post_init__(self) -> None:
        positive = (1e-3, 1e9)
        ranges = {
            **dict.fromkeys(("ambient_c", "least_c", "most_c", "limiter_low_c", "limiter_high_c"), (-273.0, 500.0)),
            **dict.fromkeys(("air_j_k", "walls_j_k", "air_to_walls_w_k", "walls_to_ambient_w_k"), positive),
            **dict.fromkeys(("proportional_w_k", "integral_s", "fluctuation_s", "ramp_c_min"), positive),
            **dict.fromkeys(("heating_w", "cooling_w", "door_open_w_k"), (0.0, 1e6)),
            "fluctuation_c": (0.0, 20.0),
            "place_offset_c": (-20.0, 20.0),
            "control_sensor_noise_c": (0.0, 10.0),
        }
        check_fields("chamber", self, ranges)
        if not self.limiter_low_c <= self.least_c < self.most_c <= self.limiter_high_c:
            raise TruthError("chamber: limiter_low_c <= least_c < most_c <= limiter_high_c must hold")


CHAMBER_FAULTS = ("heater_stuck", "control_sensor_stuck", "cooling_lost", "heating_lost", "link_lost")


@dataclass(frozen=True)
class ChamberFault:
    """A fault of the chamber that begins at a moment of bench time and stays."""

    name: str
    from_s: float

    def __post_init__(self) -> None:
        if self.name not in CHAMBER_FAULTS:
            raise TruthError(f"chamber fault {self.name!r} is not known; known are {', '.join(CHAMBER_FAULTS)}")
        within(f"chamber fault {self.name}: from_s", self.from_s, 0.0, 1e9)


@dataclass(frozen=True)
class NetworkTruth:
    """The unit as lumps of heat: the case in the air, everything else on the case. All ours."""

    case_j_k: float = 5.0e3
    converter_j_k: float = 150.0
    accelerometer_block_j_k: float = 800.0
    gyro_j_k: float = 1500.0
    """Heat capacity of each of the three gyro blocks [J/K]."""
    air_to_case_w_k: float = 8.0
    case_to_converter_w_k: float = 0.25
    """With its capacity a lag of 600 s behind the case: the thermometers of thesis fig. 3.15."""
    case_to_accelerometer_block_w_k: float = 1.0
    case_to_gyro_w_k: float = 1.2
    case_w: float = 12.0
    converter_w: float = 1.0
    accelerometer_block_w: float = 1.5
    gyro_w: float = 4.0
    """Power turned to heat while the unit is on [W]: together the case is warmed by 3.3 K."""

    def __post_init__(self) -> None:
        names = [f.name for f in fields(self)]
        check_fields("network", self, {n: (0.0, 1e4) for n in names if n.endswith("_w")})
        check_fields("network", self, {n: (1e-6, 1e9) for n in names if n.endswith("_k")})

    @property
    def power_w(self) -> float:
        """Power that the whole unit takes, all of which becomes heat [W]."""
        return self.case_w + self.converter_w + self.accelerometer_block_w + 3.0 * self.gyro_w


@dataclass(frozen=True)
class ThermometerTruth:
    """A temperature sensor of the unit: ``code = round((T_lagged + offset + slope·(T_lagged − 20) + noise)/step)``.

    Ours: a 12-bit sensor.
    """

    offset_c: float = 0.0
    slope: float = 0.0
    """Change of the offset by temperature [°C/°C], about `REFERENCE_C`; zero in the units that ship."""
    lag_s: float = 5.0
    noise_c: float = 0.03
    """Standard deviation of the noise of one reading."""
    step_c: float = 0.0625
    stuck_from_s: float = float("inf")
    """Bench time from which the sensor sends its last code for ever."""
    disconnected_from_s: float = float("inf")
    """Bench time from which the sensor sends `DISCONNECTED_CODE`."""

    def __post_init__(self) -> None:
        check_fields("thermometer", self, {"offset_c": (-50.0, 50.0), "lag_s": (0.0, 3600.0), "noise_c": (0.0, 10.0)})
        within("thermometer.slope", self.slope, -0.4, 0.4)
        within("thermometer.step_c", self.step_c, 1e-6, 10.0)
        never = float("inf")
        check_fields("thermometer", self, {"stuck_from_s": (0.0, never), "disconnected_from_s": (0.0, never)})


@dataclass(frozen=True)
class AccelerometerThermalTruth:
    """Effect of temperature on one accelerometer channel, as departures from `REFERENCE_C` of two nodes.

    A force-rebalance pendulum answers with the current that its torquer needs: force over torquer constant. So
    ``V = f/(1 + A) − B`` with A the relative change of the torquer's constant and B the balancing rest force, each
    ``s1·t + s2·t² + d1·c + d2·c²``: static terms by the structure at t, dynamic ones by the converter's board at c.
    Both act always; in a soak the nodes go together, on a ramp they part.
    """

    scale_static: tuple[float, float] = (0.0, 0.0)
    """A's s1 [1/°C] and s2 [1/°C²]."""
    scale_dynamic: tuple[float, float] = (0.0, 0.0)
    """A's d1 [1/°C] and d2 [1/°C²]."""
    bias_static: tuple[float, float] = (0.0, 0.0)
    """B's s1 [m/s²/°C] and s2 [m/s²/°C²]."""
    bias_dynamic: tuple[float, float] = (0.0, 0.0)
    """B's d1 [m/s²/°C] and d2 [m/s²/°C²]."""
    block_share: float = 0.0
    """Share of the accelerometer block, which has no sensor, in t; the rest is the case's, which has one."""

    def __post_init__(self) -> None:
        within("accelerometer_thermal.block_share", self.block_share, 0.0, 1.0)
        for name in ("scale_static", "scale_dynamic", "bias_static", "bias_dynamic"):
            if len(getattr(self, name)) != 2 or not all(isfinite(v) for v in getattr(self, name)):
                raise TruthError(f"accelerometer_thermal.{name} must be two finite numbers")


@dataclass(frozen=True)
class ConverterTruth:
    """One channel of the signal converter: ``code = K0·Fc(c)·I + N0 + Fs(c)`` a cycle (thesis 3.8–3.13), c as above."""

    codes_a_ma: float = 2184.0
    """Codes per current K0 [1/mA]: 16 bits over ±15 mA."""
    zero_code: float = 12.0
    scale_drift: tuple[float, float] = (1.5e-5, 2.0e-8)
    """Drift of the scale, Fc − 1: [1/°C] and [1/°C²]. Ours: a voltage reference of 15 ppm/°C."""
    zero_drift: tuple[float, float] = (0.02, 1.0e-4)
    """Fs [codes/°C] and [codes/°C²]. Ours."""


@dataclass(frozen=True)
class GyroThermalTruth:
    """A ring laser under perimeter control: nothing of temperature is left, unless the control is at fault."""

    fault_residue_rad_s_c: Vector = ZERO
    """Rate that a failing control lets through for each °C of the gyro's departure from the reference."""


# Table 4.4 prints codes of sensors whose scale it does not. Ours: 16 codes a °C for β (a 12-bit sensor). Then x reads
# 1.0e-3 m/s²/°C, which is what Table 4.5's "before" asks for (0.0975/3 at −40 °C from the reference, 0.1241/3 at +40).
# For y and z the two tables contradict each other by factors of 8, so the static β are solved from Table 4.5:
# |s1·Δ + s2·Δ²| = before/3 at Δ = ∓40 °C, less the dynamic part: Table 4.4, 16 codes a °C. For α, K0 is not
# printed either. Ours: the dynamic α a °C as if one code were one °C (α3 is the linear one: the table swaps it with
# α4), −60 ppm/°C being a magnet's; the static ones at 2500 times their print, to be seen at all.
_BEFORE = ((0.0975, 0.1241), (0.0968, 0.1830), (0.0715, 0.1212))
_BETA_DYNAMIC = ((-7.208e-5, 3.484e-10), (-1.3906e-4, -3.3388e-8), (1.1243e-5, 2.3189e-8))
_ALPHA_STATIC = ((4.153e-6, 3.3265e-9), (-5.010e-5, 8.053e-9), (-5.6175e-6, 8.2675e-9))
_ALPHA_DYNAMIC = ((-6.0141e-5, 1.6292e-8), (-5.3030e-5, 1.6158e-8), (-5.6567e-5, 1.6626e-8))
SPAN_C = 40.0
"""Spans from the reference to −20 and to +60 °C."""


def default_accelerometers() -> tuple[AccelerometerThermalTruth, AccelerometerThermalTruth, AccelerometerThermalTruth]:
    """Build the default channels; see the comment above for what is the thesis's and what ours."""
    found: list[AccelerometerThermalTruth] = []
    for (cold, hot), dynamic, still, moving in zip(_BEFORE, _BETA_DYNAMIC, _ALPHA_STATIC, _ALPHA_DYNAMIC, strict=True):
        linear = (hot + cold) / 3.0 / (2.0 * SPAN_C) - dynamic[0]
        square = (hot - cold) / 3.0 / (2.0 * SPAN_C**2) - dynamic[1]
        found.append(AccelerometerThermalTruth(still, moving, (linear, square), dynamic))
    return found[0], found[1], found[2]


@dataclass(frozen=True)
class UnitThermalTruth:
    """True values of temperature and its effects for one unit."""

    network: NetworkTruth = field(default_factory=NetworkTruth)
    accelerometers: tuple[AccelerometerThermalTruth, AccelerometerThermalTruth, AccelerometerThermalTruth] = field(
        default_factory=default_accelerometers
    )
    converter: tuple[ConverterTruth, ConverterTruth, ConverterTruth] = (
        ConverterTruth(),
        ConverterTruth(zero_code=-7.0, scale_drift=(-1.1e-5, 3.0e-8), zero_drift=(-0.035, 5.0e-5)),
        ConverterTruth(zero_code=3.0, scale_drift=(0.8e-5, -2.5e-8), zero_drift=(0.012, -2.0e-4)),
    )
    gyro: GyroThermalTruth = field(default_factory=GyroThermalTruth)
    thermometers: tuple[ThermometerTruth, ...] = (
        ThermometerTruth(offset_c=0.4),
        ThermometerTruth(offset_c=-0.3),
        ThermometerTruth(offset_c=0.2),
        ThermometerTruth(offset_c=-0.5),
        ThermometerTruth(offset_c=0.1),
    )
    """Sensors in the order of `THERMOMETERS`."""

    def __post_init__(self) -> None:
        if len(self.thermometers) != len(THERMOMETERS):
            raise TruthError(f"thermometers: one for each of {', '.join(THERMOMETERS)} is needed")


def random_thermal_truth(seed: int) -> UnitThermalTruth:
    """Draw another unit of the default's kind.

    Each coefficient times a normal number of mean 1 and spread 0.3, each β with a spread of 1e-4 m/s²/°C besides;
    thermometers' offsets of 0.5 °C, the network within ±20 %, lags within ±1 %: an unknown lag of one second would move
    the linear coefficients by several of their uncertainties.
    """
    rng, base = keyed_generator(seed, "thermal truth"), UnitThermalTruth()

    def near(pair: tuple[float, float], extra: float = 0.0) -> tuple[float, float]:
        first, second = (float(v * f) for v, f in zip(pair, 1.0 + 0.3 * rng.standard_normal(2), strict=True))
        return first + extra * float(rng.standard_normal()), second

    def about(value: float) -> float:
        return value * float(rng.uniform(0.8, 1.2))

    x, y, z = (
        AccelerometerThermalTruth(
            near(a.scale_static), near(a.scale_dynamic), near(a.bias_static, 1e-4), near(a.bias_dynamic, 1e-4)
        )
        for a in base.accelerometers
    )
    return replace(
        base,
        network=NetworkTruth(**{f.name: about(getattr(base.network, f.name)) for f in fields(NetworkTruth)}),
        accelerometers=(x, y, z),
        thermometers=tuple(
            replace(t, offset_c=0.5 * float(rng.standard_normal()), lag_s=t.lag_s * float(rng.uniform(0.99, 1.01)))
            for t in base.thermometers
        ),
    )
