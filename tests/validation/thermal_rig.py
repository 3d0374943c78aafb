"""A thermal cycle without the service: the simulated chamber through a profile, the unit's outputs and thermometers.

Made from the truth alone, one sample a second. Noise of the accelerometers as thesis table 4.2 has it: readings of a
counter (quantization) and a flicker, here a bank of Gauss-Markov processes of this file's own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from procedures.analysis.thermal.regime import RegimeSettings, RegimeTrace
from procedures.analysis.thermal.runs import ThermalRun, thermal_run, without_lag
from procedures.core import units
from procedures.core.converter import ConverterModel
from simulators.chamber.behaviour import MA_PER_NOMINAL, converter_codes, response
from simulators.chamber.plant import ChamberPlant
from simulators.chamber.thermometers import Thermometers
from simulators.truth import Array, keyed_generator
from simulators.truth.thermal import REFERENCE_C, ChamberTruth, UnitThermalTruth
from tests.correction_samples import converter_model

G = 9.810553
SCALE = np.array([0.8148, 0.85883, 0.85306])
"""Diagonal of thesis table 5.1."""
BIAS = np.array([0.090117, 0.092241, 0.12179])
RUN_TO_RUN_BIAS, RUN_TO_RUN_SCALE = 5.3e-5, 80e-6
"""Recomputed from thesis table 5.1 (`simulators/truths/default_unit.toml`)."""
QUANTIZATION, FLICKER = 11.0 * units.MICRO_G, 0.75 * units.MICRO_G
"""Thesis table 4.2: [m/s²·s] and [m/s²]."""
HOUR = 3600
LAG_S = 5.0
"""Of the thermometers, as their data sheet says."""
TILT = 2.0e-3
"""The unit's seat in the chamber is a manual table: horizontal axes are so far from level [rad], known from a level."""


@dataclass(frozen=True)
class Leg:
    """Go to a chamber temperature at a ramp and stay until so long after setting out."""

    target_c: float
    ramp_c_min: float
    seconds: int


@dataclass(frozen=True)
class Cycle:
    """Samples of one run, one a second."""

    up: int
    nodes_c: Array
    """(n, 8)"""
    codes: Array
    """Of the thermometers, in °C, (n, 5)."""
    output: Array
    """Nominal accelerometer outputs, (n, 3) [m/s²], converter included."""
    clean: Array
    """The same with the converter at the reference and without noise."""
    force: tuple[float, float, float]


def profile(temperatures_c: Sequence[float], ramp_c_min: float, hours: float) -> list[Leg]:
    """Equal times for each temperature, the first being where the unit is switched on."""
    seconds = int(hours * HOUR) // len(temperatures_c)
    return [Leg(t, ramp_c_min, seconds) for t in temperatures_c]


THESIS_LIKE = profile((20.0, -40.0, -20.0, 0.0, 20.0, 40.0, 60.0, 20.0), 1.0, 12.0)
"""Ours: the thesis's profile is a figure. 12 h, soaks over −40 … +60 °C, ramps of 1 °C/min."""
OTHER = profile((20.0, 60.0, 30.0, -20.0, 10.0, 20.0), 1.5, 12.0)
"""For judging a correction on what it was not fitted to: another order, other soaks, other ramps."""
FAST = profile((20.0, 60.0, -20.0, 40.0, -40.0, 20.0, 60.0, -20.0, 20.0), 5.0, 9.0)


def flicker(rng: np.random.Generator, count: int) -> Array:
    """Flicker noise of unit coefficient, one sample a second, (count, 3): Gauss-Markov processes of 1 … 10⁵ s."""
    times = np.geomspace(1.0, 1e5, 11)
    variance = np.log(times[-1] / times[0]) / np.pi / len(times)
    total = np.zeros((count, 3))
    for tau in times:
        decay = np.exp(-1.0 / tau)
        draws = rng.standard_normal((count + 1, 3))
        draws[1:] *= np.sqrt(1.0 - decay**2)
        total += np.sqrt(variance) * lfilter([1.0], [1.0, -decay], draws, axis=0)[1:]
    return total


