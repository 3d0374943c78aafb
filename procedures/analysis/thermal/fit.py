"""The coefficients of thesis 4.1 from runs with each axis up in turn: one fit an axis, with their whole covariance.

At rest the corrected output is the known force f, so ``V = f/(K0 + A) − B0 − B`` with A and B the polynomials of
thesis 4.1. A run with the axis horizontal (f ≈ 0) gives B, the vertical one (f = g) gives A (thesis 4.2.1). All runs
are solved at once, because B acts in the vertical one too and a horizontal axis is never quite horizontal. Every
launch has a bias of its own: an intercept for each horizontal run, and in the vertical one what it adds to K0.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from procedures.analysis.least_squares.determination import require_full_rank
from procedures.analysis.thermal.correlated import LinearFit, fit_linear, whiten
from procedures.analysis.thermal.order import LARGEST_ORDER, Order, compare_orders
from procedures.analysis.thermal.runs import AXES, ThermalRun
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.noise import NoiseCoefficients
from procedures.core.thermal_correction import (
    COEFFICIENTS,
    POWERS_OF_ALPHA,
    POWERS_OF_BETA,
    AxisCorrection,
    Form,
    ThermalCorrection,
    acting,
    terms,
)

PASSES = 3
"""Gauss–Newton iterations: the model is linear but for a scale that moves by parts in a hundred."""
RANK_TOLERANCE = 1e-7


@dataclass(frozen=True)
class AxisFit:
    """Fit of one accelerometer's correction, with the noise, the residuals and the comparison of orders."""

    axis: int
    correction: AxisCorrection
    residual_sd_m_s2: tuple[float, float]
    """Residual standard deviations of the cells, static and dynamic; NaN where there is no such cell."""
    effective_samples: float
    degrees_of_freedom: float
    noise: NoiseCoefficients
    """Noise of the residuals [m/s²-based], static cells weighing one; all zero where the fit is exact to rounding."""
    condition: float
    """Condition number of the column-scaled design."""
    order: Order
    residuals_m_s2: tuple[Array, ...]
    """Residuals of each run, (n,)."""


def fit_correction(
    runs: Sequence[ThermalRun],
    reference_c: tuple[float, float],
    form: Form = Form.BOTH,
    lag_sd_s: tuple[float, float] = (0.0, 0.0),
) -> tuple[ThermalCorrection, tuple[AxisFit, AxisFit, AxisFit]]:
    """Correction of the accelerometer triad with one `AxisFit` an axis.

    `reference_c`: readings of the case (gyro) and of the converter sensor at the standard calibration [°C]. `lag_sd_s`:
    standard uncertainties of the two sensors' time constants, as `thermal_run` was given them; each adds the square of
    what it changes. Lag and the board's own delay look alike: one second unknown is several times the noise's share.

    Raises `BadParameter` where an axis is never up or never horizontal, `Undetermined` with the lost combinations (a
    cycle without ramps cannot tell the two sensors apart), `UnfitRecording`.
    """
    if not all(0.0 <= sd < np.inf for sd in lag_sd_s):
        raise BadParameter("lag_sd_s", lag_sd_s, "two finite numbers, not negative")
    x, y, z = (_with_lags(fit_axis(runs, a, reference_c, form), runs, reference_c, form, lag_sd_s) for a in range(3))
    return ThermalCorrection("accelerometer", (x.correction, y.correction, z.correction)), (x, y, z)


def _with_lags(
    fit: AxisFit,
    runs: Sequence[ThermalRun],
    reference_c: tuple[float, float],
    form: Form,
    lag_sd_s: tuple[float, float],
) -> AxisFit:
    """The fit with the uncertain time constants in its covariance: fitted again with each sensor so much later."""
    c = fit.correction
    covariance = np.array(c.covariance)
    for name, sd in zip(("case_c", "converter_c"), lag_sd_s, strict=True):
        if sd > 0.0:
            later = [
                replace(r, **{name: getattr(r, name) + sd * np.gradient(getattr(r, name), r.cell_s, axis=0)})
                for r in runs
            ]
            other = fit_axis(later, fit.axis, reference_c, form).correction
            change = np.array([*other.alpha, *other.beta]) - np.array([*c.alpha, *c.beta])
            covariance += np.outer(change, change)
    rows = tuple(tuple(float(v) for v in row) for row in covariance)
    return replace(fit, correction=replace(c, covariance=rows))


