"""Procedure without stations: nothing moves, it always passes. For measuring the service itself."""

from collections.abc import AsyncIterator, Sequence

from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core.limits import Verdict
from procedures.core.recording import Recording, Station
from procedures.core.report import Report
from procedures.procedure import Context, Outcome, Parameters, Prediction, Procedure


class Params(Parameters):
    """Parameters of the procedure, of which there are none to be chosen."""


class Result(Outcome):
    """Result without any measurement."""


def resolve(params: Params, context: Context) -> Params:
    return params


def schedule(params: Params) -> tuple[Station, ...]:
    return ()


def predict(params: Params, context: Context) -> Prediction:
    return Prediction()


async def acquire(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    """Record nothing: an empty stream of recordings, for any stations."""
    for _ in ():
        yield _


def analyse(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    """Return a pass without any check: the one procedure that judges nothing and still passes."""
    return Result(verdict=Verdict.PASS)


def report(result: Result) -> Report:
    return Report("Nothing was done.")


def quantities(params: Params, context: Context) -> tuple[str, ...]:
    """Return no names: the result has no quantities."""
    return ()


PROCEDURE = Procedure(
    "no_operation",
    "No operation",
    "1.0.0",
    Params,
    Result,
    resolve,
    schedule,
    predict,
    acquire,
    analyse,
    report,
    quantities=quantities,
)
