"""Series of a run for figures, the regimes that the indicator found on its ramps, and Allan deviations before and
after.
"""

from collections.abc import Sequence
from math import ceil

import numpy as np

from procedures.analysis.allan.deviation import deviation
from procedures.analysis.allan.statistic import OVERLAPPING_ALLAN, Sizes, decade_sizes
from procedures.analysis.thermal.cycle.results import AllanFound, LegRegime, Trace
from procedures.analysis.thermal.cycle.runs import PreparedRun
from procedures.analysis.thermal.judgement import Corrects, Soak
from procedures.analysis.thermal.profile_progress import LegEvidence
from procedures.core.arrays import Array
from procedures.core.recording import AXES

MOST_POINTS = 720
"""Greatest number of points of a series on a page: twelve hours by the minute."""
MOVED_C = 0.02
"""Distance of a set point from its start and its target beyond which it is on a ramp."""
SURE = 0.997
"""Confidence of the intervals that a rise of the Allan deviation is judged by."""
POINTS_PER_DECADE = 5


def trace(run: PreparedRun, judged: Corrects, plain: Corrects, reference: Soak, gravity_m_s2: float) -> Trace:
    """Return the trace of a run in at most `MOST_POINTS`; `plain` is the correction without its temperature terms."""
    series = run.series
    before = run.output_m_s2 * judged.scales
    after = judged.apply(run.output_m_s2, run.case_c, run.converter_c, run.dynamic)
    without = plain.apply(run.output_m_s2, run.case_c, run.converter_c, run.dynamic)
    rows = round(run.cells.cell_s / series.sample_s)
    zero = slice(reference.start * rows, reference.stop * rows)
    size = ceil(len(series.air_c) / MOST_POINTS)

    def points(values: Array) -> tuple[float, ...]:
        count = len(values) // size
        return tuple(values[: count * size].reshape(count, size).mean(axis=1).tolist())

    def columns(values: Array) -> tuple[tuple[float, ...], ...]:
        return tuple(points(values[:, i]) for i in range(values.shape[1]))

    return Trace(
        points(series.t_s),
        tuple(share > 0.0 for share in points(run.dynamic.astype(np.float64))),
        columns(series.sensors_c),
        points(series.air_c),
        points(series.set_point_c),
        points(run.trace.acceleration_c_s2),
        columns(before - before[zero].mean(axis=0)),
        columns(after - after[zero].mean(axis=0)),
        points(np.linalg.norm(without, axis=1) - gravity_m_s2),
        points(np.linalg.norm(after, axis=1) - gravity_m_s2),
    )


def leg_regimes(run: PreparedRun, delay_s: float) -> tuple[LegRegime, ...]:
    """Return the regime switching of each leg; `delay_s` is the allowed delay of the indicator."""
    return tuple(_leg_regime(run, leg, delay_s) for leg in run.series.legs)


def _leg_regime(run: PreparedRun, leg: LegEvidence, delay_s: float) -> LegRegime:
    sample_s = run.series.sample_s
    first, last = round(leg.began_s / sample_s), min(round(leg.ended_s / sample_s), len(run.dynamic))
    set_point, dynamic = run.series.set_point_c[first:last], run.dynamic[first:last]
    # The chamber is asked once a block, so its ramp is seen late; it is commanded when the leg begins.
    before = run.series.set_point_c[max(first - 1, 0)]
    ramp_began_s = leg.began_s if abs(before - leg.target_c) > MOVED_C else None
    there = np.flatnonzero(np.abs(set_point - leg.target_c) <= MOVED_C)
    ramp_ended_s = None if ramp_began_s is None or not len(there) else leg.began_s + float(there[0]) * sample_s
    changes = np.flatnonzero(np.diff(dynamic.astype(np.int8))) + 1
    to_dynamic = [leg.began_s + float(k) * sample_s for k in changes if dynamic[k]]
    to_static = [leg.began_s + float(k) * sample_s for k in changes if not dynamic[k]]
    explained_s = -np.inf if ramp_ended_s is None else ramp_ended_s + delay_s
    dynamic_s = to_dynamic[0] if to_dynamic and to_dynamic[0] <= explained_s else None
    return LegRegime(
        ramp_began_s,
        ramp_ended_s,
        dynamic_s,
        to_static[-1] if to_static and not dynamic[-1] else None,
        None if dynamic_s is None or ramp_began_s is None else dynamic_s - ramp_began_s,
        sum(t > explained_s for t in to_dynamic),
    )


def allan_of(run: PreparedRun, judged: Corrects) -> tuple[AllanFound, ...]:
    """Return overlapping Allan deviations of outputs and of corrected forces over the whole run (thesis fig. 4.15)."""
    before = run.output_m_s2 * judged.scales
    after = judged.apply(run.output_m_s2, run.case_c, run.converter_c, run.dynamic)
    rate_hz = 1.0 / run.series.sample_s
    sizes: Sizes = decade_sizes(OVERLAPPING_ALLAN.largest(len(after)), 1.0 / POINTS_PER_DECADE)
    answers: list[AllanFound] = []
    for axis, name in enumerate(AXES):
        old = deviation(before[:, axis] - before[:, axis].mean(), rate_hz, sizes=sizes, confidence=SURE)
        new = deviation(after[:, axis] - after[:, axis].mean(), rate_hz, sizes=sizes, confidence=SURE)
        lists = (new.tau_s, old.deviation, new.deviation, new.lower, new.upper)
        tau, d_before, d_after, lower, upper = (tuple(v.tolist()) for v in lists)
        answers.append(AllanFound(run.series.name, name, tau, d_before, d_after, lower, upper, rise(lower, upper)))
    return tuple(answers)


def rise(lower: Sequence[float], upper: Sequence[float]) -> float:
    """Return the largest ratio of an interval's lower end to the least upper end at any shorter time: above 1 the curve
    rises. 0 of a single point.
    """
    least = np.minimum.accumulate(np.asarray(upper, dtype=np.float64))[:-1]
    return float(np.max(np.asarray(lower, dtype=np.float64)[1:] / least, initial=0.0))
