"""A calibration on the table of a unit whose noise nobody knows: a bad fit fails and is named, a clean one passes."""

from collections.abc import Callable

import numpy as np
import pytest

from procedures import catalog
from procedures.analysis.calibration import summary, triad_analysis
from procedures.core.limits import Verdict
from procedures.core.recording import MemoryRecording
from procedures.core.unit import Unit
from procedures.procedure import Context
from tests.kit.forward_model import random_table, station_recordings

CALIBRATION = catalog.discover()["calibration_12_orientations"]
NOISE = np.array([2e-6] * 3 + [2e-4] * 3)
"""Of a sample [rad/s, m/s²]."""
Spoil = Callable[[list[np.ndarray], np.random.Generator], None]


def calibrated(context: Context, seed: int, spoil: Spoil | None = None):
    rng = np.random.default_rng([5, seed])
    unit = Unit("S-2", 1.0, context.unit.channels)
    here = Context(unit, context.bench)
    loose = {"gyro_bias_in_run_deg_h": 1e3, "accelerometer_bias_in_run_m_s2": 1e2}
    params = CALIBRATION.resolve(CALIBRATION.params(dwell_s=60.0, limits=loose, scalar_check=False), here)
    a = context.bench.accuracy
    table = random_table(rng, a.orthogonality_sd_arcsec, a.pointing_sd_arcsec, a.level_sd_arcsec, 0.0)
    made = station_recordings(CALIBRATION.schedule(params), unit.channels, table=table)
    raw = [r.raw + NOISE * rng.normal(size=r.raw.shape) for r in made]
    if spoil is not None:
        spoil(raw, rng)
    recordings = [MemoryRecording(r.info, x) for r, x in zip(made, raw, strict=True)]
    return CALIBRATION.analyse(recordings, params, here)


@pytest.mark.parametrize("seed", range(5))
def test_a_clean_one_passes(context: Context, seed: int) -> None:
    result = calibrated(context, seed)
    assert result.verdict is Verdict.PASS
    assert all(t.misfit < 2.0 for t in result.triads)


def test_a_triads_residuals_are_searched_for_flaws_once(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[object] = []
    search = triad_analysis.suspect
    for module in (triad_analysis, summary):
        monkeypatch.setattr(module, "suspect", lambda *given: calls.append(given) or search(*given), raising=False)
    params = CALIBRATION.resolve(CALIBRATION.params(dwell_s=60.0), context)
    CALIBRATION.analyse(station_recordings(CALIBRATION.schedule(params), context.unit.channels), params, context)
    assert len(calls) == 2, "gyros and accelerometers"


def exchange(raw: list[np.ndarray], rng: np.random.Generator) -> None:
    raw[1], raw[7] = raw[7], raw[1]


def clip(raw: list[np.ndarray], rng: np.random.Generator) -> None:
    end = 0.8 * max(np.abs(x[:, 3].mean()) for x in raw)
    for x in raw:
        x[:, 3] = np.clip(x[:, 3], -end, end)


def disturb(raw: list[np.ndarray], rng: np.random.Generator) -> None:
    raw[4][:, 4] += 0.2


def drift(raw: list[np.ndarray], rng: np.random.Generator) -> None:
    for i, x in enumerate(raw):
        x[:, 5] += 0.5 * rng.uniform(0.5, 1.0) * i / len(raw)


@pytest.mark.parametrize("spoil", [exchange, clip, disturb, drift])
def test_a_broken_one_fails(context: Context, spoil: Spoil) -> None:
    for seed in range(3):
        result = calibrated(context, seed, spoil)
        assert result.verdict is Verdict.FAIL
        (failed,) = [c for c in result.checks if c.name == "accelerometer residuals over what noise and table allow"]
        assert not failed.passed
        assert failed.note.startswith("worst: ")


def test_the_disturbed_station_and_channel_are_named(context: Context) -> None:
    result = calibrated(context, 1, disturb)
    accelerometer = next(t for t in result.triads if t.calibration.triad == "accelerometer")
    assert accelerometer.worst.startswith(f"{accelerometer.residuals[4].label}, channel y")


@pytest.mark.parametrize(("triad", "first"), [("gyro", 0), ("accelerometer", 3)])
def test_exchanged_channels_fail_and_are_named_though_they_fit_as_well(
    context: Context, triad: str, first: int
) -> None:
    def exchanged(raw: list[np.ndarray], _: np.random.Generator) -> None:
        for x in raw:
            x[:, [first + 1, first + 2]] = x[:, [first + 2, first + 1]]

    def reversed_one(raw: list[np.ndarray], _: np.random.Generator) -> None:
        for x in raw:
            x[:, first] *= -1.0

    for spoil, said in (
        (exchanged, f"{triad}_y and {triad}_z are exchanged"),
        (reversed_one, f"{triad}_x is reversed"),
    ):
        result = calibrated(context, 2, spoil)
        failed = [c for c in result.checks if not c.passed]
        assert [(c.name, c.note) for c in failed] == [(f"{triad} channels on their own axes", said)]
