"""Chance, keyed: each number is a function of the seed and of what it is for, never of what was drawn before."""

from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from procedures.core import units
from simulators.truth.files import default_unit
from simulators.truth.values import Matrix, TableTruth, TriadTruth, UnitTruth, Vector


def keyed_generator(seed: int, *labels: object, block: int = 0) -> np.random.Generator:
    """A generator of its own for (seed, labels, block).

    Philox-4x64: the key is a hash of seed and labels, the block number stands in the highest word of the counter,
    so that 2^192 draws lie between two blocks.
    """
    counter = np.array([0, 0, 0, block], dtype=np.uint64)
    return np.random.Generator(np.random.Philox(key=_key(seed, labels), counter=counter))


def _key(seed: int, labels: tuple[object, ...]) -> NDArray[np.uint64]:
    digest = blake2b(repr((int(seed), *map(str, labels))).encode(), digest_size=16).digest()
    return np.frombuffer(digest, dtype=np.uint64)


class KeyedBlocks:
    """`keyed_generator` for many blocks in turn: one generator, set to each of them, which is twenty times cheaper."""

    def __init__(self, seed: int, *labels: object) -> None:
        self._philox = np.random.Philox(key=_key(seed, labels))
        self._generator = np.random.Generator(self._philox)
        self._state = self._philox.state
        self._counter: NDArray[np.uint64] = self._state["state"]["counter"]

    def at(self, block: int) -> np.random.Generator:
        """The generator at the beginning of a block. It is the same object each time: use it before asking again."""
        self._counter[:] = 0, 0, 0, block
        self._philox.state = self._state
        return self._generator


def _vector(rng: np.random.Generator, sd: float) -> Vector:
    x, y, z = (sd * rng.standard_normal(3)).tolist()
    return x, y, z


def _matrix(rng: np.random.Generator, diagonal: float, diagonal_sd: float, cross_sd: float) -> Matrix:
    values = cross_sd * rng.standard_normal((3, 3))
    np.fill_diagonal(values, diagonal * (1.0 + diagonal_sd * rng.standard_normal(3)))
    first, second, third = ((float(a), float(b), float(c)) for a, b, c in values)
    return first, second, third


def _redraw(rng: np.random.Generator, base: TriadTruth, bias: Vector, matrix: Matrix) -> TriadTruth:
    """Another unit of the same kind: its own bias and matrix; noise coefficients within ±20 % of the kind's.

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
    """A unit of the default's kind, drawn: spreads are those between the channels of thesis tables 5.1 and 5.2.

    Gyro: bias 0.1 deg/h, scale 0.3 %, cross terms 0.004. Accelerometer: bias 0.1 m/s², scale 0.84 ± 3 %, cross 0.004.
    """
    base = default_unit()
    rng = keyed_generator(seed, "unit truth")
    gyro_bias = _vector(rng, 0.1 * units.DEG_PER_HOUR)
    gyro = _redraw(rng, base.gyro, gyro_bias, _matrix(rng, 1.0, 0.003, 0.004))
    accelerometer_bias = _vector(rng, 0.1)
    accelerometer = _redraw(rng, base.accelerometer, accelerometer_bias, _matrix(rng, 0.84, 0.03, 0.004))
    return UnitTruth(f"SIM-R{seed:06d}", gyro, accelerometer, base.sample_rate_hz)


def random_table_truth(
    seed: int,
    orthogonality_sd_arcsec: float = 0.0,
    azimuth_sd_arcsec: float = 0.0,
    pointing_sd_arcsec: float = 0.0,
    level_sd_arcsec: float = 0.0,
) -> TableTruth:
    """A table drawn from its declared standard uncertainties, all flaws independent and normal."""
    draw = keyed_generator(seed, "table truth").standard_normal(5)
    return TableTruth(
        outer_middle_nonorthogonality_arcsec=float(orthogonality_sd_arcsec * draw[0]),
        middle_inner_nonorthogonality_arcsec=float(orthogonality_sd_arcsec * draw[1]),
        base_tilt_north_arcsec=float(level_sd_arcsec * draw[2]),
        base_tilt_east_arcsec=float(level_sd_arcsec * draw[3]),
        azimuth_error_arcsec=float(azimuth_sd_arcsec * draw[4]),
        pointing_sd_arcsec=pointing_sd_arcsec,
    )