def cycle(
    truth: UnitThermalTruth,
    legs: Sequence[Leg],
    up: int,
    seed: int,
    chamber: ChamberTruth | None = None,
    tilt: float = TILT,
) -> Cycle:
    """One run: switched on at room temperature with the first leg; the launch has a bias and a scale of its own."""
    chamber = chamber or ChamberTruth()
    plant = ChamberPlant(chamber, truth.network, seed)
    plant.state.unit_on = True
    paths = []
    for leg in legs:
        plant.command(leg.target_c, leg.ramp_c_min / 60.0)
        paths.append(plant.run(leg.seconds))
    nodes = np.concatenate(paths)
    steps = np.array([t.step_c for t in truth.thermometers])
    codes = Thermometers(truth.thermometers, seed, chamber.ambient_c).read(0, nodes) * steps
    rng = keyed_generator(seed, "thermal rig", up)
    lean = tilt * rng.standard_normal(3)
    force = np.where(np.arange(3) == up, G, G * lean)
    bias = BIAS + RUN_TO_RUN_BIAS * rng.standard_normal(3)
    through = SCALE * (1.0 + RUN_TO_RUN_SCALE * rng.standard_normal(3)) * force
    felt = response(truth, nodes)
    readings = rng.standard_normal((len(nodes) + 1, 3))
    noise = QUANTIZATION * np.diff(readings, axis=0) + FLICKER * flicker(rng, len(nodes))
    clean = bias + felt.sensor_gain * through + felt.sensor_added_m_s2
    output = felt.converter_gain * (clean + noise) + felt.converter_added_m_s2
    return Cycle(up, nodes, codes, output, clean, (float(force[0]), float(force[1]), float(force[2])))


def converter_bench(truth: UnitThermalTruth, seed: int) -> tuple[ConverterModel, ConverterModel, ConverterModel]:
    """Stage one: ±10 mA from a precision source at soaks of the bare converter, a minute of 100 cycles/s a reading."""
    rng = keyed_generator(seed, "converter bench")
    board = np.arange(-40.0, 81.0, 10.0)
    sensor = board + truth.thermometers[1].offset_c + 0.004 * rng.standard_normal(len(board))
    models = []
    for channel in truth.converter:
        plus, minus = (
            converter_codes(channel, np.full(len(board), current), board) + rng.standard_normal(len(board)) / 6000.0
            for current in (10.0, -10.0)
        )
        models.append(converter_model(10.0, plus, minus, sensor, REFERENCE_C + truth.thermometers[1].offset_c))
    return models[0], models[1], models[2]


def stage_one(run: Cycle, truth: UnitThermalTruth, models: Sequence[ConverterModel]) -> Array:
    """Outputs (n, 3) with the converter's own model taken out against its own sensor."""
    board, columns = without_lag(run.codes[:, 1], 1.0, LAG_S), []
    for i, (model, channel) in enumerate(zip(models, truth.converter, strict=True)):
        codes = channel.codes_a_ma * MA_PER_NOMINAL * run.output[:, i] + channel.zero_code
        current = model.current_ma(codes, board)
        columns.append(current / MA_PER_NOMINAL)
    return np.column_stack(columns)


def as_run(
    run: Cycle,
    output: Array,
    truth: UnitThermalTruth,
    settings: RegimeSettings | None = None,
    cell_s: float = 60.0,
) -> ThermalRun:
    """Run as the analysis would be given it: outputs, thermometers, and the data sheet's time constants of these."""
    case, converter = run.codes[:, 0], run.codes[:, 1]
    lag = {"case": LAG_S, "converter": LAG_S}
    series = {"output": output, "case": case, "converter": converter}
    return thermal_run(run.up, G, 1.0, series, cell_s=cell_s, lag_s=lag, settings=settings, force_m_s2=run.force)


def reference_c(truth: UnitThermalTruth) -> tuple[float, float]:
    """Readings of case and converter sensor with the nodes at the reference."""
    return REFERENCE_C + truth.thermometers[0].offset_c, REFERENCE_C + truth.thermometers[1].offset_c


def true_coefficients(truth: UnitThermalTruth) -> Array:
    """α1 … α4, β1 … β4 of each axis, (3, 8): α over the scale, for K0 is one over it."""
    rows = []
    for a, scale in zip(truth.accelerometers, SCALE, strict=True):
        alpha = (a.scale_static[1], a.scale_static[0], a.scale_dynamic[1], a.scale_dynamic[0])
        rows.append([*(np.array(alpha) / scale), *a.bias_static, *a.bias_dynamic])
    return np.array(rows)


def with_block(truth: UnitThermalTruth, share: float) -> UnitThermalTruth:
    """The same unit, its static terms acting through the accelerometer block by so much."""
    x, y, z = (replace(a, block_share=share) for a in truth.accelerometers)
    return replace(truth, accelerometers=(x, y, z))


def switches(trace: RegimeTrace) -> list[int]:
    """Indices of the first samples of a new regime."""
    return (np.flatnonzero(np.diff(trace.dynamic)) + 1).tolist()
