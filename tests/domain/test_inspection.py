"""Every analysis meets its recordings through the inspection: once, in passing, with one answer for many stations."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bench_service
from procedures import catalog, methods
from procedures.analysis.fitness.findings import ChannelFitness, Finding, FitnessSettings, Kind, Severity
from procedures.analysis.fitness.grouped import grouped
from procedures.analysis.fitness.watched import Inspection, Watch
from procedures.analysis.parts import cut
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.recording import GYRO, Channel, MemoryRecording, Quantity, RawArray, RecordingInfo, Station
from procedures.core.turn import Turn
from procedures.inspection import analyse_method
from procedures.methods import allan_deviation
from procedures.procedure import Evidence, RecordedParameters

CHANNELS = tuple(Channel(name, Quantity.ANGULAR_RATE, "count") for name in GYRO)
ALLAN = allan_deviation.METHOD


def noise(seed: int = 1, n: int = 20_000) -> np.ndarray:
    return np.rint(np.random.default_rng(seed).normal(50.0, 30.0, (n, 3))).astype(np.int32)


def recording(raw: np.ndarray, name: str = "r", **info: Any) -> MemoryRecording:
    return MemoryRecording(RecordingInfo(name, "U", CHANNELS, 100.0, len(raw), **info), raw)


class Counted:
    """A recording in blocks that counts how often it is read."""

    def __init__(self, raw: np.ndarray) -> None:
        self.info, self._raw, self.passes = recording(raw).info, raw, 0

    def blocks(self) -> Iterator[RawArray]:
        self.passes += 1
        for at in range(0, len(self._raw), 1500):
            yield self._raw[at : at + 1500]


def allan(*recordings: Any, **parameters: Any) -> Any:
    return analyse_method(ALLAN, Evidence(recordings), ALLAN.params(points=10, **parameters), None)


def taus(result: Any) -> list[float]:
    """Cluster sizes in samples."""
    return [100.0 * tau_s for tau_s in result.curves[0].tau_s]


def test_no_analysis_of_the_service_goes_round_the_inspection() -> None:
    folder = Path(bench_service.__file__).parent
    callers = [
        p for p in folder.rglob("*.py") if "method.analyse(" in p.read_text() or "procedure.analyse(" in p.read_text()
    ]
    assert not callers
    through = [p.name for p in folder.rglob("*.py") if "from procedures.inspection import" in p.read_text()]
    assert sorted(through) == ["analyses.py", "job_analysis.py"]


def test_everything_that_takes_recordings_says_how_they_are_inspected() -> None:
    for procedure in catalog.discover().values():
        defaults = procedure.params.model_construct()
        assert isinstance(procedure.inspection(defaults), Inspection), procedure.name
    recorded = {name for name, m in methods.discover().items() if issubclass(m.params, RecordedParameters)}
    assert recorded == {
        "allan_deviation",
        "ferraris_calibration_of_recordings",
        "field_calibration",
        "free_inertial",
        "gyro_half_turns",
        "initial_alignment_of_recording",
        "kalman_calibration",
        "multi_position_calibration_of_recordings",
        "noise_analysis",
        "scalar_calibration",
        "temperature_dependence",
        "thermal_correction_of_recordings",
    }


def test_one_pass_serves_the_inspection_and_the_analysis() -> None:
    counted = Counted(noise())
    assert not allan(counted, density=False).warnings
    assert counted.passes == 1
    with_density = Counted(noise())
    assert not allan(with_density).warnings
    assert with_density.passes == 2, "the density needs the mean of a first pass"


def test_a_refusal_comes_before_the_judgement_and_names_every_recording() -> None:
    bad = [noise(seed) for seed in (1, 2, 3)]
    for raw in (bad[0], bad[2]):
        raw[:, 1] = np.minimum(raw[:, 1], 60)
    with pytest.raises(UnfitRecording) as refusal:
        allan(*(recording(raw, f"r{i}") for i, raw in enumerate(bad)))
    assert "recording r0: channel gyro_y: " in str(refusal.value)
    assert "stand at 60" in str(refusal.value)
    assert "the same kind of flaw in recording r2" in str(refusal.value)
    assert "r1" not in str(refusal.value)


def test_only_the_channels_that_are_asked_for_matter() -> None:
    raw = noise()
    raw[:, 1] = 7
    with pytest.raises(UnfitRecording, match="gyro_y"):
        allan(recording(raw))
    assert not allan(recording(raw), channels=("gyro_x", "gyro_z")).warnings


def test_where_an_analysis_fails_on_a_broken_recording_the_reason_is_told() -> None:
    raw = noise().astype(np.float64)
    raw[500, 2] = np.nan
    with pytest.raises(UnfitRecording, match=r"channel gyro_z: 1 of 20000 samples is not a finite number.*sample 500"):
        allan(recording(raw))
    # What the analysis itself refuses stays as it says it.
    with pytest.raises(UnfitRecording, match="samples are too few for an Allan deviation"):
        allan(recording(noise(n=5)))


@pytest.mark.parametrize("dtype", [np.int32, np.float64])
def test_the_figures_are_without_an_outlier(dtype: type) -> None:
    clean = noise(4).astype(dtype)
    broken = clean.copy()
    broken[[7000, 12_345], 0] += np.array([9000, -4000], dtype)
    good, mended = allan(recording(clean)), allan(recording(broken))
    (warning,) = mended.warnings
    assert "channel gyro_x: 2 of 20000 samples far from both neighbours" in warning
    assert "7000 (70 s), 12345 (123.45 s)" in warning
    assert "the figures are without them" in warning
    # A sample that is the mean of its neighbours is off by √1.5 σ. It stands in 3m of the N differences of cluster
    # size m, each changed by √1.5·σ/m where √(2/m)·σ is usual: 3·√1.5·√(m/2)·2/N of the variance, half of it of the
    # deviation, twice for two outliers, and three times that for chance.
    for m, found, expected in zip(taus(good), mended.curves[0].deviation, good.curves[0].deviation, strict=True):
        assert found == pytest.approx(expected, rel=3.0 * 2.0 * 3.0 * 1.23 * (m / 2.0) ** 0.5 / 20_000 + 1e-3)


def test_many_outliers_stay_and_it_is_said() -> None:
    raw = noise(5)
    raw[::400, 0] += 5000
    (warning,) = allan(recording(raw)).warnings
    assert "the figures include them" in warning


def test_a_turn_is_no_step_and_a_step_at_rest_is_one() -> None:
    raw = noise(6)
    raw[8000:15_000, 1] += 4000
    still = Station(0, "still")
    turned = replace(still, turn=Turn("outer", 3, 10.0, 1.0))
    inspection = Inspection(FitnessSettings(least_samples=1))
    for station, steps in ((still, 1), (turned, 0)):
        watch = Watch([recording(raw, station=station)], inspection)
        for _ in watch.recordings[0].blocks():
            pass
        said = [w for w in watch.warnings() if "the level steps" in w]
        assert len(said) == steps
    assert "2 times: by " not in "".join(said)


def test_findings_of_many_stations_are_said_once() -> None:
    def fitness(channel: str, sentence: str) -> ChannelFitness:
        return ChannelFitness(channel, (Finding(Kind.RESOLUTION, Severity.WARN, f"channel {channel}: {sentence}"),))

    alike = [fitness(name, "all values are multiples of 4") for name in ("a", "b")]
    assert grouped([("recording r", alike)], Severity.WARN) == ("channels a, b: all values are multiples of 4",)
    stations = [(f"station {i}", alike) for i in range(12)]
    assert grouped(stations, Severity.WARN) == (
        "station 0: channels a, b: all values are multiples of 4; the same kind of flaw in all 12 recordings",
    )
    assert grouped([*stations[:1], ("s", []), *stations[2:3]], Severity.WARN) == (
        "station 0: channels a, b: all values are multiples of 4; the same kind of flaw in station 2",
    )
    assert grouped(stations, Severity.REFUSE) == ()


def test_a_stretch_of_a_recording_is_analysed_alone() -> None:
    whole = noise(8)
    whole[:3000] += 9000
    launched = recording(whole, start_s=70.0, launched_s=10.0)
    part = cut(launched, 30.0, 130.0)
    assert (part.info.count, part.info.start_s, part.info.since_launch_s) == (10_000, 100.0, 90.0)
    assert np.array_equal(np.concatenate(list(part.blocks())), whole[3000:13_000])
    stretched = allan(launched, start_s=30.0, stop_s=130.0)
    assert not stretched.warnings
    assert stretched.curves == allan(recording(whole[3000:13_000])).curves
    two = allan(recording(whole, "a"), recording(whole, "b"), start_s=(30.0, 40.0))
    assert [c.terms[0] for c in two.curves[::3]] == [16_999, 15_999]
    for wrong in ({"stop_s": 201.0}, {"start_s": 20.0, "stop_s": 20.0}, {"start_s": (1.0, 2.0)}):
        with pytest.raises(BadParameter, match=r"start_s|stop_s"):
            allan(launched, **wrong)


@pytest.mark.parametrize(
    ("taus", "sizes"),
    [
        ("octave", [1, 2, 4, 8, 16, 32, 64, 128, 256, 512]),
        ("decade", [1, 2, 4, 10, 20, 40, 100, 200, 400]),
        ("all", list(range(1, 601))),
        ((0.1, 1.0, 2.004), [10, 100, 200]),
    ],
)
def test_cluster_times_may_be_chosen(taus: Any, sizes: list[int]) -> None:
    found = allan(recording(noise(9, 1200)), taus=taus).curves[0].tau_s
    assert found == pytest.approx([m / 100.0 for m in sizes])


def test_cluster_times_that_a_recording_does_not_have_are_refused() -> None:
    with pytest.raises(BadParameter, match=r"taus = 7\.0: from 0\.01 s, one sample, to 6 s"):
        allan(recording(noise(9, 1200)), taus=(7.0,))
    with pytest.raises(BadParameter, match="at most 10000 are taken"):
        allan(recording(noise(9, 30_000)), taus="all")
