"""Course of whole turns as the unit itself counted it: what Earth's rate and the nonlinear terms gathered meanwhile.

No table follows its demand exactly. Its ramps have another shape than the planned ones, and one that is braked late
overshoots and comes back, so the unit stands at other angles to the Earth than planned, and for other times. The gyro
channel of the turning axis shows θ(t) sample by sample: less the Earth's rate along the axis, and scaled so that it
ends at the whole turns that the table made, it is good to some 1e-4 rad, which changes the Earth's turn by 1e-8 rad.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from procedures.analysis.turns.fit import Turning
from procedures.core.arrays import Array
from procedures.core.frames import earth_rate_b
from procedures.core.recording import TRIADS, NominalScale, Recording
from procedures.core.site import Site

MOST_STEP_RAD = 0.1
"""Largest turn within a sample at which a recording shows the course; with fewer samples the planned one is taken."""


@dataclass(frozen=True)
class Course:
    """Integrals over one recording of whole turns: of cos θ and sin θ [s], and the moments of the rate."""

    cosine_s: float
    """``∫cos θ dt`` [s], θ from the recording's beginning."""
    sine_s: float
    """``∫sin θ dt`` [s]."""
    moments: tuple[float, float, float]
    """``∫|ω| dt``, ``∫ω² dt``, ``∫ω³ dt`` [rad, rad²/s, rad³/s²]."""


def course(recording: Recording, channel: int, along_rad_s: float, angle_rad: float, direction: float) -> Course | None:
    """Course by one gyro channel, whose rate about the turning axis is `direction` (±1) times its output.

    None where the samples are too few (`MOST_STEP_RAD`).

    `along_rad_s`: Earth's rate along the axis; `angle_rad`: the turns made, signed. Within a sample the rate is taken
    to be constant: ``∫cos θ dt = Δt·cos θ_m·sin(Δ/2)/(Δ/2)`` with its middle θ_m and its turn Δ.
    """
    info = recording.info
    column = info.column(TRIADS["gyro"][channel])
    scale, dt = NominalScale.of([info.channels[column]], info.rate_hz), 1.0 / info.rate_hz
    outputs = (block[:, [column]].astype(np.float64) for block in recording.blocks())
    steps = np.concatenate([scale.rates(output)[:, 0] for output in outputs])
    steps = direction * steps * dt - along_rad_s * dt
    steps *= angle_rad / float(np.sum(steps))
    if np.max(np.abs(steps)) > MOST_STEP_RAD:
        return None
    middle = np.cumsum(steps) - 0.5 * steps
    chord = dt * np.sinc(steps / (2.0 * np.pi))
    rate = steps / dt
    moments = float(np.sum(np.abs(steps))), float(np.sum(rate * steps)), float(np.sum(rate**2 * steps))
    return Course(float(chord @ np.cos(middle)), float(chord @ np.sin(middle)), moments)


def as_turned(motion: Turning, recordings: Sequence[Recording], site: Site) -> Turning:
    """The motion with Earth's turn and moments as they were in the recordings, in place of the planned ones.

    ``E = e·(e·Ω)·T + Ω_⊥·∫cos θ dt − (e×Ω_⊥)·∫sin θ dt``: in the unit's axes the Earth's rate turns by −θ about e.
    """
    earth = earth_rate_b(list(motion.angles), site)
    along = np.einsum("nj,nj->n", earth, motion.axis_b)
    earth_rad, moments = motion.earth_rad.copy(), motion.moments.copy()
    for i, recording in enumerate(recordings):
        axis, channel = motion.axis_b[i], motion.channels[i]
        direction = float(np.sign(axis[channel]))
        found = course(recording, channel, float(along[i]), float(motion.angle_rad[i]), direction)
        if found is None:
            continue
        across: Array = earth[i] - along[i] * axis
        earth_rad[i] = along[i] * motion.seconds[i] * axis + found.cosine_s * across
        earth_rad[i] -= found.sine_s * np.cross(axis, across)
        moments[i] = found.moments
    return replace(motion, earth_rad=earth_rad, moments=moments)
