"""Thermal correction from imported recordings of a cycle: the truth within its claim, one sensor, what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from procedures.core.errors import BadParameter, MissingChannel, UnfitRecording
from procedures.core.limits import Verdict
from procedures.core.recording import ACCELEROMETER, Channel, MemoryRecording, Quantity, Station
from procedures.core.table_angles import TableAngles
from procedures.core.thermal_correction import Form
from procedures.core.unit import Unit
from procedures.methods import discover, thermal_correction_of_recordings
from procedures.methods.thermal_correction_of_recordings import Params, Result
from procedures.procedure import Evidence
from simulators.truth.thermal import UnitThermalTruth
from tests.correction_samples import thermometers
from tests.domain.thermal_samples import recordings, unit_of
from tests.kit.procedures import require_report
from tests.validation.thermal_rig import LAG_S, THESIS_LIKE, G, reference_c, true_coefficients

TRUTH = UnitThermalTruth()
CASE_C, CONVERTER_C = reference_c(TRUTH)
METHOD = discover()["thermal_correction_of_recordings"]
TAKEN = (*ACCELEROMETER, "temperature_case", "temperature_converter")
NAMES = {"temperature_case": "T1", "temperature_converter": "T2"}
UP = ("x", "y", "z")


def parameters(**changes: object) -> Params:
    given = {"up": UP, "gravity_m_s2": G, "case_sensor": "T1", "converter_sensor": "T2", "lag_sd_s": 0.0}
    given |= {"case_lag_s": LAG_S, "converter_lag_s": LAG_S}
    given |= {"reference_case_c": CASE_C, "reference_converter_c": CONVERTER_C}
    return Params.model_validate({**given, **changes})


@pytest.fixture(scope="module")
def imported() -> list[MemoryRecording]:
    """The rig's three runs as files of another maker: five channels, other names, nobody says how the unit stood."""
    found: list[MemoryRecording] = []
    for r in recordings(TRUTH, THESIS_LIKE, 5):
        columns = [r.info.column(name) for name in TAKEN]
        channels = tuple(
            Channel(NAMES.get(c.name, c.name), c.quantity, c.unit, c.scale)
            for c in (r.info.channels[k] for k in columns)
        )
        found.append(MemoryRecording(replace(r.info, channels=channels, station=None), r.raw[:, columns]))
    return found


@pytest.fixture(scope="module")
def result(imported: list[MemoryRecording]) -> Result:
    return thermal_correction_of_recordings.analyse(Evidence(tuple(imported)), parameters(), unit_of(TRUTH, 5))


def test_the_coefficients_are_the_truth_within_their_claim(result: Result) -> None:
    """24 numbers of unit spread, a fixed seed: beyond four once in six hundred sets."""
    assert result.verdict is Verdict.PASS, [c for c in result.checks if not c.passed]
    estimates = np.array([[*a.alpha, *a.beta] for a in result.correction.axes])
    claimed = np.array([a.standard_uncertainties for a in result.axes])
    assert np.abs((estimates - true_coefficients(TRUTH)) / claimed).max() < 4.0
    assert [a.preferred_order for a in result.axes] == [2, 2, 2]
    assert all(a.static_sd_m_s2 is not None and a.static_sd_m_s2 < 0.01 * a.before_sd_m_s2 for a in result.axes)


def test_it_is_a_correction_with_its_range_and_goes_into_the_history(result: Result) -> None:
    (made,) = METHOD.corrections(result)
    assert made.kind == "thermal"
    assert made.thermal is not None
    assert made.thermal.first_stage is not None
    assert made.thermal.fitted_range is not None
    low, high = made.thermal.fitted_range.case_c
    assert low < -25.0
    assert high > 45.0
    assert made.thermal.axes[0].case_reference_c == CASE_C
    assert any("how well the correction repeats" in w for w in result.warnings)
    require_report(METHOD.report(result))


