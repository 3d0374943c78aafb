"""Calibrations of a triad, clean and broken, drawn at random by their own means; no formula of the product is used."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from procedures.core.errors import DomainError
from procedures.core.limits import Verdict
from procedures.core.recording import Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.methods.field_calibration import METHOD as FIELD
from procedures.methods.scalar_calibration import METHOD as SCALAR
from procedures.procedure import Evidence, Method

G = 9.8103
RATE_HZ = 50.0
KINDS = {"accelerometer": (Quantity.SPECIFIC_FORCE, "m/s^2"), "gyro": (Quantity.ANGULAR_RATE, "rad/s")}
TURNS = ((0, 0), (90, 0), (180, 0), (270, 0), (0, 90), (0, 270), (90, 90), (45, 45))
"""(α, β) of positions set by hand [deg]."""
EDGES = [
    *[(a, b, 0) for a in (1, -1) for b in (1, -1)],
    *[(a, 0, b) for a in (1, -1) for b in (1, -1)],
    *[(0, a, b) for a in (1, -1) for b in (1, -1)],
]
"""Of a cube, not yet of unit length."""
EARTH = 7.292115e-5


@dataclass(frozen=True)
class Trial:
    """A method's input, and the truth it was drawn from."""

    method: Method[Any, Any]
    recordings: tuple[MemoryRecording, ...]
    parameters: dict[str, Any]
    truth: np.ndarray
    """The nine of a scalar calibration; empty of the others."""


@dataclass(frozen=True)
class Outcome:
    """Answer that the product gave."""

    verdict: str
    """A verdict, or "refused"."""
    said: str
    """Warnings and the notes of failed checks, or the refusal."""

    @property
    def passed(self) -> bool:
        return self.verdict == Verdict.PASS.value

    @property
    def caught(self) -> bool:
        """Refused, failed, or passed with a word that nothing was left to check with."""
        return not self.passed or "nothing is left to check" in self.said


def outcome(trial: Trial) -> Outcome:
    """Ask the method."""
    try:
        result = trial.method.analyse(Evidence(trial.recordings), trial.method.params(**trial.parameters), None)
    except DomainError as refusal:
        return Outcome("refused", str(refusal))
    notes = [f"{c.name}: {c.note}" for c in result.checks if not c.passed]
    return Outcome(result.verdict.value, "; ".join([*result.warnings, *notes]))


def inside(trial: Trial, times: float) -> float:
    """Share of the nine true values within so many standard uncertainties."""
    result = trial.method.analyse(Evidence(trial.recordings), trial.method.params(**trial.parameters), None)
    found = np.array([(p.estimate, p.standard_uncertainty) for p in result.parameters])
    return float(np.mean(np.abs(found[:, 0] - trial.truth) <= times * found[:, 1]))


def recorded(
    triad: str, poses: list[np.ndarray], more: list[np.ndarray] | None = None, rate_hz: float = RATE_HZ
) -> tuple[MemoryRecording, ...]:
    """One recording a pose of samples (n, 3), with another triad's beside them where there is one."""
    channels = [Channel(f"{triad}_{a}", *KINDS[triad]) for a in "xyz"]
    if more is not None:
        channels += [Channel(f"gyro_{a}", *KINDS["gyro"]) for a in "xyz"]
        poses = [np.hstack(pair) for pair in zip(poses, more, strict=True)]
    return tuple(
        MemoryRecording(
            RecordingInfo(f"r{i + 1}", "U", tuple(channels), rate_hz, len(raw), len(raw) / rate_hz * 2.0 * i), raw
        )
        for i, raw in enumerate(poses)
    )


