"""Whether a unit's samples kept pace with the clock that the encoders are read by, piece by piece of a recording.

The samples' times are their number over the declared rate, the readings' those of the bench's clock. Where the two part
within a recording, a delay between them is none of the unit's: samples were lost, the rate is not the declared one, or
a simulated world behind the wires did not keep its time.
"""

from math import hypot, isfinite, pi, sqrt

import numpy as np

from procedures.analysis.response.phasors import Response, fitted_piece
from procedures.analysis.response.trace import Samples
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.recording import RecordingInfo

MOST_DIFFERENCE = 1e-3
"""Largest difference of a unit's clock from the bench's, relative; ten times what a quartz oscillator has."""
CLOCK_SIGMAS = 4.0
"""Standard uncertainties beyond which a difference of the clocks is told."""
PIECES, LEAST_PIECES = 8, 3
CYCLES, READINGS = 2.0, 8
"""Least number of cycles and of readings in a piece."""
STEP_SIGMAS = 6.0
"""Standard deviations of one piece's delay by which the pieces may part: the range of eight normal values is beyond it
once in a thousand recordings, and twice what is claimed for a piece is allowed on top."""
SHORT = 2.0
"""Factor by which a short piece's phase is worse than ``√pieces`` times the whole's: a drift is fitted in each."""
CAUSES = (
    "samples were lost, the unit's rate is not the declared one, or a served world fell behind its time factor; the "
    "delay between the samples and the encoder's readings is none of the unit's"
)


def require_measured_pace(info: RecordingInfo) -> None:
    """Check the pace that was measured while the samples came, where it was. Raises `UnfitRecording`."""
    pace = None if info.measured is None else info.measured.pace
    if pace is None or not pace.differs(MOST_DIFFERENCE, info.duration_s):
        return
    label = info.id if info.station is None else info.station.label
    raise UnfitRecording(
        f"station {label}: {pace.direction} by {abs(pace.behind_s):.3g} s within the recording of "
        f"{info.duration_s:.6g} s: {CAUSES}"
    )


def require_pace(samples: Samples, response: Response) -> None:
    """Check that the clocks did not part within a recording. Raises `UnfitRecording` with how far they did."""
    length_s = len(samples.time_s) / samples.rate_hz
    if abs(response.drift) > MOST_DIFFERENCE and abs(response.drift) > CLOCK_SIGMAS * response.drift_sd:
        raise UnfitRecording(
            f"station {response.label}: the unit's samples and the bench's clock part by {response.drift:.2%}, "
            f"{abs(response.drift) * length_s:.3g} s within the recording: {CAUSES}"
        )
    pieces = min(PIECES, int(response.frequency_hz * length_s / CYCLES))
    if pieces < LEAST_PIECES or not isfinite(response.phase_sd):
        return
    found = _delays(samples, response.omega, length_s, pieces)
    if found is None:
        return
    delays, scatter_s = found
    left = delays - np.polyval(np.polyfit(np.arange(pieces), delays, 1), np.arange(pieces))
    step_s = float(np.ptp(left))
    sd_s = hypot(scatter_s, SHORT * sqrt(pieces) * response.phase_sd / response.omega)
    if step_s > max(STEP_SIGMAS * sd_s, 2.0 * response.within_s):
        raise UnfitRecording(
            f"station {response.label}: the delay of the unit's samples changes by {1e3 * step_s:.3g} ms within "
            f"the recording: {CAUSES}"
        )


def _delays(samples: Samples, omega: float, length_s: float, pieces: int) -> tuple[Array, float] | None:
    """Delay of each piece against that of the first [s], (pieces,), and the median deviation by what is beside them.

    None where a piece has too few readings. The deviations take what is beside the sinusoid as white, which more
    noise than the unit's record has makes larger, and a step between two pieces does not.
    """
    found, deviations = list[complex](), list[float]()
    for k in range(pieces):
        piece = fitted_piece(samples, omega, (k * length_s / pieces, (k + 1) * length_s / pieces), READINGS)
        if piece is None:
            return None
        gyro, angle = piece
        found.append(gyro.value / angle.value)
        deviations.append(hypot(gyro.scatter / abs(gyro.value), angle.scatter / abs(angle.value)))
    phases = np.unwrap(np.angle(np.array(found) / found[0]), period=2.0 * pi)
    return -phases / omega, float(np.median(deviations)) / omega
