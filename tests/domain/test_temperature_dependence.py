"""Dependence of imported recordings on their temperature channel: fit, order, soaks, repeatability, refusals."""

from dataclasses import replace

import numpy as np
import pytest

from procedures import methods
from procedures.core import units
from procedures.core.errors import BadParameter, MissingChannel, UnfitRecording
from procedures.core.recording import GYRO, Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.core.unit import Unit
from procedures.inspection import judged
from procedures.methods import temperature_dependence
from procedures.methods.temperature_dependence import Params, Result
from procedures.parameters import DecisionRules
from procedures.procedure import Evidence
from tests.correction_samples import thermometers
from tests.validation.thermal_rig import flicker

SOAKS = (20.0, 5.0, 10.0, 20.0, 30.0, 35.0, 30.0)
"""Those of the thesis's appendix B; 30 °C is reached from below and from above."""
SLOPE, SQUARE = 4e-3 * units.DEG_PER_HOUR, -1e-4 * units.DEG_PER_HOUR
SENSORS = tuple(f"temperature_{name}" for name in GYRO)
CHANNELS = (
    *(Channel(name, Quantity.ANGULAR_RATE, "rad/s") for name in GYRO),
    *(Channel(name, Quantity.TEMPERATURE, "degC") for name in SENSORS),
)
OWN = {name: f"temperature_{name}" for name in GYRO}


def temperature(seconds: int = 5400) -> np.ndarray:
    """A case with a time constant of ten minutes behind a chamber that changes by 1 °C/min, one value a second."""
    at, path = SOAKS[0], []
    for target in SOAKS:
        away = np.minimum(np.arange(1, seconds + 1) / 60.0, abs(target - at))
        path.append(at + np.sign(target - at) * away)
        at = target
    air, found, value = np.concatenate(path), [], SOAKS[0]
    for step in air:
        value += (step - value) / 600.0
        found.append(value)
    return np.array(found)


PATH = temperature()


def recording(seed: int, extra: float = 0.0) -> MemoryRecording:
    """Gyro x goes by order two, y not at all, z as x but with a slope of its own in each recording."""
    rng = np.random.Generator(np.random.PCG64(seed))
    departure, count = PATH - 20.0, len(PATH)
    noise = 1.6e-3 * units.DEG_PER_HOUR * flicker(rng, count)
    noise += 1.4e-3 * units.DEG_PER_SQRT_HOUR * rng.standard_normal((count, 3))
    curve = SLOPE * departure + SQUARE * departure**2
    launch = 0.01 * units.DEG_PER_HOUR * rng.standard_normal(3)
    rates = launch + noise + np.column_stack([curve, 0.0 * curve, curve + extra * departure])
    readings = PATH[:, None] + 0.03 * rng.standard_normal((count, 3))
    info = RecordingInfo(f"r{seed}", "U-1", CHANNELS, 1.0, count)
    return MemoryRecording(info, np.column_stack([rates, readings]))


@pytest.fixture(scope="module")
def recordings() -> tuple[MemoryRecording, ...]:
    return tuple(recording(seed, (seed - 2) * 2e-3 * units.DEG_PER_HOUR) for seed in (1, 2, 3))


def analysed(recordings, **changes) -> Result:
    params = Params(own_sensors=OWN).model_copy(update=changes)
    return temperature_dependence.analyse(Evidence(tuple(recordings)), params, None)


@pytest.fixture(scope="module")
def result(recordings) -> Result:
    return analysed(recordings)


def test_the_polynomial_is_found_within_its_claim_and_its_order_is_justified(result: Result):
    x, y, _ = result.channels
    assert (x.order, x.preferred_order) == (2, 2)
    z = (np.array(x.coefficients) - [SLOPE, SQUARE]) / np.sqrt(np.diag(np.array(x.covariance)))
    assert np.abs(z).max() < 4.0, z
    assert x.p_value < 1e-12
    assert x.f_tests[0] < 1e-6
    assert x.reason.startswith("order 2: the criterion is least there")
    assert x.p_unseen is not None
    assert x.p_unseen > 1e-3
    assert y.p_value > 1e-3
    assert x.after_sd < 0.5 * x.before_sd


def test_the_gyros_get_a_correction_only_where_they_depend(result: Result):
    (correction,) = temperature_dependence.corrections(result)
    gyros = correction.gyros
    assert gyros is not None
    assert [len(g.coefficients) for g in gyros.gyros] == [2, 0, result.channels[2].order]


