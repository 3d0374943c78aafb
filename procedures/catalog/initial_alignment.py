"""Initial alignment on the bench, repeated and predicted (thesis 1.1; textbook S 3.163-3.166).

The unit rests at known attitudes, aligns itself from its corrected means, is switched off and does it again. The
errors against the table and its azimuth are judged by what calibration, launches, noise and table let expect; the
azimuth error of thesis 1.1, which covers only the noise within a launch, is reported as well.
"""

from collections.abc import AsyncIterator, Sequence
from typing import Annotated

from pydantic import Field

from procedures import steps
from procedures.analysis.calibration.reference import TRIAD_NAMES
from procedures.analysis.calibration.station_plan import windows
from procedures.analysis.navigation.alignment import ThesisPrediction, require_alignable, thesis_prediction
from procedures.analysis.repeated_alignment.expected import (
    ANGLES,
    TABLE,
    ExpectedErrors,
    expected_errors,
    planned_alignments,
    rms_deg,
)
from procedures.analysis.repeated_alignment.observed import (
    Alignment,
    AngleErrors,
    alignment_errors,
    alignments_for_display,
    found_attitudes,
    judged_angle,
    recorded_alignments,
)
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core import units
from procedures.core.errors import BadParameter
from procedures.core.limits import Check, PlannedCheck, check, verdict
from procedures.core.recording import Recording, Station
from procedures.core.report import Report
from procedures.core.table_angles import TableAngles
from procedures.parameters import largest, level_check, planned_tests
from procedures.procedure import Context, Outcome, Parameters, PredictedUncertainty, Prediction, Procedure
from procedures.reports import repeated_alignment as pictures
from procedures.site_parameters import TableParameters, declared_table

MOST_ALIGNMENTS = 500
"""Their errors' covariance is a full matrix."""

Angle = Annotated[float, Field(ge=-360.0, le=360.0)]


class Limits(Parameters):
    """Requirements on the alignment and its agreement with the prediction (this program's own, none in the thesis)."""

    heading_sd_max_deg: float = Field(0.1, gt=0.0, le=180.0, description="expected of one alignment's heading")
    prediction_p_value_min: float = Field(
        0.001, ge=0.0, le=1.0, description="smallest p-value accepted for the chi-square of the errors"
    )


class Params(TableParameters):
    """Attitudes, durations and number of the alignments. None takes the bench's value."""

    orientations: tuple[tuple[Angle, Angle, Angle], ...] = Field(
        ((0.0, 0.0, 0.0),),
        min_length=1,
        max_length=50,
        description="(outer, middle, inner) [deg] of each round; level: heading = azimuth − outer",
    )
    repetitions: int = Field(5, ge=1, le=300, description="rounds through the orientations")
    alignment_s: float = Field(600.0, ge=1.0, le=86_400.0, description="time averaged for one alignment")
    off_time_s: float = Field(
        60.0, ge=0.0, le=604_800.0, description="switched off before each alignment; 0: all of them in one launch"
    )
    settle_s: float = Field(2.0, ge=0.0, le=86_400.0, description="at rest before the first sample")
    base_turn_arcsec: float = Field(0.0, ge=0.0, le=3600.0, description="turn of the base meanwhile, for thesis 1.1")
    limits: Limits = Field(default_factory=lambda: Limits.model_validate({}))


class Result(Outcome):
    """Result of every alignment, and each angle's errors with their prediction."""

    basis: str
    alignments: tuple[Alignment, ...]
    angles: tuple[AngleErrors, AngleErrors, AngleErrors]
    """Errors of heading, pitch and roll."""
    thesis: ThesisPrediction | None


def resolve(params: Params, context: Context) -> Params:
    """Return the parameters with site and table accuracy from the bench."""
    return params.filled(declared_table(context))


def schedule(params: Params) -> tuple[Station, ...]:
    """Return the stations, round after round through the orientations, one an alignment. Raises `BadParameter` for too
    many.
    """
    wanted = params.repetitions * len(params.orientations)
    if wanted > MOST_ALIGNMENTS:
        raise BadParameter("repetitions", params.repetitions, f"{wanted} alignments, {MOST_ALIGNMENTS} are the most")
    places = [place for _ in range(params.repetitions) for place in params.orientations]
    return tuple(
        Station(
            i,
            f"alignment {i + 1}",
            TableAngles(*place),
            None,
            params.settle_s,
            params.alignment_s,
            power_off_s=params.off_time_s,
        )
        for i, place in enumerate(places)
    )


def predict(params: Params, context: Context) -> Prediction:
    """Return duration and the errors to expect. Raises `BadParameter` at a pole or for an attitude on end,
    `NoCalibration`.
    """
    params = resolve(params, context)
    site, stations, axes = params.site(context), schedule(params), context.bench.axis_motion
    require_alignable(site.latitude_deg)
    expected = expected_errors(planned_alignments(context.unit, site, params.table(site), stations, axes))
    found = [_predicted(angle, expected) for angle in range(3)]
    thesis = thesis_prediction(context.unit, site, params.base_turn_arcsec, params.alignment_s)
    if thesis is not None:
        names = (("added", thesis.added_deg), ("independent", thesis.independent_deg))
        found += [
            PredictedUncertainty(f"heading by thesis 1.1, {how}", "rad", value * units.DEG, value * units.DEG)
            for how, value in names
        ]
    duration_s = float(windows(stations, axes)[-1, 1])
    return Prediction(duration_s, tuple(found), _warnings(params, context, expected), _basis(context))


