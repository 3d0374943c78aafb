"""Innovations of the Kalman calibration name the channel that failed: faults found, and sound units left alone."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import binom, kstest

from procedures.analysis.recursive_bias.innovations import innovation_test, two_sided
from procedures.core.limits import Verdict
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import ACCELEROMETER, GYRO, Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.core.unit import TriadRecord, Unit
from procedures.methods.kalman_calibration import METHOD, Result
from procedures.procedure import Evidence

RATE, COUNT = 10.0, 1000
NOISE = {"gyro": NoiseCoefficients(random_walk=4e-7), "accelerometer": NoiseCoefficients(random_walk=1e-5)}
UNIT = Unit("S-1", RATE, (), *(TriadRecord((NOISE[t],) * 3) for t in ("gyro", "accelerometer")))
CHANNELS = tuple(Channel(n, Quantity.ANGULAR_RATE, "rad/s") for n in GYRO) + tuple(
    Channel(n, Quantity.SPECIFIC_FORCE, "m/s^2") for n in ACCELEROMETER
)
SD = np.repeat([n.random_walk * np.sqrt(RATE) for n in NOISE.values()], 3)
PARAMS = METHOD.params.model_validate({"gyro_target_sd_deg_h": 10.0, "accelerometer_target_sd_m_s2": 1.0})
HALF = np.arange(COUNT) >= COUNT // 2


def analysed(seed: int, change: Callable[[np.ndarray, np.random.Generator], np.ndarray] | None, channel: int) -> Result:
    """A hundred seconds of six channels, with a change of one column in units of a sample's standard deviation."""
    dice = np.random.default_rng((17, seed))
    samples = dice.normal(size=(COUNT, 6))
    if change is not None:
        samples[:, channel] = change(samples[:, channel], dice)
    info = RecordingInfo("r", "S-1", CHANNELS, RATE, COUNT, 5.0)
    return METHOD.analyse(Evidence((MemoryRecording(info, samples * SD),)), PARAMS, UNIT)


def test_normalised_innovations_squared_are_chi_square():
    dice = np.random.default_rng(3)
    made = [innovation_test(dice.normal(size=99), 1.0, 0.01) for _ in range(400)]
    assert kstest([t.size_p_value for t in made], "uniform").pvalue > 0.001
    assert kstest([t.whiteness_p_value for t in made], "uniform").pvalue > 0.001
    assert two_sided(99.0, 99) > 0.9
    assert innovation_test(np.zeros(0), 1.0, 0.01).sentence(0.01) == ""


def test_sound_units_are_left_alone():
    """A level of 0.01 for all channels of a unit together: of 120 units at most 6 with a probability of 0.999."""
    found = [analysed(seed, None, 0) for seed in range(120)]
    assert sum(bool(r.failed_channels) for r in found) <= int(binom.ppf(0.999, 120, 0.01))
    assert sum(r.verdict is not Verdict.PASS for r in found) == sum(bool(r.failed_channels) for r in found)


FAULTS: dict[str, Callable[[np.ndarray, np.random.Generator], np.ndarray]] = {
    "noisier by half": lambda x, _: 1.5 * x,
    "noisier from the middle on": lambda x, _: np.where(HALF, 2.0 * x, x),
    "a step of the bias": lambda x, _: x + 2.5 * HALF,
    "a drift": lambda x, _: x + 3.0 * np.arange(COUNT) / COUNT,
    "spikes": lambda x, dice: x + 40.0 * (dice.random(COUNT) < 0.01),
    "held at its last value": lambda x, _: np.repeat(x[::50], 50),
    "filtered": lambda x, _: 0.5 * x,
}


@pytest.mark.parametrize("fault", list(FAULTS))
def test_the_failed_channel_is_named(fault: str):
    """Each of the six channels four times; by the binomial distribution 24 of 24 at a true share of 0.95 or better is
    not asked for: 21 are, which such a share misses with a probability of 0.03 %.
    """
    found = [analysed(100 * k + channel, FAULTS[fault], channel) for channel in range(6) for k in range(4)]
    named = [r.failed_channels == ((*GYRO, *ACCELEROMETER)[i // 4],) for i, r in enumerate(found)]
    assert sum(named) >= 21, fault
    assert all(r.verdict is Verdict.FAIL for r, good in zip(found, named, strict=True) if good)
    first = found[0]
    assert any(w.startswith("failed channel gyro_x, r: ") for w in first.warnings), first.warnings
    failed = [c.name for c in first.checks if not c.passed]
    assert failed
    assert all(name.startswith("gyro_x, r") for name in failed)


def test_the_beginning_is_told():
    found = [analysed(7000 + k, FAULTS["noisier from the middle on"], 1) for k in range(10)]
    begun = [b.innovations.since_s for r in found for b in r.biases if b.channel == "gyro_y" and b.innovations]
    told = [t for t in begun if t is not None]
    assert len(told) >= 8
    assert np.median(told) == pytest.approx(50.0, abs=10.0)
