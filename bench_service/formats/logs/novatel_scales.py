"""Scale factors of NovAtel's raw inertial logs by the type of the unit.

Source: NovAtel's manual of RAWIMUSX ("Raw IMU scale factors") as the maker's driver novatel_oem7_driver (MIT) has it,
with feet of 0.3048 m exactly, where the driver has 1/3.2808. Of a unit's rate there is no table here: the driver's own
named 100 Hz for an ISA-100C of 200 Hz from 2023 to 2026, so the rate is taken from the stamps.
"""

from dataclasses import dataclass

from procedures.core.recording import Quantity
from procedures.core.units import FOOT


@dataclass(frozen=True)
class Scales:
    """Quantities, units and scale factors of one type of unit, a count each."""

    title: str
    angle: float
    angle_unit: str
    velocity: float
    velocity_unit: str = "m/s"
    rates: bool = False
    """Whether counts are rates and forces, not increments."""

    @property
    def gyro(self) -> Quantity:
        """Quantity of the gyros' counts."""
        return Quantity.ANGULAR_RATE if self.rates else Quantity.ANGLE_INCREMENT

    @property
    def force(self) -> Quantity:
        """Quantity of the accelerometers' counts."""
        return Quantity.SPECIFIC_FORCE if self.rates else Quantity.VELOCITY_INCREMENT


def _honeywell(title: str, power: int, unit: float = FOOT) -> Scales:
    return Scales(title, 2.0**-33, "rad", 2.0**power * unit)


_EPSON_G320 = Scales("Epson G320N", 0.008 / 65536, "deg/s", 0.2 / 65536, "mg", rates=True)
SCALES: dict[int, Scales] = {
    1: _honeywell("Honeywell HG1700 AG11", -27),
    4: _honeywell("Honeywell HG1700 AG17", -26),
    5: _honeywell("Honeywell HG1900 CA29", -27),
    8: Scales("Northrop Grumman LN-200", 2.0**-19, "rad", 2.0**-14),
    11: _honeywell("Honeywell HG1700 AG58", -27),
    12: _honeywell("Honeywell HG1700 AG62", -26),
    13: Scales("iMAR iIMU-FSAS", 0.1 / 256, "arcsec", 0.05 / 2.0**15),
    16: Scales("KVH CPT", 0.1 / (3600.0 * 256.0), "rad", 0.05 / 2.0**15),
    20: _honeywell("Honeywell HG1930 AA99", -27),
    26: Scales("Northrop Grumman Litef ISA-100C", 1e-9, "rad", 2e-8),
    27: _honeywell("Honeywell HG1900 CA50", -27),
    28: _honeywell("Honeywell HG1930 CA50", -27),
    31: Scales("Analog Devices ADIS16488", 720.0 / 2.0**31, "deg", 200.0 / 2.0**31),
    32: Scales("Sensonor STIM300", 2.0**-21, "deg", 2.0**-22),
    33: Scales("KVH 1750", 0.1 / (3600.0 * 256.0), "rad", 0.05 / 2.0**15),
    41: _EPSON_G320,
    52: Scales("Litef microIMU", 1e-9, "rad", 2e-8),
    56: Scales("Sensonor STIM300, direct connection", 2.0**-21, "deg", 2.0**-22),
    58: _honeywell("Honeywell HG4930 AN01", -29, 1.0),
    61: Scales("Epson G370N", 0.0151515 / 65536, "deg/s", 0.4 / 65536, "mg", rates=True),
    62: _EPSON_G320,
    68: _honeywell("Honeywell HG4930 AN04", -29, 1.0),
    69: _honeywell("Honeywell HG4930 AN04, 400 Hz", -29, 1.0),
}
"""Number of the type (as RAWIMUX, RAWIMUSX and INSCONFIG have it) -> its scales."""
SOURCE = "NovAtel's table of raw scale factors, as the maker's driver has it"
