"""Sections of a bench file: the fields that every device of a kind has. A driver adds its own by a subclass.

Unknown keys are refused. Limits are those that the laboratory allows; a driver holds to the narrower of these and the
device's own.
"""

from datetime import date
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from bench_service.drivers.interface.address import AddressText

SIMULATED = "simulated"
Seconds = Annotated[float, Field(gt=0.0, le=600.0)]
NonNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class Section(BaseModel):
    """Base of all tables of a bench file: unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Certificate(Section):
    """Calibration certificate of a device or of the site."""

    number: str = Field(min_length=1)
    laboratory: str = ""
    due: date
    """Day after which the certificate has expired."""


class DeviceSection(Section):
    """Fields of every device of a bench file: its driver, and its certificate."""

    driver: str = Field(default=SIMULATED, pattern=r"^[a-z][a-z0-9_-]*$")
    """Name of the driver; "simulated": the device of the simulated bench."""
    certificate: Certificate | None = None


class Wire(Section):
    """Fields of every device on a wire, its address and its time-outs: base of the sections of real drivers."""

    address: AddressText
    answer_s: Seconds = 2.0
    """Time within which the device must answer a request; a later answer is dropped with its link."""
    connect_s: Seconds = 3.0
    """Time within which a link must be made."""
    safe_s: Seconds = 10.0
    """Time within which the device must be safe, its own motion included."""


class Axis(Section):
    """Limits of one axis of the table."""

    number: int = Field(1, ge=1, le=9)
    """Number of the axis at the table's controller."""
    minimum_deg: Finite
    maximum_deg: Finite
    rate_deg_s: Positive
    acceleration_deg_s2: Positive
    continuous: bool = False
    """True if the axis has slip rings; one without has its turns counted, lest its cables are wound up."""

    @model_validator(mode="after")
    def _has_a_range(self) -> "Axis":
        if not self.minimum_deg < self.maximum_deg:
            raise ValueError(f"minimum_deg = {self.minimum_deg:g} must be below maximum_deg = {self.maximum_deg:g}")
        return self


class Accuracy(Section):
    """Standard uncertainties of the table by its acceptance test; see `procedures.bench.description.TableAccuracy`."""

    orthogonality_sd_arcsec: NonNegative = 0.0
    pointing_sd_arcsec: NonNegative = 0.0
    """Standard deviation of the commanded angles."""
    level_sd_arcsec: NonNegative = 0.0
    encoder_sd_arcsec: Positive | None = None
    """Standard deviation of the measured angles, which analyses use where it is below `pointing_sd_arcsec`; None: not
    declared.
    """


class TurntableSection(DeviceSection):
    """Section ``[turntable]`` of a bench file: limits of the axes, accuracy, state when made safe."""

    outer: Axis | None = None
    middle: Axis | None = None
    inner: Axis | None = None
    accuracy: Accuracy = Accuracy()
    sinusoidal: bool = False
    """True if sinusoidal motion may be demanded."""
    on_safe: Literal["hold", "off"] = "hold"
    """State after the axes have come to rest: held by the servo, or with the servo off."""

    def turn_extra_s(self, factor: float) -> float:
        """Return the time that whole turns take beyond their own, for demands at a time factor [s, bench time]."""
        return 0.0


class WireTurntable(TurntableSection, Wire):
    """Base of the section of a real turntable: its axes must be declared."""

    outer: Axis  # pyright: ignore[reportGeneralTypeIssues, reportIncompatibleVariableOverride]
    middle: Axis  # pyright: ignore[reportGeneralTypeIssues, reportIncompatibleVariableOverride]
    inner: Axis  # pyright: ignore[reportGeneralTypeIssues, reportIncompatibleVariableOverride]
    safe_s: Seconds = 60.0


class ChamberBounds(Section):
    """Limits of the chamber's demands, and its ambient temperature."""

    minimum_c: Finite
    maximum_c: Finite
    ramp_c_min: Positive
    ambient_c: Finite

    @model_validator(mode="after")
    def _has_a_range(self) -> "ChamberBounds":
        if not self.minimum_c <= self.ambient_c <= self.maximum_c:
            raise ValueError(f"ambient_c = {self.ambient_c:g} must be within {self.minimum_c:g} … {self.maximum_c:g}")
        return self


