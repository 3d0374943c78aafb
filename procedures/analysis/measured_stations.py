"""Stations at the angles that the table's encoders measured, in place of the commanded ones."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from procedures.analysis.parts import of_channels
from procedures.core.recording import RawArray, Recording, RecordingInfo
from procedures.core.table_angles import TableAngles


@dataclass(frozen=True)
class _At:
    """A recording whose station stands at other angles; its samples are the same."""

    info: RecordingInfo
    whole: Recording

    def only(self, names: Sequence[str]) -> Recording:
        """Return some of the channels, in that order. Raises `MissingChannel`."""
        return _At(self.info.only(names), of_channels(self.whole, names))

    def blocks(self) -> Iterator[RawArray]:
        return self.whole.blocks()


def at_measured_angles(recordings: Sequence[Recording]) -> tuple[tuple[Recording, ...], str]:
    """The recordings with each station at its measured angles, and a sentence that says at how many it is.

    Measured angles are taken to within half a turn of the commanded ones: an encoder of one turn counts no whole turns.
    A station without measured angles keeps the commanded ones; one without angles is not counted.
    """
    found = tuple(_moved(recording) for recording in recordings)
    wanted = sum(r.info.station is not None and r.info.station.angles is not None for r in recordings)
    moved = sum(new is not old for new, old in zip(found, recordings, strict=True))
    if not wanted:
        return found, ""
    if moved == wanted:
        return found, f"the angles are those that the table's encoders measured, at all {wanted} stations"
    return found, (
        f"the angles are those that the table's encoders measured at {moved} of {wanted} stations; at the others none "
        "were measured, and the commanded ones are taken with the encoders' uncertainty"
    )


def _moved(recording: Recording) -> Recording:
    info = recording.info
    station, measured = info.station, None if info.measured is None else info.measured.angles
    if station is None or station.angles is None or measured is None:
        return recording
    there = replace(station, angles=_near(measured.mean, station.angles))
    return _At(replace(info, station=there), recording)


def _near(measured: TableAngles, commanded: TableAngles) -> TableAngles:
    return TableAngles(
        *(
            command + angle_difference_deg(angle, command)
            for angle, command in (
                (measured.outer_deg, commanded.outer_deg),
                (measured.middle_deg, commanded.middle_deg),
                (measured.inner_deg, commanded.inner_deg),
            )
        )
    )


def angle_difference_deg(angle_deg: float, other_deg: float) -> float:
    """Return the difference of two angles without whole turns, from −180 (included) to 180 [deg]."""
    return (angle_deg - other_deg + 180.0) % 360.0 - 180.0
