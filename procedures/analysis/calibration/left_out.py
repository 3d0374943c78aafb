"""Out-of-sample magnitudes of a calibration: each station corrected with the coefficients of all the others.

The thesis's Tables 5.3 and 5.4 are in sample: their twelve orientations are those that made the coefficients, and least
squares makes the mean error small by itself. Leaving one station out at a time shows what the coefficients are worth
where they were not made, from the same recordings.
"""

from collections.abc import Sequence

import numpy as np

from procedures.analysis.calibration.estimator import estimator
from procedures.analysis.calibration.multiposition import TriadFit
from procedures.analysis.calibration.verification import Magnitudes
from procedures.core.arrays import Array
from procedures.core.errors import Undetermined
from procedures.core.imu_model import correct, triad_calibration

LEAST_STATIONS = 6
"""Least number of stations of which one may be left out: five remain for four coefficients a channel."""


def left_out_magnitudes(
    fit: TriadFit, vectors: Array, outputs: Array, reference: float, labels: Sequence[str]
) -> Magnitudes | None:
    """Statistics of |v̂| where each station i is corrected by the fit without it, over outputs (n, 3).

    The weights are those of the whole fit: noise, and the table's flaws where they count. None where the stations are
    few, or where the others do not determine every coefficient without one of them.
    """
    n = len(outputs)
    if n < LEAST_STATIONS:
        return None
    flaws = fit.of_table if fit.weighting == "noise_and_table" else None
    found: list[float] = []
    for i in range(n):
        others = np.arange(n) != i
        try:
            plan = estimator(
                f"the {fit.triad} coefficients",
                vectors[others],
                fit.station_noise[:, others][:, :, others],
                None if flaws is None else flaws[others],
            )
        except Undetermined:
            return None
        coefficients = plan.coefficients(outputs[others])
        made = triad_calibration(fit.triad, fit.output_unit, fit.input_unit, coefficients, fit.covariance)
        found.append(float(np.linalg.norm(correct(outputs[i], made))))
    before = None if fit.output_unit == "count" else np.linalg.norm(outputs, axis=1)
    return _statistics(fit, before, np.array(found), reference, labels)


def _statistics(
    fit: TriadFit, before: Array | None, after: Array, reference: float, labels: Sequence[str]
) -> Magnitudes:
    """Statistics of given magnitudes (n,) before and after correction."""
    sd = float(np.std(after, ddof=1))
    return Magnitudes(
        fit.triad,
        fit.input_unit,
        reference,
        tuple(labels),
        None if before is None else tuple(before.tolist()),
        tuple(after.tolist()),
        (),
        None if before is None else float(np.mean(before) - reference),
        None if before is None else float(np.std(before, ddof=1)),
        float(np.mean(after) - reference),
        sd,
        sd / float(np.sqrt(3.0)),
        sd / float(np.sqrt(3.0) * np.sqrt(2.0 * (len(after) - 1))),
    )