class ChamberTrust(Section):
    """Accuracy of the chamber; see `procedures.bench.chamber.ChamberAccuracy`."""

    place_sd_c: NonNegative
    soak_sd_c: NonNegative = 0.0


class ChamberSection(DeviceSection):
    """Section ``[chamber]`` of a bench file: limits, accuracy, limiter, state when made safe."""

    limits: ChamberBounds | None = None
    accuracy: ChamberTrust | None = None
    """Standard uncertainties by its certificate; needed to calibrate a unit's thermometers. None: not declared."""
    limiter_c: Finite | None = None
    """Setting of the independent over-temperature limiter, for the record."""
    on_safe: Literal["ambient", "hold", "off"] = "ambient"
    """Demand on a running chamber when the bench is made safe; one that stands still gets none."""


class WireChamber(ChamberSection, Wire):
    """Base of the section of a real chamber: its limits must be declared."""

    limits: ChamberBounds  # pyright: ignore[reportGeneralTypeIssues, reportIncompatibleVariableOverride]


class SupplyBounds(Section):
    """Limits and nominal setting of the supply."""

    minimum_v: NonNegative = 0.0
    maximum_v: Positive
    maximum_a: Positive
    nominal_v: Positive
    nominal_a: Positive

    @model_validator(mode="after")
    def _holds_its_nominal(self) -> "SupplyBounds":
        if not self.minimum_v <= self.nominal_v <= self.maximum_v:
            raise ValueError(f"nominal_v = {self.nominal_v:g} must be within {self.minimum_v:g} … {self.maximum_v:g}")
        if self.nominal_a > self.maximum_a:
            raise ValueError(f"nominal_a = {self.nominal_a:g} must be at most maximum_a = {self.maximum_a:g}")
        return self


class SupplySection(DeviceSection):
    """Section ``[supply]`` of a bench file: limits, nominal setting, state when made safe."""

    limits: SupplyBounds | None = None
    on_safe: Literal["off"] = "off"


class WireSupply(SupplySection, Wire):
    """Base of the section of a real supply: its limits must be declared."""

    limits: SupplyBounds  # pyright: ignore[reportGeneralTypeIssues, reportIncompatibleVariableOverride]


class UnitLinkSection(DeviceSection):
    """Section ``[unit_link]`` of a bench file: the unit's data link, simulated or real."""


class WireUnitLink(UnitLinkSection, Wire):
    """Base of the section of a real unit's data link."""


class CurrentBounds(Section):
    """Limits of the current source, and its accuracy."""

    maximum_ma: Positive
    gain_sd_ppm: NonNegative = 0.0
    zero_sd_ma: NonNegative = 0.0


class CurrentSourceSection(DeviceSection):
    """Section ``[current_source]`` of a bench file: limits, accuracy, state when made safe."""

    limits: CurrentBounds | None = None
    on_safe: Literal["off"] = "off"


class WireCurrentSource(CurrentSourceSection, Wire):
    """Base of the section of a real current source."""

    limits: CurrentBounds  # pyright: ignore[reportGeneralTypeIssues, reportIncompatibleVariableOverride]


class OperatorSection(DeviceSection):
    """Section ``[operator]``: "simulated", or "asked" for a person who is asked by a prompt."""

    address: AddressText | None = None
    """Address of the person of served simulators (`bench simulate`), who sets the simulated unit by hand: at once with
    "simulated", after the person who is asked with "asked". None: no simulator is served, or none is set by hand.
    """


class EnvironmentSection(DeviceSection):
    """Section ``[environment]``: conditions of the room, entered (`driver = "entered"`) or read by a driver."""

    driver: str = Field(default="entered", pattern=r"^[a-z][a-z0-9_-]*$")
    temperature_c: Annotated[float, Field(ge=-40.0, le=60.0)] | None = None
    humidity_percent: Annotated[float, Field(ge=0.0, le=100.0)] | None = None
    pressure_hpa: Annotated[float, Field(ge=500.0, le=1100.0)] | None = None