def test_one_sensor_gives_the_single_form(imported: list[MemoryRecording]) -> None:
    """The older model of one sensor leaves on ramps what only both explain; its residuals say so."""
    given = parameters(converter_sensor=None)
    found = thermal_correction_of_recordings.analyse(Evidence(tuple(imported)), given, None)
    assert found.sensors == ("T1",)
    for axis, fit in zip(found.correction.axes, found.axes, strict=True):
        assert axis.form is Form.SINGLE
        assert axis.alpha[:2] == axis.beta[:2] == (0.0, 0.0)
        assert fit.static_sd_m_s2 is not None
        assert fit.dynamic_sd_m_s2 is not None
        assert fit.static_sd_m_s2 < fit.dynamic_sd_m_s2
    assert any("ideal, level" in w for w in found.warnings)


def test_the_lineage_names_what_was_applied(imported: list[MemoryRecording], result: Result) -> None:
    """Thermometers that lack a sensor, and a converter where one sensor explains all, are dropped and not named."""
    assert METHOD.uses_corrections(result) == ("converter",)
    known = thermometers(1).thermometers
    assert known is not None
    both = [replace(sensor, channel=name) for sensor, name in zip(known.sensors, ("T1", "T2"), strict=False)]
    covariance = tuple(row[:4] for row in known.covariance[:4])
    unit = replace(unit_of(TRUTH, 5), thermometers=replace(known, sensors=tuple(both), covariance=covariance))

    def used(unit: Unit, **changes: object) -> tuple[str, ...]:
        found = thermal_correction_of_recordings.analyse(Evidence(tuple(imported)), parameters(**changes), unit)
        return METHOD.uses_corrections(found)

    assert used(unit) == ("thermometers", "converter")
    assert used(replace(unit, thermometers=known)) == ("converter",), "no sensor of these is calibrated"
    assert used(unit, converter_sensor=None) == ("thermometers",)
    assert used(unit, converter=False, thermometers=False) == ()


def test_a_calibration_in_counts_is_said_to_be_left_out(imported: list[MemoryRecording], result: Result) -> None:
    assert not any("ideal, level" in w for w in result.warnings)
    unit = unit_of(TRUTH, 5)
    counted = replace(unit, calibrations=tuple(replace(c, output_unit="count") for c in unit.calibrations))
    found = thermal_correction_of_recordings.analyse(Evidence(tuple(imported)), parameters(), counted)
    assert any("no calibration of its accelerometers in m/s²" in w for w in found.warnings)


def test_each_recording_is_read_once(imported: list[MemoryRecording]) -> None:
    reads: list[str] = []

    class Counted(MemoryRecording):
        def blocks(self):
            reads.append(self.info.id)
            return super().blocks()

    counted = tuple(Counted(r.info, r.raw) for r in imported)
    thermal_correction_of_recordings.analyse(Evidence(counted), parameters(), None)
    assert sorted(reads) == sorted(r.info.id for r in imported)


def test_what_is_refused(imported: list[MemoryRecording]) -> None:
    def refused(match: str, kind: type[Exception], recordings: list[MemoryRecording], **changes: object) -> None:
        with pytest.raises(kind, match=match):
            thermal_correction_of_recordings.analyse(Evidence(tuple(recordings)), parameters(**changes), None)

    refused("no recording", UnfitRecording, [])
    refused("one for each of the 3", BadParameter, imported, up=("x", "y"))
    refused("each of x, y, z upwards", BadParameter, imported, up=("x", "y", "y"))
    refused("has no angles of its own", BadParameter, imported, up=None)
    tilted = Station(0, "tilted", TableAngles(0.0, 45.0, 0.0), None, 0.0, 60.0)
    leaning = [replace(r, info=replace(r.info, station=tilted)) for r in imported]
    refused("no axis of the unit stood upwards", UnfitRecording, leaning, up=None)
    refused("T9", MissingChannel, imported, converter_sensor="T9")
    counts = [
        replace(r, info=replace(r.info, channels=tuple(_in_counts(c) for c in r.info.channels))) for r in imported
    ]
    refused("accelerometer_x is in count", UnfitRecording, counts)


def _in_counts(channel: Channel) -> Channel:
    return channel if channel.quantity is Quantity.TEMPERATURE else replace(channel, unit="count", scale=1.0)