def fit_axis(runs: Sequence[ThermalRun], axis: int, reference_c: tuple[float, float], form: Form) -> AxisFit:
    """Fit thesis 4.1 to one accelerometer; see `fit_correction`.

    The cells of each regime are weighted by the inverse spread of its own residuals: sensors that lag make the dynamic
    ones worse. The form ``both`` is fitted by generalised least squares with the residuals' noise (`correlated`); the
    older forms, whose residuals are mostly what they cannot follow, by ordinary ones as in the thesis. Raises
    `BadParameter` where the axis was never up or always, `UnfitRecording` where the fit does not converge.
    """
    up = [run.up == axis for run in runs]
    if not any(up) or all(up):
        raise BadParameter("runs", [AXES[r.up] for r in runs], f"with axis {AXES[axis]} up at least once, and once not")
    if any(run.cell_s != runs[0].cell_s for run in runs):
        raise BadParameter("cell_s", [run.cell_s for run in runs], "the same in all runs")
    problem = _Problem(runs, axis, reference_c, form)
    parameters, weights = problem.first(), [np.ones(len(r.output_m_s2)) for r in runs]
    fit: LinearFit | None = None
    condition = float("inf")
    for _ in range(PASSES):
        designs, values = problem.linear(parameters, 2)
        triangle = np.asarray(np.linalg.qr(np.concatenate(designs), mode="r"))  # the same columns, in far fewer rows
        condition = require_full_rank(
            f"the thermal coefficients of axis {AXES[axis]}", triangle, problem.names, RANK_TOLERANCE
        )
        fit = fit_linear(designs, values, weights, runs[0].cell_s, generalised=form is Form.BOTH)
        parameters = parameters + fit.coefficients
        spread = _spread(runs, fit.residuals)
        weights = [np.where(run.dynamic, spread[0] / spread[1], 1.0) for run in runs]
    if fit is None or not np.all(np.isfinite(parameters)):
        raise UnfitRecording(f"the fit of axis {AXES[axis]} does not converge")
    return AxisFit(
        axis,
        problem.correction(parameters, fit.covariance),
        _reported(runs, fit.residuals),
        fit.effective_samples,
        fit.degrees_of_freedom,
        fit.spectrum.noise if fit.spectrum else NoiseCoefficients(),
        condition,
        _order(problem, parameters, fit, weights),
        fit.residuals,
    )


class _Problem:
    """Columns and parameters of one axis: intercepts of the runs first, then α and β as far as the form uses them."""

    def __init__(self, runs: Sequence[ThermalRun], axis: int, reference_c: tuple[float, float], form: Form) -> None:
        self.runs, self.axis, self.reference_c, self.form = runs, axis, reference_c, form
        uses = [bool(np.any(w)) for w in np.array([acting(form, 0.0), acting(form, 1.0)]).T]
        self._alpha = [i for i, (sensor, _) in enumerate(POWERS_OF_ALPHA) if uses[sensor]]
        self._beta = [i for i, (sensor, _) in enumerate(POWERS_OF_BETA) if uses[sensor]]
        constant = ((1, 0),) if form is Form.SWITCHED else ()
        self._powers_a = (*(POWERS_OF_ALPHA[i] for i in self._alpha), *constant)
        self._powers_b = (*(POWERS_OF_BETA[i] for i in self._beta), *constant)
        self._horizontal = [i for i, run in enumerate(runs) if run.up != axis]
        self._vertical = [i for i, run in enumerate(runs) if run.up == axis]
        self.sensors = tuple(sensor for sensor, used in enumerate(uses) if used)
        self.names = [
            *(f"B0 of run {i + 1}" for i in self._horizontal),
            *(f"K0 of run {i + 1}" for i in self._vertical),
            *(COEFFICIENTS[i] for i in self._alpha),
            *("K0 when dynamic" for _ in constant),
            *(COEFFICIENTS[4 + i] for i in self._beta),
            *("B0 when dynamic" for _ in constant),
        ]

    def first(self) -> Array:
        """Start of the iteration: biases from the horizontal runs, scales from the vertical ones, no slopes."""
        bias = [-float(np.mean(self.runs[i].output_m_s2[:, self.axis])) for i in self._horizontal]
        scale = [
            self.runs[i].force_m_s2[self.axis]
            / (float(np.mean(self.runs[i].output_m_s2[:, self.axis])) + np.mean(bias))
            for i in self._vertical
        ]
        return np.array([*bias, *scale, *np.zeros(len(self._powers_a) + len(self._powers_b))], dtype=np.float64)

    def linear(self, parameters: Array, order: int) -> tuple[list[Array], list[Array]]:
        """Jacobian of V and measured minus modelled V, run by run; an `order` above 2 appends powers 3, …

        ``V = f/(K0 + A) − B0 − B``; ``∂V/∂α = −f·x/(K0 + A)²``, ``∂V/∂β = −x``.
        """
        h, v, a = len(self._horizontal), len(self._vertical), len(self._powers_a)
        bias, scale = parameters[:h], parameters[h : h + v]
        designs, values = [], []
        for i, run in enumerate(self.runs):
            dt, db = run.case(self.axis) - self.reference_c[0], run.converter_c - self.reference_c[1]
            of_a = terms(self.form, self._powers_a, dt, db, run.dynamic)
            of_b = terms(self.form, self._powers_b, dt, db, run.dynamic)
            force = run.force_m_s2[self.axis]
            up = i in self._vertical
            k0 = scale[self._vertical.index(i)] if up else float(np.mean(scale))
            b0 = float(np.mean(bias)) if up else bias[self._horizontal.index(i)]
            gain = k0 + of_a @ parameters[h + v : h + v + a]
            of_gain = -force / gain**2
            heads = np.zeros((len(dt), h + v))
            heads[:, :h] = -1.0 / h if up else np.where(np.arange(h) == self._horizontal.index(i), -1.0, 0.0)
            if up:
                heads[:, h + self._vertical.index(i)] = of_gain
            else:
                heads[:, h:] = of_gain[:, None] / v
            columns = [heads, of_gain[:, None] * of_a, -of_b]
            for power in range(3, order + 1):
                higher = terms(self.form, tuple((s, power) for s in self.sensors), dt, db, run.dynamic)
                columns += [of_gain[:, None] * higher, -higher]
            designs.append(np.column_stack(columns))
            modelled = force / gain - b0 - of_b @ parameters[h + v + a :]
            values.append(run.output_m_s2[:, self.axis] - modelled)
        return designs, values

    def quadratic(self) -> list[int]:
        """Columns of the second powers."""
        start = len(self._horizontal) + len(self._vertical)
        return [start + i for i, (_, power) in enumerate((*self._powers_a, *self._powers_b)) if power == 2]

    def correction(self, parameters: Array, covariance: Array) -> AxisCorrection:
        h, v, a = len(self._horizontal), len(self._vertical), len(self._powers_a)
        whole, used = np.zeros(8), [*self._alpha, *(4 + i for i in self._beta)]
        columns = [*range(h + v, h + v + len(self._alpha)), *range(h + v + a, h + v + a + len(self._beta))]
        whole[used] = parameters[columns]
        spread = np.zeros((8, 8))
        spread[np.ix_(used, used)] = covariance[np.ix_(columns, columns)]
        switched = self.form is Form.SWITCHED
        offset = (float(parameters[h + v + a - 1]), float(parameters[-1])) if switched else (0.0, 0.0)
        a1, a2, a3, a4, b1, b2, b3, b4 = (float(c) for c in whole)
        return AxisCorrection(
            float(np.mean(parameters[h : h + v])),
            float(np.mean(parameters[:h])),
            (a1, a2, a3, a4),
            (b1, b2, b3, b4),
            *self.reference_c,
            self.form,
            offset,
            tuple(tuple(float(c) for c in row) for row in spread),
        )