def test_soaks_of_appendix_b_are_found_and_repeat(result: Result):
    x, y, _ = result.channels
    assert len(x.soaks) == 3 * len(SOAKS)
    levels = [s for s in x.soaks if s.recording == 0]
    for soak, target in zip(levels, SOAKS, strict=True):
        assert soak.temperature_c + 20.0 == pytest.approx(target, abs=0.6)
        assert (soak.from_below is None) == (soak is levels[0])
    # 5, 10, 30 and 35 °C in three recordings, 30 °C twice; those near 20 °C that are no reference.
    cold = x.repeatability[0]
    assert (cold.count, cold.temperature_c + 20.0) == (3, pytest.approx(5.0, abs=0.6))
    (hot,) = [r for r in y.repeatability if r.up_less_down is not None and r.count == 6]
    assert hot.up_less_down_sd is not None
    assert abs(hot.up_less_down or 0.0) < 4.5 * hot.up_less_down_sd
    assert min(r.p_value for r in y.repeatability) > 1e-4  # five tests: one suite in 2000


def test_a_dependence_that_does_not_repeat_is_said(result: Result):
    z = result.channels[2]
    assert z.p_unseen is not None
    assert z.p_unseen < 1e-6
    assert any("gyro_z" in w and "does not repeat" in w for w in result.warnings)
    assert min(r.p_value for r in z.repeatability) < 1e-6


def test_an_order_that_is_asked_for_is_used_and_the_better_one_is_said(recordings):
    found = analysed(recordings[:2], order=1, channels=("gyro_x",), soaks=False)
    assert (found.channels[0].order, found.channels[0].preferred_order) == (1, 2)
    assert any("least at order 2" in w for w in found.warnings)
    assert found.gyro_correction is None


def test_a_calibration_of_thermometers_is_used(recordings):
    known = thermometers(2).thermometers
    assert known is not None
    sensor = replace(known.sensors[0], channel="temperature_gyro_x", offset_c=3.0, slope=0.1)
    known = replace(known, sensors=(sensor, *known.sensors[1:]), reference_c=20.0)
    unit = Unit("U-1", 1.0, CHANNELS, thermometers=known, thermometers_id="t-1")
    params = Params(own_sensors=OWN, channels=("gyro_x",), soaks=False)
    found = temperature_dependence.analyse(Evidence(tuple(recordings[:1])), params, unit)
    assert found.thermometers == "t-1"
    assert temperature_dependence.METHOD.uses_corrections(found) == ("thermometers",)
    others = replace(known, sensors=known.sensors[1:], covariance=tuple(row[2:] for row in known.covariance[2:]))
    without = temperature_dependence.analyse(
        Evidence(tuple(recordings[:1])), params, replace(unit, thermometers=others)
    )
    assert without.thermometers == ""
    assert temperature_dependence.METHOD.uses_corrections(without) == ()
    assert found.range_c[1] == pytest.approx(35.0 - 3.0 - 0.1 * 15.0, abs=1.0)


def test_wrong_channels_and_sensors_are_named(recordings):
    with pytest.raises(BadParameter, match="one of temperature_gyro_x, temperature_gyro_y"):
        analysed(recordings, own_sensors={})
    with pytest.raises(BadParameter) as refused:
        analysed(recordings, own_sensors={**OWN, "gyro_y": "room"})
    assert refused.value.field == "own_sensors.gyro_y"
    with pytest.raises(MissingChannel, match="gyro_q"):
        analysed(recordings, channels=("gyro_q",), sensor="temperature_gyro_x")
    bare = replace(recordings[0].info, channels=CHANNELS[:3])
    with pytest.raises(BadParameter, match="no temperature channel"):
        analysed([MemoryRecording(bare, recordings[0].raw[:, :3])], own_sensors={})
    with pytest.raises(UnfitRecording, match="make cell_s shorter"):
        analysed(recordings, cell_s=600.0, channels=("gyro_x",))
    with pytest.raises(UnfitRecording, match="soaks = false"):
        analysed(recordings, least_soak_s=86_400.0, channels=("gyro_x",))
    stuck = recordings[0].raw.copy()
    stuck[:, 3] = 25.0
    with pytest.raises(UnfitRecording, match="channel temperature_gyro_x reads 25 °C all the time"):
        analysed([MemoryRecording(recordings[0].info, stuck)], channels=("gyro_x",))
    assert temperature_dependence.report(analysed(recordings[:1], channels=("gyro_x",))).sections


def test_each_recording_is_read_once_and_a_rule_of_its_own_leaves_a_test_of_significance_alone(recordings):
    reads: list[str] = []

    class Counted(MemoryRecording):
        def blocks(self):
            reads.append(self.info.id)
            return super().blocks()

    method = methods.discover()["temperature_dependence"]
    params = Params(own_sensors=OWN, soaks=False, decision=DecisionRules(rule="guarded"))
    evidence = Evidence((Counted(recordings[0].info, recordings[0].raw),))
    found = temperature_dependence.analyse(evidence, params, None)
    assert reads == [recordings[0].info.id]
    ruled = judged(found, params)
    assert method.params is Params
    assert all(c.significance and c.decision is not None for c in ruled.checks)
    assert [c.passed for c in ruled.checks] == [c.passed for c in found.checks]
    assert ruled.checks[0].decision.rule.startswith("test of significance at 0.0033")
