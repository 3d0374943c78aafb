"""A column of time that no single rate describes is refused, with the row and the value; jitter has a stated limit."""

import io
from typing import Any

import numpy as np
import pytest

from bench_service.formats.description import ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.import_file import ImportedRecording, ImportFile, read_import
from procedures.core.errors import BadParameter, UnfitRecording

ROWS = 4000
STEP_S = 0.01
UNIFORM = np.arange(ROWS) * STEP_S
Times = np.ndarray[Any, np.dtype[np.float64]]


def _read(times: Times, **changes: Any) -> ImportedRecording:
    channel = {"name": "gyro_x", "column": "x", "quantity": "angular_rate", "unit": "rad/s"}
    description = {"unit": "U-1", "channels": [channel], "time_column": "t", **changes}
    rows = "".join(f"{t!r},{i % 7 + 0.5}\n" for i, t in enumerate(times.tolist()))
    stream = io.BytesIO(f"t,x\n{rows}".encode())
    return read_import([ImportFile("a.csv", stream)], ImportDescription.model_validate(description))


def _from_steps(steps: Times) -> Times:
    return np.concatenate([[0.0], np.cumsum(steps)])


def _changed(index: int, value_s: float) -> Times:
    times = UNIFORM.copy()
    times[index] = value_s
    return times


def _jitter(part: float) -> Times:
    """Each time off by at most so large a part of a step."""
    rng = np.random.Generator(np.random.PCG64(1))
    return UNIFORM + STEP_S * rng.uniform(-part, part, ROWS)


@pytest.mark.parametrize("block_bytes", [1000, 4 * 1024 * 1024])
def test_jitter_of_a_step_within_a_fifth_is_accepted(monkeypatch: pytest.MonkeyPatch, block_bytes: int) -> None:
    monkeypatch.setattr("bench_service.formats.delimited._BLOCK_BYTES", block_bytes)
    # Steps differ by twice the jitter of a time: ± 9 % of a step in time stay within ± 20 % of a median near one step.
    recording = _read(_jitter(0.09))
    # First and last time are off by 9 % of a step at most, over 3999 steps.
    assert recording.rate_hz == pytest.approx(100.0, rel=2 * 0.09 / (ROWS - 1))
    assert recording.count == ROWS


def test_more_jitter_is_said_and_no_loss_is_named() -> None:
    recording = _read(_jitter(0.3))
    assert recording.count == ROWS
    assert recording.rate_hz == pytest.approx(100.0, rel=2 * 0.3 / (ROWS - 1))
    (warning,) = recording.source["warnings"]
    assert warning.startswith("the stamps jitter by 0.6 sample periods")
    assert "no sample is lost" in warning
    assert not _read(_jitter(0.3), gap_tolerance=0.7).source["warnings"]


@pytest.mark.parametrize(
    ("times", "words"),
    [
        (np.delete(UNIFORM, 1234), "1 sample is missing in 1 place: 1 between rows 1234 and 1235 (12.33 s from"),
        (UNIFORM + (np.arange(ROWS) > 2000) * 0.05, "5 samples are missing in 1 place: 5 between rows 2001 and 2002"),
        (UNIFORM - (np.arange(ROWS) > 2000) * 0.005, "no room for 1 of the rows: 1 between rows 2001 and 2002 (20 s"),
        (_changed(1234, 12.0), "does not grow: 12.33 s in row 1234, 12 s in row 1235"),
        (_from_steps(np.array([5.0] + [STEP_S] * 50)), "499 samples are missing in 1 place: 499 between rows 1 and 2"),
    ],
)
@pytest.mark.parametrize("block_bytes", [1000, 4 * 1024 * 1024])
def test_gaps_repeats_and_steps_back_are_named(
    monkeypatch: pytest.MonkeyPatch, block_bytes: int, times: Times, words: str
) -> None:
    monkeypatch.setattr("bench_service.formats.delimited._BLOCK_BYTES", block_bytes)
    with pytest.raises(UnfitRecording) as refusal:
        _read(times)
    assert words in str(refusal.value)
    assert "a.csv" in str(refusal.value)