def _regime_values(runs: Sequence[ThermalRun], residuals: Sequence[Array], dynamic: bool) -> Array:
    return np.concatenate([r[run.dynamic == dynamic] for run, r in zip(runs, residuals, strict=True)])


def _reported(runs: Sequence[ThermalRun], residuals: Sequence[Array]) -> tuple[float, float]:
    still, moving = (_regime_values(runs, residuals, dynamic) for dynamic in (False, True))
    return (
        float(np.sqrt(np.mean(still**2))) if len(still) else float("nan"),
        float(np.sqrt(np.mean(moving**2))) if len(moving) else float("nan"),
    )


def _spread(runs: Sequence[ThermalRun], residuals: Sequence[Array]) -> tuple[float, float]:
    """Relative spreads of the two regimes, never zero; equal where one has too few cells for an estimate."""
    parts = [_regime_values(runs, residuals, dynamic) for dynamic in (False, True)]
    if min(len(p) for p in parts) < 20 or any(not np.any(p) for p in parts):
        return 1.0, 1.0
    still, moving = (float(np.sqrt(np.mean(p**2))) for p in parts)
    return still, moving


def _order(problem: _Problem, parameters: Array, fit: LinearFit, weights: Sequence[Array]) -> Order:
    """Compare orders 1 … 5 on cells weighted and whitened alike, linear about the answer."""
    designs, values = problem.linear(parameters, LARGEST_ORDER)
    variances = (
        fit.spectrum.variances if fit.spectrum and fit.whitened else [np.ones(len(r.dynamic)) for r in problem.runs]
    )
    columns = np.concatenate([whiten(w[:, None] * d, v) for d, w, v in zip(designs, weights, variances, strict=True)])
    # Linear about the answer: order 1 must explain the quadratic part too, so that is put back into the values.
    square = problem.quadratic()
    kept = np.concatenate([whiten(w * y, v) for y, w, v in zip(values, weights, variances, strict=True)])
    kept = kept + columns[:, square] @ parameters[square]
    sensors = len(problem.sensors)
    second = columns.shape[1] - 2 * (LARGEST_ORDER - 2) * sensors
    higher = range(second, columns.shape[1])  # power by power, of A and of B
    sets = [[i for i in range(second) if i not in square], list(range(second))]
    orders = range(3, LARGEST_ORDER + 1)
    sets += [[*range(second), *higher[: 2 * (order - 2) * sensors]] for order in orders]
    independent = float(len(kept)) if fit.whitened else fit.effective_samples
    return compare_orders(columns, sets, kept, fit.effective_samples, independent)
