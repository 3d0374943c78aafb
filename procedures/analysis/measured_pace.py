"""Sentence of a result whose recordings did not keep pace with the bench's clock."""

from collections.abc import Sequence

from procedures.core.recording import RecordingInfo

SHARE = 0.005
"""Share of a recording by which its samples may fall behind before it is told."""


def fell_behind(recordings: Sequence[RecordingInfo]) -> tuple[str, ...]:
    """Return a sentence on recordings whose samples came at another rate than the declared one; nothing where all kept
    it.
    """
    measured = [(info.measured.pace, info.duration_s) for info in recordings if info.measured is not None]
    late = [(pace, length_s) for pace, length_s in measured if pace is not None and pace.differs(SHARE, length_s)]
    if not late:
        return ()
    worst, length_s = max(late, key=lambda pair: abs(pair[0].behind_s) / pair[1])
    return (
        f"in {len(late)} of {len(recordings)} recordings {worst.direction}, at worst by "
        f"{abs(worst.behind_s):.3g} s within {length_s:.6g} s: a served world that does not keep its time factor, or "
        "another sample rate than the declared one. Samples count by the unit's clock, waits and ramps by the bench's",
    )