WANDERS: dict[str, tuple[Times, str]] = {
    # 2000 steps of 10 ms and 1999 of 11 ms: 10.49987 ms on average, so 256 of the latter are 2.816 s for 2.68797.
    "slower from the middle": (np.repeat([0.01, 0.011], [2000, 1999]), "take 2.816 s where 2.68797 s ± 0.65 %"),
    "for a while only": (np.repeat([0.01, 0.0115, 0.01], [1000, 600, 2399]), "take 2.944 s where 2.6176"),
    "steadily": (0.01 * np.linspace(0.95, 1.05, ROWS - 1), "rows 1 to 257 take 2.440"),
    "at the very end": (np.repeat([0.01, 0.0115], [3840, 159]), "rows 3841 to 4000 take 1.8285 s where 1.59948 s"),
}


@pytest.mark.parametrize("kind", WANDERS)
@pytest.mark.parametrize("block_bytes", [100, 1000, 4 * 1024 * 1024])
def test_a_rate_that_wanders_is_refused_though_no_step_is_a_gap(
    monkeypatch: pytest.MonkeyPatch, block_bytes: int, kind: str
) -> None:
    monkeypatch.setattr("bench_service.formats.delimited._BLOCK_BYTES", block_bytes)
    steps, words = WANDERS[kind]
    with pytest.raises(UnfitRecording) as refusal:
        _read(_from_steps(steps))
    assert "a.csv: the rate is not uniform: rows " in str(refusal.value)
    assert words in str(refusal.value)


def test_a_wander_within_the_tolerance_is_accepted_as_the_mean_rate() -> None:
    # ± 0.3 % about 100 Hz; the default allows 0.5 %.
    steps = 0.01 * (1.0 + 0.003 * np.sign(np.sin(np.arange(ROWS - 1) / 500.0)))
    assert _read(_from_steps(steps)).rate_hz == pytest.approx((ROWS - 1) / steps.sum(), rel=1e-9)
    with pytest.raises(UnfitRecording, match="the rate is not uniform"):
        _read(_from_steps(steps), rate_tolerance=1e-4)


@pytest.mark.parametrize("rows", [2, 3, 33, 256, 257, 258, 512, 513, 514])
def test_short_uniform_columns_pass(rows: int) -> None:
    assert _read(UNIFORM[:rows]).rate_hz == pytest.approx(100.0)


@pytest.mark.parametrize("rate_hz", [240.0, 256.0, 300.0, 333.3, 400.0, 800.0, 1200.0])
def test_times_rounded_to_milliseconds_have_no_gap(rate_hz: float) -> None:
    times = np.round(np.arange(ROWS) * 1000.0 / rate_hz)
    recording = _read(times, time_unit="ms")
    # The first and the last stamp are each off by half a millisecond at most.
    assert recording.rate_hz == pytest.approx(rate_hz, rel=1e-3 * rate_hz / (ROWS - 1))
    assert recording.source["clock"]["lost_samples"] == 0


def test_a_stamp_that_is_early_is_said_and_no_loss() -> None:
    recording = _read(_changed(1234, UNIFORM[1233]))
    assert recording.count == ROWS
    assert recording.source["warnings"] == [
        "stamps are late or early in 1 place, the most by 1 sample periods (first in row 1236), with no sample lost"
    ]


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_time_that_is_no_number_is_named(value: float) -> None:
    with pytest.raises(UnreadableFile, match=r"line 7, column 't': '(nan|inf)' where a finite number"):
        _read(_changed(5, value))


def test_a_wrong_unit_of_time_shows_against_the_declared_rate() -> None:
    with pytest.raises(BadParameter, match=r"rate_hz = 100\.0: the time column of a\.csv says 0\.1 Hz"):
        _read(UNIFORM * 1000.0, rate_hz=100.0)
