"""Declaration of a bench by its laboratory: site, axis limits, and accuracy of the table."""

from dataclasses import dataclass
from typing import Literal

from procedures.bench.chamber import ChamberAccuracy, ChamberLimits
from procedures.bench.current_source import CurrentSourceLimits
from procedures.bench.declared_device import DeclaredDevice
from procedures.bench.supply import SupplyLimits
from procedures.core.constant_rate import ConstantRate
from procedures.core.recording import Station
from procedures.core.sinusoid import PEAK_ACCELERATION, Sinusoid
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles
from procedures.core.temperature_profile import TemperatureProfile
from procedures.core.turn import AxisName, Turn

NO_SOURCES = ("site", "environment", "operator")
"""Sections of a bench file that make no data: whether they are simulated does not matter."""


@dataclass(frozen=True)
class AxisLimits:
    """Range, rate and acceleration of one table axis."""

    minimum_deg: float
    maximum_deg: float
    rate_deg_s: float
    acceleration_deg_s2: float
    continuous: bool = False
    """True if slip rings allow endless turning; then the range limits position demands alone."""


@dataclass(frozen=True)
class TableAccuracy:
    """Standard uncertainties of the table, from its acceptance test. All zero: the table is taken as ideal.

    `orthogonality` holds for each of the two right angles (outer to middle, middle to inner), constant over a
    job; `pointing` for each axis, independently at each station; `level` for the tilt of the outer axis about each
    horizontal direction. The unit's seat is not among them: a unit's axes *are* those of its mounting plate.
    """

    orthogonality_sd_arcsec: float = 0.0
    pointing_sd_arcsec: float = 0.0
    level_sd_arcsec: float = 0.0
    measured: bool = False
    """True if analyses use the angles that the encoders measured, and `pointing` is theirs; False: the commanded."""


