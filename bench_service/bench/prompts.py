"""Requests to the person at the bench while a job runs, and the answers: interface of their store, and the operator who
asks through it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

from bench_service.model.job import Job
from bench_service.wall_clock import new_id, now, pause_async
from procedures.bench import Operator
from procedures.bench.errors import Stopped
from procedures.core.table_angles import TableAngles

LOOK_S = 0.2
"""Interval between two looks for an answer [s, real time]."""


@dataclass(frozen=True)
class Answer:
    """A person's answer to a request: the work is done, or refused."""

    done: bool
    remark: str = ""
    by: str = ""


@dataclass(frozen=True)
class Prompt:
    """A request to the person at the bench."""

    id: str
    text: str
    at: datetime
    angles_deg: tuple[float, float, float] | None = None
    """Table angles of the wanted attitude, outer, middle, inner [deg]; None: it is about no attitude."""


class PromptStore(Protocol):
    """Store of the open request of each job, at most one. Request and answer become events of the job too. Interface;
    the SQL is in `persistence`.
    """

    def ask(self, job_id: str, prompt: Prompt) -> None:
        """Store a request to a person and append it to the job's events; it replaces an earlier request of the job."""
        ...

    def answer(self, job_id: str, prompt_id: str, answer: Answer, at: datetime) -> Job:
        """Store the answer to a request and return the job. Raises `IllegalTransition` where no request is open or
        another one than the answer names, `NotFound` for an unknown job.
        """
        ...

    def answered(self, job_id: str) -> Answer | None:
        """Return the answer to the open request; None where it is not yet answered."""
        ...

    def withdraw(self, job_id: str) -> None:
        """Remove the job's open request, as after its answer or when the job ends."""
        ...


class AskedOperator:
    """A `procedures.bench.Operator` that asks a person through the job's page.

    `then`: an operator who is asked afterwards, as the simulated bench's own does in an exercise.
    """

    def __init__(self, prompts: PromptStore, job_id: str, then: Operator | None = None) -> None:
        self._prompts = prompts
        self._job_id = job_id
        self._then = then

    async def set_by_hand(self, angles: TableAngles, request: str) -> None:
        """Ask the person to set the unit, and wait without a limit. Raises `Stopped` where the person refuses."""
        wanted = (angles.outer_deg, angles.middle_deg, angles.inner_deg)
        self._prompts.ask(self._job_id, Prompt(new_id(), request, now(), wanted))
        try:
            while (answer := self._prompts.answered(self._job_id)) is None:
                await pause_async(LOOK_S)
        finally:
            self._prompts.withdraw(self._job_id)
        if not answer.done:
            raise Stopped(f"the person at the bench refused: {answer.remark or 'no reason given'}")
        if self._then is not None:
            await self._then.set_by_hand(angles, request)


Asking = Callable[[str, Operator | None], Operator]
"""Function that returns the operator that a procedure asks, from a job's id and the bench's own operator."""
