"""Calibration by measured angles: a table that stops beside its demand, whose encoders know where it stands."""

from dataclasses import replace

import numpy as np
import pytest

from procedures.analysis.measured_stations import angle_difference_deg, at_measured_angles
from procedures.bench.description import TableAccuracy
from procedures.catalog.calibration_12_orientations import PROCEDURE
from procedures.core.measured import Measured, MeasuredAngles
from procedures.core.recording import MemoryRecording, Recording
from procedures.core.table_angles import TableAngles
from procedures.inspection import analyse_procedure
from procedures.procedure import Context
from tests.kit.forward_model import CHANNELS, K_ACCELEROMETER, Table, station_recordings

ARCSEC = 1.0 / 3600.0


def _beside(recording: Recording, errors: np.ndarray) -> MemoryRecording:
    """The recording with encoders that show the true angles."""
    assert isinstance(recording, MemoryRecording)
    station = recording.info.station
    assert station is not None
    a = station.angles
    assert a is not None
    true = TableAngles(*(np.array([a.outer_deg, a.middle_deg, a.inner_deg]) + errors))
    measured = Measured(MeasuredAngles(true, TableAngles(), 5))
    return replace(recording, info=replace(recording.info, measured=measured))


@pytest.fixture
def made(context: Context) -> tuple[Context, list[MemoryRecording]]:
    """Twelve stations that each stop some 200 arcsec beside their demand."""
    params = PROCEDURE.resolve(PROCEDURE.params(), context)
    stations, errors = PROCEDURE.schedule(params), []
    rng = np.random.default_rng(11)

    def pointing() -> np.ndarray:
        errors.append(rng.normal(0.0, 200.0 * ARCSEC, 3))
        return errors[-1]

    recordings = station_recordings(stations, CHANNELS, table=Table(pointing=pointing))
    return context, [_beside(r, e) for r, e in zip(recordings, errors, strict=True)]


def _matrix_error(context: Context, recordings: list[MemoryRecording], measured: bool) -> tuple[float, tuple[str, ...]]:
    accuracy = TableAccuracy(0.0, 0.5 if measured else 200.0, 0.0, measured)
    there = replace(context, bench=replace(context.bench, accuracy=accuracy))
    outcome = analyse_procedure(PROCEDURE, recordings, PROCEDURE.resolve(PROCEDURE.params(), there), there)
    found = next(c for c in PROCEDURE.calibrations(outcome) if c.triad == "accelerometer")
    return float(np.max(np.abs(found.matrix_array - K_ACCELEROMETER))), outcome.warnings


def test_measured_angles_give_the_matrix_that_commanded_ones_miss(made) -> None:
    context, recordings = made
    by_demand, said_not = _matrix_error(context, recordings, False)
    by_encoders, said = _matrix_error(context, recordings, True)
    # 200 arcsec are 9.7e-4 rad; cross-couplings by demand err by about that over √12 a term, some 3e-4 · 0.85.
    assert by_demand > 1e-4
    assert by_encoders < by_demand / 50.0
    assert "measured" not in " ".join(said_not)
    assert said[0] == "the angles are those that the table's encoders measured, at all 12 stations"


def test_a_station_without_readings_keeps_the_commanded_angles_and_is_counted(made) -> None:
    _, recordings = made
    found, sentence = at_measured_angles(
        [replace(recordings[0], info=replace(recordings[0].info, measured=None)), recordings[1]]
    )
    assert "at 1 of 2 stations" in sentence
    assert found[0].info.station == recordings[0].info.station
    assert found[1].info.station != recordings[1].info.station


def test_whole_turns_of_an_encoder_change_nothing(made) -> None:
    _, recordings = made
    info = recordings[0].info
    assert info.measured is not None
    angles = info.measured.angles
    assert angles is not None
    turned = replace(angles, mean=replace(angles.mean, outer_deg=angles.mean.outer_deg + 360.0))
    other = replace(recordings[0], info=replace(info, measured=Measured(turned)))
    (a, b), _ = at_measured_angles([recordings[0], other])
    assert a.info.station is not None
    assert b.info.station is not None
    assert a.info.station.angles is not None
    assert b.info.station.angles is not None
    assert b.info.station.angles.outer_deg == pytest.approx(a.info.station.angles.outer_deg, abs=1e-9)
    assert (angle_difference_deg(359.0, 1.0), angle_difference_deg(-179.0, 179.0)) == (-2.0, 2.0)
