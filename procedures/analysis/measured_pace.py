"""Sentence of a result whose recordings did not keep pace with the bench's clock."""

from collections.abc import Sequence

from procedures.core.measured import MeasuredPace
from procedures.core.recording import RecordingInfo

SHARE = 0.005
"""Share of a recording by which its samples may fall behind before it is told."""
SCATTERS = 3.0
"""Scatters of the samples' arrival that are no loss."""


def fell_behind(recordings: Sequence[RecordingInfo]) -> tuple[str, ...]:
    """Return a sentence on recordings whose samples came at another rate than the declared one; nothing where all kept
    it.
    """
    late = [(info, pace) for info in recordings if (pace := _pace(info)) is not None and _is_late(info, pace)]
    if not late:
        return ()
    info, worst = max(late, key=lambda pair: abs(pair[1].behind_s) * pair[0].rate_hz / pair[0].count)
    length_s = info.count / info.rate_hz
    way = "fell behind" if worst.behind_s > 0.0 else "were ahead of"
    return (
        f"in {len(late)} of {len(recordings)} recordings the unit's samples {way} the bench's clock, at worst by "
        f"{abs(worst.behind_s):.3g} s within {length_s:.6g} s: a served world that does not keep its time factor, or "
        "another sample rate than the declared one. Samples count by the unit's clock, waits and ramps by the bench's",
    )


def _pace(info: RecordingInfo) -> MeasuredPace | None:
    return None if info.measured is None else info.measured.pace


def _is_late(info: RecordingInfo, pace: MeasuredPace) -> bool:
    return abs(pace.behind_s) > max(SHARE * info.count / info.rate_hz, SCATTERS * pace.scatter_s)
