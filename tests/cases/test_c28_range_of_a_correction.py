"""A thermal correction knows where it was fitted: used elsewhere it warns, used twice it is refused.

The unit's truth is a cubic; the correction, as the product has it, is of the second order and was fitted to a part of
the cubic's range, so beyond that part it is wrong by the cubic term.
"""

import numpy as np
import pytest
from pydantic import TypeAdapter

from procedures.analysis.calibration.reference_temperature import bring_to_reference, thermal_warnings
from procedures.analysis.calibration.station_means import station_means
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.recording import Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.core.thermal_correction import AxisCorrection, TemperatureRange, ThermalCorrection

CUBIC = np.array([-4.0e-7, 3.0e-6, 2.0e-4])
"""m/s² of (T − reference)³, ², ¹."""
CHANNELS = (
    *(Channel(f"accelerometer_{a}", Quantity.SPECIFIC_FORCE, "m/s^2") for a in "xyz"),
    *(Channel(f"temperature_{n}", Quantity.TEMPERATURE, "degC") for n in ("case", "converter")),
)
SEEN = TypeAdapter(ThermalCorrection)


def drift(celsius: np.ndarray | float, reference: float) -> np.ndarray:
    return np.polyval([*CUBIC, 0.0], np.asarray(celsius) - reference)


def fitted(low: float, high: float, reference: float) -> ThermalCorrection:
    """The best parabola through the cubic over a range, as ``V + B0 + β1·Δt + β2·Δt²``."""
    t = np.linspace(low, high, 200) - reference
    (square, line), *_ = np.linalg.lstsq(np.column_stack([t**2, t]), np.polyval([*CUBIC, 0.0], t), rcond=None)
    axis = AxisCorrection(1.0, 0.0, beta=(-line, -square, 0.0, 0.0), case_reference_c=reference)
    return ThermalCorrection(
        "accelerometer", (axis, axis, axis), fitted_range=TemperatureRange((low, high), (low - 1.0, high + 1.0))
    )


def at(celsius: float, reference: float, rng: np.random.Generator) -> list[MemoryRecording]:
    """Six faces up at one temperature, a minute each at 5 Hz."""
    made = []
    for i, face in enumerate(np.vstack([np.eye(3), -np.eye(3)]) * 9.81):
        force = face + drift(celsius, reference) + rng.normal(0.0, 1e-6, (300, 3))
        sensors = celsius + rng.normal(0.0, 0.01, (300, 2))
        info = RecordingInfo(f"r{i}", "U", CHANNELS, 5.0, 300, 70.0 * i)
        made.append(MemoryRecording(info, np.hstack([force, sensors])))
    return made


@pytest.mark.parametrize("seed", range(20))
def test_within_its_range_it_corrects_in_silence_and_beyond_it_warns(seed: int) -> None:
    rng = np.random.default_rng([28, seed])
    low = rng.uniform(-40.0, 20.0)
    high = low + rng.uniform(15.0, 40.0)
    reference = rng.uniform(low, high)
    correction = fitted(low, high, reference)
    celsius = rng.uniform(low - 40.0, high + 40.0)
    recordings = at(celsius, reference, rng)
    brought = bring_to_reference(recordings, station_means(recordings, "accelerometer"), correction, (0.0, 0.0))
    wrong = float(np.abs(brought.means.outputs - np.vstack([np.eye(3), -np.eye(3)]) * 9.81).max())
    said = [w for w in thermal_warnings(brought) if "beyond the range" in w]
    outside = max(low - celsius, celsius - high)
    if outside > 1.1:
        assert len(said) == 1
        assert f"up to {outside:.1f}"[:-2] in said[0]
        assert f"case {low:.1f} … {high:.1f} °C" in said[0]
    elif outside < 0.9:
        assert said == []
        inside = np.linspace(low, high, 200)
        worst = np.abs(
            drift(inside, reference)
            + np.polyval([correction.axes[0].beta[1], correction.axes[0].beta[0], 0], inside - reference)
        ).max()
        assert wrong <= worst + 2e-5


def test_a_second_use_is_refused() -> None:
    rng = np.random.default_rng(29)
    correction = fitted(0.0, 40.0, 20.0)
    recordings = at(30.0, 20.0, rng)
    once = bring_to_reference(recordings, station_means(recordings, "accelerometer"), correction, (0.0, 0.0))
    with pytest.raises(UnfitRecording, match=r"already brought to 20 °C \(case\).*applied once"):
        bring_to_reference(recordings, once.means, correction, (0.0, 0.0))


def test_range_and_reference_travel_with_the_coefficients() -> None:
    correction = fitted(0.0, 40.0, 20.0)
    assert SEEN.validate_json(SEEN.dump_json(correction)) == correction


def test_an_older_correction_without_a_range_says_so() -> None:
    rng, correction = np.random.default_rng(30), fitted(0.0, 40.0, 20.0)
    older = SEEN.dump_python(correction, mode="json")
    del older["fitted_range"]
    recordings = at(30.0, 20.0, rng)
    read = SEEN.validate_python(older)
    brought = bring_to_reference(recordings, station_means(recordings, "accelerometer"), read, (0.0, 0.0))
    assert any("does not say at which temperatures" in w for w in thermal_warnings(brought))


@pytest.mark.parametrize("pair", [(40.0, 0.0), (float("nan"), 1.0)])
def test_a_range_is_two_temperatures_in_order(pair: tuple[float, float]) -> None:
    with pytest.raises(BadParameter, match="case_c"):
        TemperatureRange(pair, (0.0, 1.0))