async def acquire(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    """Switch off and on, turn to the orientation, record, alignment after alignment; yield the stream of each."""
    for station in stations:
        yield await steps.record_station(bench, station)


def analyse(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    """Return the alignment from each recording's corrected means, and all errors judged together. Raises as `predict`,
    `UnfitRecording`.
    """
    params = resolve(params, context)
    site = params.site(context)
    plan = recorded_alignments(recordings, context.unit, site, params.table(site))
    expected = expected_errors(plan)
    found = found_attitudes(recordings, plan)
    errors = alignment_errors(found, plan)
    heading, pitch, roll = (judged_angle(angle, errors, expected) for angle in range(3))
    checks = _checks((heading, pitch, roll), params.limits)
    return Result(
        checks=checks,
        verdict=verdict(checks),
        warnings=_warnings(params, context, expected),
        basis=_basis(context),
        alignments=alignments_for_display(recordings, plan, found, errors, expected),
        angles=(heading, pitch, roll),
        thesis=thesis_prediction(context.unit, site, params.base_turn_arcsec, params.alignment_s),
    )


def report(result: Result) -> Report:
    """Return the report of found and predicted errors, the source of the prediction, and every alignment."""
    sections = (
        pictures.errors_table(result.angles),
        pictures.sources_table(result.angles),
        pictures.heading_figure(result.alignments),
        pictures.alignments_table(result.alignments),
    )
    return Report(f"{result.basis}. {pictures.sentence(result.angles[0], result.thesis)}", sections)


def _predicted(angle: int, expected: ExpectedErrors) -> PredictedUncertainty:
    whole, table = rms_deg(expected.of_angle(angle)) * units.DEG, rms_deg(expected.part(TABLE, angle)) * units.DEG
    of_unit = max(0.0, whole**2 - table**2) ** 0.5
    return PredictedUncertainty(f"{ANGLES[angle]} of one alignment", "rad", whole, of_unit, table)


def _warnings(params: Params, context: Context, expected: ExpectedErrors) -> tuple[str, ...]:
    heading, most = rms_deg(expected.of_angle(0)), params.limits.heading_sd_max_deg
    found: list[str] = []
    if heading > most:
        found.append(
            f"heading: the limit of {most:g} deg cannot be reached, one alignment's standard uncertainty is "
            f"{heading:.3g} deg"
        )
    if not expected.noise_known:
        found.append("the noise of a triad is not known: the errors are not judged by a prediction")
    for triad in ("gyro", "accelerometer"):
        record = context.unit.triad(triad)
        if record is not None and record.bias_run_to_run_sd == 0.0:
            found.append(
                f"nothing is known of how the {triad} biases change from launch to launch: the prediction holds only "
                "for the launch of the calibration"
            )
    return tuple(found)


def _basis(context: Context) -> str:
    return f"Aligned with {context.unit.calibration_in_words(*TRIAD_NAMES)}"


HEADING = "heading, expected standard uncertainty of one alignment"
AS_PREDICTED = "errors as predicted, p-value of chi-square"


def planned_checks(params: Params, context: Context) -> tuple[PlannedCheck, ...]:
    """Return the planned checks of the heading's uncertainty, and of the errors of each angle. Raises as `predict`."""
    params = resolve(params, context)
    site, stations, axes = params.site(context), schedule(params), context.bench.axis_motion
    expected = expected_errors(planned_alignments(context.unit, site, params.table(site), stations, axes))
    limit = largest(params.limits, "heading_sd_max_deg", "deg")
    heading = PlannedCheck(HEADING, limit, expected=rms_deg(expected.of_angle(0)))
    tests = (f"{angle} {AS_PREDICTED}" for angle in ANGLES)
    known = expected.noise_known
    return (heading, *(planned_tests(params.limits, "prediction_p_value_min", *tests) if known else ()))


def _checks(angles: Sequence[AngleErrors], limits: Limits) -> tuple[Check, ...]:
    found = [check(HEADING, angles[0].expected_sd_deg, largest(limits, "heading_sd_max_deg", "deg"))]
    found += [
        level_check(limits, "prediction_p_value_min", f"{a.angle} {AS_PREDICTED}", a.p_value)
        for a in angles
        if a.p_value is not None
    ]
    return tuple(found)


PROCEDURE = Procedure(
    "initial_alignment",
    "Initial alignment, repeated",
    "1.0.0",
    Params,
    Result,
    resolve,
    schedule,
    predict,
    acquire,
    analyse,
    report,
    uses_calibration=TRIAD_NAMES,
    quantities=lambda _params, _context: (HEADING, *(f"{angle} {AS_PREDICTED}" for angle in ANGLES)),
    planned_checks=planned_checks,
)
