"""Checks of a procedure's `acquire`: it must give one stream for each given station, in order."""

from collections.abc import AsyncIterator, Sequence

from procedures.bench.imu import Stream
from procedures.core.errors import ProcedureDefect
from procedures.core.recording import Station


async def stream_of(streams: AsyncIterator[Stream], procedure: str, station: Station) -> Stream:
    """Return the procedure's next stream, which must be of this station; waits for it. Raises `ProcedureDefect` for
    another one or none, and any error of the procedure.
    """
    stream = await anext(streams, None)
    if stream is None:
        raise ProcedureDefect(
            f"procedure {procedure} gave no stream for {_named(station)}: `acquire` must yield one for each "
            "station that it is given, in order"
        )
    if stream.station != station:
        raise ProcedureDefect(
            f"procedure {procedure} gave the stream of {_named(stream.station)} where "
            f"{_named(station)} was due: `acquire` must yield one for each station, unchanged and in order"
        )
    return stream


async def require_end(streams: AsyncIterator[Stream], procedure: str, stations: Sequence[Station]) -> None:
    """Check that the procedure ends after the last station. Raises `ProcedureDefect` where it gives one more stream."""
    further = await anext(streams, None)
    if further is not None:
        raise ProcedureDefect(
            f"procedure {procedure} gave one more stream, of {_named(further.station)}, after the last of its "
            f"{len(stations)} stations: `schedule` must list every station that `acquire` records"
        )


def _named(station: Station | None) -> str:
    return "no station" if station is None else f"station {station.index} ({station.label})"
