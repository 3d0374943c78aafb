"""Units and tables drawn by a seed: as many different ones as a Monte Carlo run needs."""

import numpy as np

from procedures.core import units
from simulators.truth.chance import keyed_generator
from simulators.truth.files import default_unit
from simulators.truth.ranges import Matrix, Vector
from simulators.truth.thermal import random_thermal_truth
from simulators.truth.values import TableTruth, TriadTruth, UnitTruth


def _vector(rng: np.random.Generator, sd: float) -> Vector:
    x, y, z = (sd * rng.standard_normal(3)).tolist()
    return x, y, z


def _matrix(rng: np.random.Generator, diagonal: float, diagonal_sd: float, cross_sd: float) -> Matrix:
    values = cross_sd * rng.standard_normal((3, 3))
    np.fill_diagonal(values, diagonal * (1.0 + diagonal_sd * rng.standard_normal(3)))
    first, second, third = ((float(a), float(b), float(c)) for a, b, c in values)
    return first, second, third


def _redraw(rng: np.random.Generator, base: TriadTruth, bias: Vector, matrix: Matrix) -> TriadTruth:
    """Draw a unit of the same kind: its own bias and matrix; noise coefficients within ±20 % of the kind's.

    What decays from power-up is left out: populations are judged against the theory of noise that is stationary.
    """

    def near(values: Vector) -> Vector:
        x, y, z = (float(v * f) for v, f in zip(values, rng.uniform(0.8, 1.2, 3), strict=True))
        return x, y, z

    return TriadTruth(
        bias,
        matrix,
        quantization=near(base.quantization),
        random_walk=near(base.random_walk),
        bias_instability=near(base.bias_instability),
        bias_run_to_run_sd=base.bias_run_to_run_sd,
        scale_factor_run_to_run_sd_ppm=base.scale_factor_run_to_run_sd_ppm,
        nonlinearity_reference=base.nonlinearity_reference,
        flicker_band_s=base.flicker_band_s,
        dithered=base.dithered,
        dither_residue=base.dither_residue,
        dither_frequency_hz=base.dither_frequency_hz,
    )


def random_unit_truth(seed: int) -> UnitTruth:
    """Draw a unit of the default's kind: spreads are those between the channels of thesis tables 5.1 and 5.2.

    Gyro: bias 0.1 deg/h, scale 0.3 %, cross terms 0.004. Accelerometer: bias 0.1 m/s², scale 0.84 ± 3 %, cross 0.004.
    """
    base = default_unit()
    rng = keyed_generator(seed, "unit truth")
    gyro_bias = _vector(rng, 0.1 * units.DEG_PER_HOUR)
    gyro = _redraw(rng, base.gyro, gyro_bias, _matrix(rng, 1.0, 0.003, 0.004))
    accelerometer_bias = _vector(rng, 0.1)
    accelerometer = _redraw(rng, base.accelerometer, accelerometer_bias, _matrix(rng, 0.84, 0.03, 0.004))
    return UnitTruth(f"SIM-R{seed:06d}", gyro, accelerometer, base.sample_rate_hz, random_thermal_truth(seed))


def random_table_truth(
    seed: int,
    orthogonality_sd_arcsec: float = 0.0,
    azimuth_sd_arcsec: float = 0.0,
    pointing_sd_arcsec: float = 0.0,
    level_sd_arcsec: float = 0.0,
) -> TableTruth:
    """Draw a table from its declared standard uncertainties, all flaws independent and normal."""
    draw = keyed_generator(seed, "table truth").standard_normal(5)
    return TableTruth(
        outer_middle_nonorthogonality_arcsec=float(orthogonality_sd_arcsec * draw[0]),
        middle_inner_nonorthogonality_arcsec=float(orthogonality_sd_arcsec * draw[1]),
        base_tilt_north_arcsec=float(level_sd_arcsec * draw[2]),
        base_tilt_east_arcsec=float(level_sd_arcsec * draw[3]),
        azimuth_error_arcsec=float(azimuth_sd_arcsec * draw[4]),
        pointing_sd_arcsec=pointing_sd_arcsec,
    )