def turned(angles: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """A fixed vector seen after α about z, then β about x, (n, 3): products of 2 × 2 rotations written out."""
    (ca, sa), (cb, sb) = ((np.cos(a), np.sin(a)) for a in np.radians(angles).T)
    x, y = ca * vector[0] + sa * vector[1], -sa * vector[0] + ca * vector[1]
    return np.column_stack([x, cb * y + sb * vector[2], -sb * y + cb * vector[2]])


def noise(rng: np.random.Generator, kind: str, poses: int, n: int, sd: float) -> np.ndarray:
    """Noise (poses, n, 3) over poses that follow one another after pauses as long as themselves."""
    white = rng.normal(0.0, sd, (poses, n, 3))
    if kind == "white":
        return white
    if kind == "low-pass":  # the sensor's own, at a tenth of the rate
        wide = rng.normal(0.0, sd, (poses, n + 9, 3))
        sums = np.cumsum(np.concatenate([np.zeros((poses, 1, 3)), wide], axis=1), axis=1)
        return (sums[:, 10:] - sums[:, :-10]) / np.sqrt(10.0)
    steps = 2 * poses * n
    if kind == "random walk":
        slow = np.cumsum(rng.normal(0.0, sd / n, (steps, 3)), axis=0)
    else:  # "flicker": one relaxation an octave, equal variances
        slow = np.zeros((steps, 3))
        for octave in range(4, 13):
            a = np.exp(-1.0 / 2.0**octave)
            drive = rng.normal(0.0, 0.05 * sd * np.sqrt(1 - a * a), (steps, 3))
            state = np.zeros(3)
            for k in range(0, steps, 16):  # held for 16 samples: slow beside the white noise
                state = state * a**16 + drive[k : k + 16].sum(axis=0)
                slow[k : k + 16] += state
    return white + slow.reshape(poses, 2 * n, 3)[:, :n]


def triad(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bias (3,), upper triangular K (3, 3), and the nine of its inverse T·S."""
    bias = rng.normal(0.0, 0.1, 3)
    s, t = 1.0 + rng.normal(0.0, 0.01, 3), rng.normal(0.0, 0.003, 3)
    correction = np.array([[1.0, t[0], t[1]], [0.0, 1.0, t[2]], [0.0, 0.0, 1.0]]) * s
    return bias, np.linalg.inv(correction), np.array([*bias, *s, *t])


def directions(rng: np.random.Generator, count: int) -> np.ndarray:
    """Faces, edges and corners of a cube in a random order and slightly turned, unit vectors (count, 3)."""
    grid = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)])
    order = np.concatenate([np.flatnonzero(np.abs(grid).sum(axis=1) == k) for k in (1, 2, 3)])
    chosen = grid[order][:count] + rng.normal(0.0, 0.05, (count, 3))
    return (chosen / np.linalg.norm(chosen, axis=1)[:, None])[rng.permutation(count)]


def clean_scalar(rng: np.random.Generator, kind: str, count: int | None = None, sd: float = 0.01) -> Trial:
    """Eighteen to twenty-six poses of four to twelve seconds."""
    poses = int(rng.integers(18, 27)) if count is None else count
    n = int(rng.integers(200, 600))
    bias, k, nine = triad(rng)
    means = bias + G * directions(rng, poses) @ k.T
    samples = means[:, None] + noise(rng, kind, poses, n, sd)
    return Trial(SCALAR, recorded("accelerometer", list(samples)), {"gravity_m_s2": G}, nine)


def scalar_trial(recordings: tuple[MemoryRecording, ...]) -> Trial:
    """A scalar calibration of given recordings."""
    return Trial(SCALAR, recordings, {"gravity_m_s2": G}, np.array([]))


def changed(trial: Trial, change: Callable[[int, np.ndarray], np.ndarray]) -> Trial:
    """The same with each pose's samples changed."""
    again = tuple(MemoryRecording(r.info, change(i, r.raw.copy())) for i, r in enumerate(trial.recordings))
    return Trial(trial.method, again, trial.parameters, trial.truth)


def disturbed(rng: np.random.Generator) -> Trial:
    """One pose off by .1 to 1 m/s² on one channel."""
    trial = clean_scalar(rng, "white")
    axis, off = int(rng.integers(3)), rng.uniform(0.1, 1.0)
    off = np.where(np.arange(3) == axis, off * rng.choice([-1.0, 1.0]), 0.0)
    means = np.array([r.raw.mean(axis=0) for r in trial.recordings])
    # A pose at right angles to the channel does not feel it: the one that feels it most is taken.
    bad = int(np.argmax(np.abs(means[:, axis])))
    return changed(trial, lambda i, x: x + off * (i == bad))


def clipped(rng: np.random.Generator) -> Trial:
    """One channel ends at 80 to 95 % of gravity."""
    axis, end = int(rng.integers(3)), G * rng.uniform(0.8, 0.95)

    def cut(_: int, x: np.ndarray) -> np.ndarray:
        x[:, axis] = np.clip(x[:, axis], -end, end)
        return x

    return changed(clean_scalar(rng, "white"), cut)


def whole_numbers(rng: np.random.Generator) -> Trial:
    """Samples printed as whole m/s²."""
    return changed(clean_scalar(rng, "white"), lambda _, x: np.round(x))


def drifting(rng: np.random.Generator) -> Trial:
    """All poses in one drift of .3 to .8 m/s² of a channel."""
    trial, axis, whole = clean_scalar(rng, "white"), int(rng.integers(3)), rng.uniform(0.3, 0.8)
    poses = len(trial.recordings)

    def drift(i: int, x: np.ndarray) -> np.ndarray:
        x[:, axis] += whole * (i + np.arange(len(x)) / len(x) / 2) / poses
        return x

    return changed(trial, drift)


def stuck(rng: np.random.Generator) -> Trial:
    """One channel says the same throughout, but for its noise."""
    axis, value = int(rng.integers(3)), rng.uniform(-3.0, 12.0)

    def hold(_: int, x: np.ndarray) -> np.ndarray:
        x[:, axis] = value + rng.normal(0.0, 0.004, len(x))
        return x

    return changed(clean_scalar(rng, "white"), hold)


def no_spare(rng: np.random.Generator) -> Trial:
    """Nine poses for nine unknowns."""
    return clean_scalar(rng, "white", 9)


def half_scale(rng: np.random.Generator) -> Trial:
    """One channel in another unit: a factor of 9.8 or of a third."""
    axis, factor = int(rng.integers(3)), rng.choice([9.8, 0.33, 0.102])
    return changed(clean_scalar(rng, "white"), lambda _, x: x * np.where(np.arange(3) == axis, factor, 1.0))


def clean_field(
    rng: np.random.Generator, positions: tuple[tuple[float, float], ...] = TURNS, gyro: str = "none"
) -> Trial:
    """Positions set by hand within a minute of arc, cross-couplings of a thousandth."""
    listed = np.array(positions, float)
    n = int(rng.integers(400, 900))
    actual = listed + rng.normal(0.0, 1.0 / 60.0, listed.shape)
    cross = rng.normal(0.0, 0.001, (3, 3)) * (1.0 - np.eye(3))
    scale = 1.0 + rng.normal(0.0, 0.005, 3)
    matrix = np.diag(scale) @ (np.eye(3) + cross)
    force = turned(actual, np.array([0.0, G, 0.0])) @ matrix.T + rng.normal(0.0, 0.05, 3)
    samples = force[:, None] + rng.normal(0.0, 0.004, (len(listed), n, 3))
    parameters = {
        "latitude_deg": 49.0,
        "gravity_m_s2": G,
        "positions": tuple(map(tuple, positions)),
        "gyro": gyro,
    }
    if gyro == "none":
        return Trial(FIELD, recorded("accelerometer", list(samples)), parameters, np.array([]))
    lat = np.radians(49.0)
    # In F's base: y up; azimuth 0 puts x to the north.
    earth = EARTH * np.array([np.cos(lat), np.sin(lat), 0.0])
    rate = turned(actual, earth) * (1.0 + rng.normal(0.0, 0.003, 3)) + rng.normal(0.0, 1e-5, 3)
    turns = rate[:, None] + rng.normal(0.0, 2e-6, (len(listed), n, 3))
    return Trial(FIELD, recorded("accelerometer", list(samples), list(turns)), parameters, np.array([]))


def exchanged(rng: np.random.Generator) -> Trial:
    """Two positions exchanged, which differ by more than 45°."""
    trial = clean_field(rng)
    listed = list(trial.parameters["positions"])
    up = turned(np.array(listed, float), np.array([0.0, 1.0, 0.0]))
    while True:
        i, j = rng.choice(len(listed), 2, replace=False)
        if up[i] @ up[j] < 0.7:
            break
    listed[i], listed[j] = listed[j], listed[i]
    return Trial(trial.method, trial.recordings, {**trial.parameters, "positions": tuple(listed)}, trial.truth)


def other_sense(rng: np.random.Generator) -> Trial:
    """Two positions, α turned the other way."""
    alpha, beta = rng.uniform(30.0, 60.0, 2)
    trial = clean_field(rng, ((0.0, 0.0), (float(alpha), float(beta))))
    wrong = ((0.0, 0.0), (-float(alpha), float(beta)))
    return Trial(trial.method, trial.recordings, {**trial.parameters, "positions": wrong}, trial.truth)


def reversed_channel(rng: np.random.Generator) -> Trial:
    """An accelerometer with the wrong sign."""
    axis = int(rng.integers(3))
    return changed(clean_field(rng), lambda _, x: x * np.where(np.arange(3) == axis, -1.0, 1.0))


def _gyros(rng: np.random.Generator, change: Callable[[np.ndarray], np.ndarray], gyro: str) -> Trial:
    def of(_: int, x: np.ndarray) -> np.ndarray:
        x[:, 3:] = change(x[:, 3:])
        return x

    return changed(clean_field(rng, gyro=gyro), of)


def gyros_reversed(rng: np.random.Generator) -> Trial:
    """All three gyros with the wrong sign."""
    return _gyros(rng, lambda x: -x, str(rng.choice(["bias", "bias_and_scale"])))


def gyros_exchanged(rng: np.random.Generator) -> Trial:
    """Two gyros in each other's column."""
    order = [[1, 0, 2], [2, 1, 0], [0, 2, 1]][int(rng.integers(3))]
    return _gyros(rng, lambda x: x[:, order], str(rng.choice(["bias", "bias_and_scale"])))


def gyros_clipped(rng: np.random.Generator) -> Trial:
    """One gyro that ends at half of the Earth's rate."""
    axis, end = int(rng.integers(3)), EARTH * rng.uniform(0.3, 0.5)

    def cut(x: np.ndarray) -> np.ndarray:
        x[:, axis] = np.clip(x[:, axis], -end, end)
        return x

    return _gyros(rng, cut, str(rng.choice(["bias", "bias_and_scale"])))


def _clean(kind: str) -> Callable[[np.random.Generator], Trial]:
    return lambda rng: clean_scalar(rng, kind)


CLEAN_SCALAR = {f"scalar, {k}": _clean(k) for k in ("white", "low-pass", "flicker", "random walk")}
CLEAN_FIELD: dict[str, Callable[[np.random.Generator], Trial]] = {
    "field": clean_field,
    "field with gyros": lambda rng: clean_field(rng, gyro=str(rng.choice(["bias", "bias_and_scale"]))),
}
BROKEN_SCALAR = {
    "scalar, a pose disturbed": disturbed,
    "scalar, clipped": clipped,
    "scalar, whole numbers": whole_numbers,
    "scalar, drifting": drifting,
    "scalar, a channel stuck": stuck,
    "scalar, no spare equation": no_spare,
    "scalar, a channel in another unit": half_scale,
}
BROKEN_FIELD = {
    "field, positions exchanged": exchanged,
    "field, two positions, a turn the other way": other_sense,
    "field, a channel reversed": reversed_channel,
    "field, gyros reversed": gyros_reversed,
    "field, gyros exchanged": gyros_exchanged,
    "field, gyros clipped": gyros_clipped,
}
