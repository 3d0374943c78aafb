"""Ferraris' calibration (Ferraris 1995): six faces, each at rest and through whole turns there and back, both triads.

Each axis of the unit points upwards and downwards along the table's outer axis. The accelerometers have b and K from
the rests (gravity), the gyros b from the rests and the sums of turns there and back, K from their differences. One
generalised least squares has all of it: a rest is a station of no turn, ``y = b·T + K·E`` with E the Earth's turn
meanwhile (see `fit`).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from procedures.analysis.calibration.station_means import StationMeans, station_means
from procedures.analysis.calibration.station_noise import triad_covariance
from procedures.analysis.calibration.table_errors import TableErrors, TableUncertainty, table_errors
from procedures.analysis.turns.fit import TurnEstimator, Turning, fitted, turn_estimator, turn_flaws, turning
from procedures.analysis.turns.summary import WholeTurns, require_turns, whole_turns, with_budgets
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.frames import earth_rate_b, table_rotation
from procedures.core.recording import Recording, Station
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles
from procedures.core.turn import Turn
from procedures.core.unit import TriadRecord

FACES = {
    "x up": TableAngles(0.0, 90.0, 0.0),
    "x down": TableAngles(0.0, -90.0, 0.0),
    "y up": TableAngles(),
    "y down": TableAngles(0.0, 0.0, 180.0),
    "z up": TableAngles(0.0, 0.0, -90.0),
    "z down": TableAngles(0.0, 0.0, 90.0),
}
"""Attitude of the table for each face: that axis of the unit along the outer axis."""
END_REST_S = 2.0
"""Rest at the end of a recording of turns [s]."""


def face_stations(
    rest_s: float, turns: int, rate_deg_s: float, ramp_s: float, settle_s: float, end_rest_s: float = END_REST_S
) -> tuple[Station, ...]:
    """Return the stations of each face in turn: at rest, then whole turns there and back, each recording ending at rest
    for `end_rest_s`.
    """
    made: list[Station] = []
    for face, angles in FACES.items():
        made.append(Station(len(made), f"{face} at rest", angles, None, settle_s, rest_s))
        for sign in (1, -1):
            turn = Turn("outer", sign * turns, rate_deg_s, ramp_s)
            label = f"{face} {sign * rate_deg_s:+g} deg/s, {turn.turns:+d} turns"
            made.append(Station(len(made), label, angles, None, settle_s, turn.duration_s + end_rest_s, turn=turn))
    return tuple(made)


def rests_and_turns(stations: Sequence[Station], seconds: Array, site: Site) -> Turning:
    """Return the motion of stations of which some turn and some rest, in their order. Raises `BadParameter` as
    `turning`.
    """
    turns = [s.turn is not None for s in stations]
    moving = turning([s for s in stations if s.turn is not None], np.asarray(seconds)[turns], site)
    angles = tuple(s.angles or TableAngles() for s in stations)
    axis = np.array([table_rotation(a).inv().apply([0.0, 1.0, 0.0]) for a in angles])
    earth = earth_rate_b(list(angles), site) * np.asarray(seconds)[:, None]
    earth[turns] = moving.earth_rad
    n = len(stations)
    angle, rate, moments = np.zeros(n), np.zeros(n), np.zeros((n, 3))
    angle[turns], rate[turns], moments[turns] = moving.angle_rad, moving.rate_rad_s, moving.moments
    rates = earth_rate_b(list(angles), site)
    return Turning(np.asarray(seconds, dtype=np.float64), axis, angle, rate, earth, moments, angles, rates)


def ferraris_flaws(motion: Turning, uncertainty: TableUncertainty) -> TableErrors:
    """Return the flaws of the turned angles as of whole turns, and of the Earth's turn at rest by all that the table
    declares.
    """
    made = turn_flaws(motion, uncertainty)
    rest = motion.angle_rad == 0.0
    of_rest = table_errors(motion.angles, motion.earth_rad, uncertainty, of_gravity=False)
    made.sensitivity[rest] = of_rest.sensitivity[rest]
    sd = np.where(of_rest.sd > 0.0, of_rest.sd, made.sd)
    return replace(made, sd=sd)


def ferraris_estimator(motion: Turning, noise: Array | None, flaws: TableErrors, matrix: Array) -> TurnEstimator:
    """Estimator of b and K over rests and turns; `noise` (3, n, n) of the station means. Raises `Undetermined`.

    `flaws`: those of the table on this motion (`ferraris_flaws`).
    """
    slopes = motion.axis_b @ matrix.T
    return turn_estimator(motion, slopes, (), units.DEG, noise, flaws, matrix)


def analyse_ferraris(
    recordings: Sequence[Recording], site: Site, uncertainty: TableUncertainty, record: TriadRecord | None
) -> WholeTurns:
    """Return the gyro triad from recordings of faces at rest and turning. Raises `UnfitRecording`, `Undetermined`.
    `record`: the gyros' noise; None: the residuals stand in.
    """
    means = station_means(recordings, "gyro")
    if means.output_unit != "rad/s":
        raise UnfitRecording(f"the gyro channels are in {means.output_unit}: whole turns need a nominal scale in rad")
    stations = faces_of(recordings)
    seconds = means.windows[:, 1] - means.windows[:, 0]
    motion = rests_and_turns(stations, seconds, site)
    outputs = means.outputs * seconds[:, None]
    turns = motion.angle_rad != 0.0
    labels = [label for label, turned in zip(means.labels, turns, strict=True) if turned]
    require_turns(only(motion, turns), outputs[turns], labels)
    noise = triad_covariance(record, means.windows)
    flaws = ferraris_flaws(motion, uncertainty)
    first = ferraris_estimator(motion, None, flaws, np.eye(3))
    matrix = (first.gain @ outputs.T.ravel()).reshape(3, 4)[:, 1:]
    fit = fitted(ferraris_estimator(motion, noise, flaws, matrix), outputs, noise is not None)
    found = whole_turns(fit, (), motion, outputs, np.flatnonzero(turns).tolist(), noise is not None)
    return with_budgets(found, fit, record, means.windows, flaws)


def faces_of(recordings: Sequence[Recording]) -> list[Station]:
    """Return the stations of the recordings, some at rest and some of whole turns. Raises `UnfitRecording`."""
    stations = [r.info.station for r in recordings]
    for recording, station in zip(recordings, stations, strict=True):
        if station is None or station.angles is None:
            raise UnfitRecording(f"recording {recording.info.id}: its table angles are not known")
    found = [s for s in stations if s is not None]
    for kind, count in (("at rest", sum(s.turn is None for s in found)), ("of whole turns", _turning(found))):
        if count == 0:
            raise UnfitRecording(f"there is no recording {kind}: rests give the bias, turns the scale factors")
    return found


def rests(recordings: Sequence[Recording]) -> list[Recording]:
    """Return the recordings at rest, for the accelerometers."""
    return [r for r in recordings if r.info.station is not None and r.info.station.turn is None]


def rest_means(recordings: Sequence[Recording]) -> StationMeans:
    """Return the means of the accelerometers over the faces at rest. Raises `UnfitRecording`, `MissingChannel`."""
    return station_means(rests(recordings), "accelerometer")


def only(motion: Turning, which: Array) -> Turning:
    """Return the motion of the stations that a mask (n,) selects."""
    angles = tuple(a for a, taken in zip(motion.angles, which, strict=True) if taken)
    fields = ("seconds", "axis_b", "angle_rad", "rate_rad_s", "earth_rad", "moments", "earth_rate_b")
    return replace(motion, **{name: getattr(motion, name)[which] for name in fields}, angles=angles)


def _turning(stations: Sequence[Station]) -> int:
    return sum(s.turn is not None for s in stations)
