"""Checks of a procedure's `acquire`: it must give one stream for each given station, in order."""

from collections.abc import AsyncIterator, Coroutine, Generator, Sequence
from contextlib import contextmanager
from typing import cast

from bench_service.evidence.catalogue import AnyProcedure
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core.errors import ProcedureDefect
from procedures.core.recording import Station


def opened(procedure: AnyProcedure, bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    """Begin the streams of a procedure's stations. Raises `ProcedureDefect` where `acquire` gives no async iterator."""
    with _program_goes_on(procedure.name):
        streams = cast(object, procedure.acquire(bench, stations))  # whatever its author returns
    if isinstance(streams, AsyncIterator):
        return streams  # pyright: ignore[reportUnknownVariableType]  of streams, as `stream_of` checks
    kind = type(streams).__name__
    if isinstance(streams, Coroutine):
        streams.close()  # it is not awaited, and would be complained of
    raise ProcedureDefect(
        f"`acquire` of procedure {procedure.name} gave a {kind}: it must be an async generator, `async def` with "
        "`yield`"
    )


async def stream_of(streams: AsyncIterator[Stream], procedure: str, station: Station) -> Stream:
    """Return the procedure's next stream, which must be of this station; waits for it. Raises `ProcedureDefect` for
    another one or none, and any error of the procedure.
    """
    with _program_goes_on(procedure):
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
    with _program_goes_on(procedure):
        further = await anext(streams, None)
    if further is not None:
        raise ProcedureDefect(
            f"procedure {procedure} gave one more stream, of {_named(further.station)}, after the last of its "
            f"{len(stations)} stations: `schedule` must list every station that `acquire` records"
        )


@contextmanager
def _program_goes_on(procedure: str) -> Generator[None]:
    """Refuse an end of the program that a procedure's code asks for: the bench's thread would end with it."""
    try:
        yield
    except SystemExit as ended:
        raise ProcedureDefect(f"`acquire` of procedure {procedure} would end the program with {ended!r}") from ended


def _named(station: Station | None) -> str:
    return "no station" if station is None else f"station {station.index} ({station.label})"
