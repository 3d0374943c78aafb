"""Faults for the campaign `acceptance`, each of the smallest size that the plan finds out by its own preview.

Of a step between launches (from the third on) and of noise the size follows from the planned checks with the power
below; exchanged, dead and stuck channels have no size.
"""

from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag, null_space
from scipy.special import chdtri

from bench_service.campaigns.campaign import Campaign
from bench_service.campaigns.power import beyond, smallest_step
from procedures import catalog, methods
from procedures.analysis.calibration.plan import triad_plan
from procedures.analysis.calibration.suspect_flaw import free_residuals, smallest_size
from procedures.analysis.least_squares.whitening import whitener
from procedures.catalog import calibration_12_orientations as twelve
from procedures.core import units
from procedures.core.limits import PlannedCheck
from procedures.procedure import Context, PredictedUncertainty
from simulators.truth import Array, BenchTruth, TriadTruth, UnitTruth
from tests.kit.procedures import simulated_context
from tests.validation.acceptance_rig import Fault, Samples

POWER = 0.99
"""Probability with which a fault of the smallest size is to be found."""
LATE = ("scale_3", "calibration_3", "verification_3")
AFTER = LATE[0]
"""First step with a fault of the third launch."""


def _planned(campaign: Campaign) -> dict[str, PlannedCheck]:
    """The checks of noise and of the scatter between launches, by name."""
    context = simulated_context()
    found: dict[str, PlannedCheck] = {}
    for name, steps in (("scale_run_to_run", "scale_1"), ("run_to_run", "calibration_1")):
        of, before = campaign.step(name), campaign.step(steps)
        parameters = {k: v for k, v in before.parameters.items() if k != "thermal_correction"}
        procedure = catalog.discover()[before.does]
        params = procedure.resolve(procedure.params.model_validate(parameters), context)
        predicted: tuple[PredictedUncertainty, ...] = procedure.predict(params, context).uncertainties
        method = methods.discover()[of.does]
        checks = method.planned_checks(method.params.model_validate(of.parameters), context.unit, [predicted] * 3)
        found |= {c.check: c for c in checks}
    static = catalog.discover()["static_run"]
    params = static.params.model_validate(campaign.step("static").parameters)
    return found | {c.check: c for c in static.planned_checks(params, context)}


def faults(campaign: Campaign) -> list[Fault]:
    """All faults with their sizes."""
    planned = _planned(campaign)
    gyro, force = "gyro scale factor x run to run", "accelerometer scale factor y run to run"
    bias, walk = "accelerometer bias z run to run", "gyro_y random walk"
    ppm_gyro, ppm_force, step = (smallest_step(planned[name], POWER, 3) for name in (gyro, force, bias))
    noise = _noise(planned[walk])
    return [
        _late("gyro scale step", gyro, f"{ppm_gyro:.3g} ppm from the third launch", "gyro", 0, 1e-6 * ppm_gyro, 0.0),
        _late("accelerometer scale step", force, f"{ppm_force:.3g} ppm", "accelerometer", 1, 1e-6 * ppm_force, 0.0),
        _late("accelerometer bias step", bias, f"{step:.3g} m/s^2", "accelerometer", 2, 0.0, step),
        *_of_reference(campaign),
        Fault("noisy gyro", (walk,), truth=_noisy(noise), size=f"{noise:.3g} deg/√h"),
        Fault(
            "gyro axes exchanged",
            ("gyro_x and gyro_y are exchanged",),
            samples=_exchanged("gyro", "x", "y"),
            size="x, y",
        ),
        Fault(
            "accelerometer axes exchanged",
            ("accelerometer_y and accelerometer_z are exchanged",),
            samples=_exchanged("accelerometer", "y", "z"),
            size="y, z",
        ),
        Fault("dead channel", ("gyro_z",), samples=_dead, size="gyro z, from the first launch"),
        Fault("stuck thermometer", ("temperature_case",), samples=_stuck, size="case"),
    ]


def _of_reference(campaign: Campaign) -> list[Fault]:
    """A wrong azimuth and a loose mounting in the third launch, as the residuals of its calibration would show them.

    A loose mounting: the unit's attitude scatters anew from station to station, with the same spread about each axis,
    after the whole turns of that launch.
    """
    context = simulated_context()
    step = campaign.step("calibration_3")
    parameters = {k: v for k, v in step.parameters.items() if k != "thermal_correction"}
    params = twelve.resolve(twelve.Params.model_validate(parameters), context)
    level = params.limits.residual_p_value_min
    effect, covariance, source = _free(params, context, "gyro")
    azimuth = smallest_size(effect[:, source == "azimuth"][:, 0], covariance, level, POWER) / units.ARCSEC
    effect, covariance, source = _free(params, context, "accelerometer")
    loose = _loose(effect[:, source == "pointing"], covariance, level) / units.ARCSEC

    def misread(step_name: str, unit: UnitTruth, bench: BenchTruth) -> tuple[UnitTruth, BenchTruth]:
        if step_name not in LATE:
            return unit, bench
        table = replace(bench.table, azimuth_error_arcsec=bench.table.azimuth_error_arcsec + azimuth)
        return unit, replace(bench, table=table)

    def scattered(step_name: str, unit: UnitTruth, bench: BenchTruth) -> tuple[UnitTruth, BenchTruth]:
        if step_name not in LATE[1:]:
            return unit, bench
        return unit, replace(bench, table=replace(bench.table, pointing_sd_arcsec=loose))

    return [
        Fault("wrong azimuth", ("gyro", "wrong azimuth"), misread, size=f"{azimuth / 60.0:.3g} arcmin", late=True),
        Fault("loose mounting", ("accelerometer", "differ"), scattered, size=f"{loose:.3g} arcsec", late=True),
    ]