@dataclass(frozen=True)
class BenchDescription:
    """A bench as its laboratory declares it: site, limits of its devices, accuracy of its table, and its devices with
    certificates.
    """

    id: str
    site: Site
    outer: AxisLimits
    middle: AxisLimits
    inner: AxisLimits
    accuracy: TableAccuracy
    simulated: bool
    title: str = ""
    chamber: ChamberLimits | None = None
    """Limits of the thermal chamber; None: the bench has none."""
    current_source: CurrentSourceLimits | None = None
    """Limits of the precision current source; None: the bench has none."""
    supply: SupplyLimits | None = None
    """Limits of the unit's supply; None: its voltage cannot be set, the supply only switches."""
    sinusoidal: bool = False
    """True where the table can follow a sinusoid (`Turntable.command_sinusoid`)."""
    turn_extra_s: float = 0.0
    """Time that whole turns take beyond `Turn.duration_s`, for the table's demands over a wire [s, bench time]."""
    no_turns: str = ""
    """The reason why no job with whole turns can run here; empty: one can, within the limits."""
    devices: tuple[DeclaredDevice, ...] = ()
    """Devices of a bench that has a bench file, with their identities and certificates; empty: all are simulated."""
    expired_certificates: Literal["refuse", "warn"] = "refuse"
    """Policy for an expired certificate. refuse: no job is planned; warn: previews and results carry a warning."""
    no_thermal_jobs: str = ""
    """The reason why no job that reads temperatures can run here; empty: one can, where there is a chamber."""
    chamber_accuracy: ChamberAccuracy | None = None
    """Accuracy of the chamber by its certificate; None: not declared, so that it cannot calibrate thermometers."""

    @property
    def origin(self) -> Literal["real", "mixed", "simulated"]:
        """Origin of data: of real devices alone, of simulated ones alone, or of both."""
        kinds = {device.simulated for device in self.devices if device.name not in NO_SOURCES} or {self.simulated}
        return "mixed" if len(kinds) > 1 else "simulated" if kinds == {True} else "real"

    def overdue(self, today: str) -> tuple[str, ...]:
        """Return a sentence for each certificate that has expired on a day (ISO 8601)."""
        return tuple(
            f"the certificate {c.number} of the {d.name} has expired: it was valid until {c.due}"
            for d in self.devices
            if (c := d.certificate) is not None and c.overdue(today)
        )

    def due_between(self, today: str, last: str) -> tuple[str, ...]:
        """Return a sentence for each certificate whose last day is one of `today` … `last` (ISO 8601)."""
        return tuple(
            f"the certificate {c.number} of the {d.name} expires soon: it is valid until {c.due}"
            for d in self.devices
            if (c := d.certificate) is not None and today <= c.due <= last
        )

    @property
    def axis_motion(self) -> tuple[tuple[float, float], ...]:
        """(rate_deg_s, acceleration_deg_s2) of outer, middle and inner axis."""
        return tuple((axis.rate_deg_s, axis.acceleration_deg_s2) for axis in (self.outer, self.middle, self.inner))

    def axis(self, name: AxisName) -> AxisLimits:
        """Return the limits of an axis by its name."""
        return {"outer": self.outer, "middle": self.middle, "inner": self.inner}[name]

    def violations(
        self, angles: TableAngles, turn: Turn | None = None, profile: TemperatureProfile | None = None
    ) -> tuple[str, ...]:
        """Return violations of the limits by angles, by whole turns that begin at them, or by a profile; a sentence
        each. A motion or a profile that is None is not examined.
        """
        demands = (
            ("outer", self.outer, angles.outer_deg),
            ("middle", self.middle, angles.middle_deg),
            ("inner", self.inner, angles.inner_deg),
        )
        beyond = tuple(
            f"{name}_deg = {value:g} is outside {limits.minimum_deg:g} … {limits.maximum_deg:g}"
            for name, limits, value in demands
            if not limits.minimum_deg <= value <= limits.maximum_deg
        )
        if turn is not None:
            beyond += self._turn_violations(angles, turn)
        return beyond if profile is None else beyond + self._profile_violations(profile)

    def motion_violations(self, station: Station) -> tuple[str, ...]:
        """Return violations of the limits by what a station demands of table and chamber, a sentence each; none where
        it names no angles.
        """
        if station.angles is None:
            return ()
        if station.sinusoid is not None:
            return self.sinusoid_violations(station.angles, station.sinusoid)
        return self.violations(station.angles, station.turn, station.profile)

    def current_violations(self, current_ma: float, profile: TemperatureProfile | None) -> tuple[str, ...]:
        """Return violations of the limits by a test of a converter alone, a sentence each: the current on its inputs,
        and the profile that it soaks by, where there is one.
        """
        found: tuple[str, ...] = () if profile is None else self._profile_violations(profile)
        if self.current_source is None:
            return (*found, f"bench {self.id} has no precision current source")
        most = self.current_source.maximum_ma
        return found if abs(current_ma) <= most else (*found, f"{current_ma:g} mA is outside {-most:g} … {most:g} mA")

    def sinusoid_violations(self, angles: TableAngles, sinusoid: Sinusoid) -> tuple[str, ...]:
        """Return violations of the limits by a sinusoid about angles, a sentence each."""
        if not self.sinusoidal:
            return (f"the table of bench {self.id} does not follow sinusoids",)
        limits, axis = self.axis(sinusoid.axis), sinusoid.axis
        middle = {"outer": angles.outer_deg, "middle": angles.middle_deg, "inner": angles.inner_deg}[axis]
        low, high = middle - sinusoid.amplitude_deg, middle + sinusoid.amplitude_deg
        rate, acceleration = sinusoid.rate_deg_s, PEAK_ACCELERATION * sinusoid.acceleration_deg_s2
        found = list(self.violations(angles))
        if not limits.continuous and not limits.minimum_deg <= low <= high <= limits.maximum_deg:
            found.append(
                f"{axis} axis from {low:g} to {high:g} deg leaves {limits.minimum_deg:g} … {limits.maximum_deg:g}"
            )
        if rate > limits.rate_deg_s:
            found.append(f"{axis} rate of {rate:g} deg/s is above {limits.rate_deg_s:g}")
        if acceleration > limits.acceleration_deg_s2:
            found.append(f"{axis} acceleration of {acceleration:g} deg/s^2 is above {limits.acceleration_deg_s2:g}")
        return tuple(found)

    def rate_violations(self, angles: TableAngles, rate: ConstantRate) -> tuple[str, ...]:
        """Return violations of the limits by a constant rate that begins at angles, a sentence each."""
        limits, axis = self.axis(rate.axis), rate.axis
        begin = {"outer": angles.outer_deg, "middle": angles.middle_deg, "inner": angles.inner_deg}[axis]
        end = begin + rate.angle_deg
        found: list[str] = []
        if abs(rate.rate_deg_s) > limits.rate_deg_s:
            found.append(f"{axis} rate of {rate.rate_deg_s:g} deg/s is above {limits.rate_deg_s:g}")
        if rate.acceleration_deg_s2 > limits.acceleration_deg_s2:
            found.append(
                f"{axis} ramps of {rate.acceleration_deg_s2:g} deg/s^2 are above {limits.acceleration_deg_s2:g}"
            )
        if not limits.continuous and not limits.minimum_deg <= end <= limits.maximum_deg:
            found.append(
                f"{rate.duration_s:g} s at {rate.rate_deg_s:g} deg/s lead the {axis} axis from {begin:g} to {end:g} "
                f"deg, outside {limits.minimum_deg:g} … {limits.maximum_deg:g}: it has no slip rings"
            )
        return tuple(found)

    def _profile_violations(self, profile: TemperatureProfile) -> tuple[str, ...]:
        if self.chamber is None:
            return (f"bench {self.id} has no thermal chamber",)
        return profile.violations(self.chamber.minimum_c, self.chamber.maximum_c, self.chamber.ramp_c_min)

    def _turn_violations(self, angles: TableAngles, turn: Turn) -> tuple[str, ...]:
        if self.no_turns:
            return (self.no_turns,)
        limits = self.axis(turn.axis)
        begin = {"outer": angles.outer_deg, "middle": angles.middle_deg, "inner": angles.inner_deg}[turn.axis]
        end = begin + turn.angle_deg
        rate, acceleration = turn.rate_deg_s, turn.acceleration_deg_s2
        found: list[str] = []
        if rate > limits.rate_deg_s:
            found.append(f"{turn.axis} rate of {rate:g} deg/s is above {limits.rate_deg_s:g}")
        if acceleration > limits.acceleration_deg_s2:
            found.append(f"{turn.axis} ramps of {acceleration:g} deg/s^2 are above {limits.acceleration_deg_s2:g}")
        if not limits.continuous and not limits.minimum_deg <= end <= limits.maximum_deg:
            found.append(
                f"{turn.turns} turns of the {turn.axis} axis from {begin:g} deg end outside "
                f"{limits.minimum_deg:g} … {limits.maximum_deg:g}: it has no slip rings"
            )
        return tuple(found)
