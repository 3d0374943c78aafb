"""Declaration of a simulated unit, as a laboratory would know it beforehand: its channels and its true noise."""

from procedures.core import units
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import ACCELEROMETER, GYRO, Channel, Quantity
from procedures.core.unit import TriadRecord, Unit
from simulators.truth.thermal import THERMOMETERS
from simulators.truth.values import TriadTruth, UnitTruth


def unit_channels(truth: UnitTruth) -> tuple[Channel, ...]:
    """Describe six channels of increments, gyros first; the nominal scale of each is the weight of its pulse."""
    gyros = zip(GYRO, truth.gyro.pulse, strict=True)
    accelerometers = zip(ACCELEROMETER, truth.accelerometer.pulse, strict=True)
    return (
        *(Channel(name, Quantity.ANGLE_INCREMENT, "rad", scale) for name, scale in gyros),
        *(Channel(name, Quantity.VELOCITY_INCREMENT, "m/s", scale) for name, scale in accelerometers),
    )


def temperature_channels(truth: UnitTruth) -> tuple[Channel, ...]:
    """Describe five channels in the order of `THERMOMETERS`; the scale of each is the step of its sensor [°C]."""
    sensors = zip(THERMOMETERS, truth.thermal.thermometers, strict=True)
    return tuple(Channel(f"temperature_{name}", Quantity.TEMPERATURE, "degC", t.step_c) for name, t in sensors)


def declared_unit(truth: UnitTruth, averaging_time_s: float = 70.0, sample_rate_hz: float | None = None) -> Unit:
    """Build the unit's data sheet: channels, noise coefficients and run-to-run stability as they truly are.
    `sample_rate_hz`: another rate than the truth's [Hz].
    """

    def record(triad: TriadTruth) -> TriadRecord:
        columns = zip(
            triad.quantization,
            triad.random_walk,
            triad.bias_instability,
            triad.rate_random_walk,
            [abs(r) for r in triad.rate_ramp],
            strict=True,
        )
        x, y, z = (NoiseCoefficients(*column, flicker_band_s=triad.flicker_band_s) for column in columns)
        dithers = triad.dither_frequency_hz if any(triad.dither_frequency_hz) else None
        changes = triad.bias_run_to_run_sd, triad.scale_factor_run_to_run_sd_ppm * units.PPM
        return TriadRecord((x, y, z), *changes, dither_frequency_hz=dithers)

    return Unit(
        truth.serial,
        truth.sample_rate_hz if sample_rate_hz is None else sample_rate_hz,
        unit_channels(truth),
        record(truth.gyro),
        record(truth.accelerometer),
        averaging_time_s,
    )