def _free(params: twelve.Params, context: Context, triad: str) -> tuple[Array, Array, Array]:
    """Effect of each flaw of one radian on the residual combinations of a plan (k, P), their covariance, sources."""
    stations = twelve.schedule(params)
    site = params.site(context)
    plan = triad_plan(triad, context.unit, stations, context.bench.axis_motion, site, params.table(site))
    noise, vectors, table = plan.noise_covariance(), plan.vectors, plan.table
    if noise is None:
        raise ValueError("the default unit's noise is known")
    design = np.column_stack([np.ones(len(vectors)), vectors])
    basis = null_space((design / np.linalg.norm(design, axis=0)).T)
    free = free_residuals(np.zeros(3 * basis.shape[1]), np.zeros((1, 1)), basis, plan.matrix, table)
    declared = free.per_radian * table.sd
    covariance = block_diag(*[basis.T @ c @ basis for c in noise]) + declared @ declared.T
    return free.per_radian, covariance, np.array(table.source)


def _loose(effect: Array, covariance: Array, level: float) -> float:
    """Spread of each turn at each station [rad] whose chi-square is refused with `POWER`, by draws and bisection."""
    dice = np.random.default_rng(0)
    weights = whitener(covariance)
    noise = dice.normal(size=(4000, len(covariance)))
    turns = dice.normal(size=(4000, effect.shape[1])) @ (weights @ effect).T
    bound = float(chdtri(len(covariance), level))
    low, high = 0.0, 100.0 * units.ARCSEC
    for _ in range(40):
        middle = 0.5 * (low + high)
        found = float(np.mean(np.sum((noise + middle * turns) ** 2, axis=1) > bound))
        low, high = (middle, high) if found < POWER else (low, middle)
    return high


def _noise(planned: PlannedCheck) -> float:
    """Smallest random walk that is found, by bisection."""
    limit = planned.limit.maximum or 0.0
    low, high = limit, 4.0 * limit
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if beyond(planned, middle, limit) < POWER else (low, middle)
    return high


def _late(name: str, check: str, size: str, triad: str, axis: int, scale: float, bias: float) -> Fault:
    def truth(step: str, unit: UnitTruth, bench: BenchTruth) -> tuple[UnitTruth, BenchTruth]:
        if step not in LATE:
            return unit, bench
        old: TriadTruth = unit.triad(triad)
        rows = tuple(tuple((1.0 + scale * (i == axis)) * k for k in row) for i, row in enumerate(old.matrix))
        biases = tuple(b + bias * (i == axis) for i, b in enumerate(old.bias))
        changed = replace(old, matrix=rows, bias=biases)
        return replace(unit, **{triad: changed}), bench

    return Fault(name, (check,), truth=truth, size=size, late=True)


def _noisy(deg_sqrt_h: float):
    def truth(_step: str, unit: UnitTruth, bench: BenchTruth) -> tuple[UnitTruth, BenchTruth]:
        x, _, z = unit.gyro.random_walk
        walk = (x, deg_sqrt_h * units.DEG_PER_SQRT_HOUR, z)
        return replace(unit, gyro=replace(unit.gyro, random_walk=walk)), bench

    return truth


def _exchanged(triad: str, one: str, other: str) -> Samples:
    def samples(_step: str, channels: tuple[str, ...], raw: Array) -> Array:
        if f"{triad}_{one}" not in channels:
            return raw
        pair = [channels.index(f"{triad}_{axis}") for axis in (one, other)]
        changed = raw.copy()
        changed[:, pair] = raw[:, pair[::-1]]
        return changed

    return samples


def _dead(_step: str, channels: tuple[str, ...], raw: Array) -> Array:
    if "gyro_z" not in channels:
        return raw
    changed = raw.copy()
    changed[:, channels.index("gyro_z")] = 0
    return changed


def _stuck(_step: str, channels: tuple[str, ...], raw: Array) -> Array:
    if "temperature_case" not in channels:
        return raw
    column = channels.index("temperature_case")
    changed = np.array(raw)
    changed[:, column] = raw[0, column]
    return changed
