"""What a person at the bench is asked while a job runs, and the answer: PORT of memory, and the operator behind it."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

from bench_service.model.job import Job
from bench_service.wall_clock import now, pause_async
from procedures.bench import Operator
from procedures.bench.errors import Stopped
from procedures.core.table_angles import TableAngles

LOOK_S = 0.2
"""How often it is looked for an answer [s, real time]."""


@dataclass(frozen=True)
class Answer:
    """What a person said: the work is done, or will not be."""

    done: bool
    remark: str = ""
    by: str = ""


class PromptStore(Protocol):
    """One question at a time a job. Asked and answered, it is an event of the job too."""

    def ask(self, job_id: str, text: str, at: datetime) -> None:
        """Ask; a question that was there before is forgotten."""
        ...

    def answer(self, job_id: str, answer: Answer, at: datetime) -> Job:
        """Answer what is asked. Raises `IllegalTransition` where nothing is, `NotFound`."""
        ...

    def answered(self, job_id: str) -> Answer | None:
        """The answer to what was asked; None: not yet."""
        ...

    def withdraw(self, job_id: str) -> None:
        """Ask no more."""
        ...


class AskedOperator:
    """`procedures.bench.Operator`: a person who reads the job's page and says when the work is done.

    `then`: an operator who does it afterwards, as the simulated bench's own does in an exercise.
    """

    def __init__(self, prompts: PromptStore, job_id: str, then: Operator | None = None) -> None:
        self._prompts = prompts
        self._job_id = job_id
        self._then = then

    async def set_by_hand(self, angles: TableAngles, request: str) -> None:
        """Ask, and wait for the answer as long as it takes. Raises `Stopped` where the person refuses."""
        self._prompts.ask(self._job_id, request, now())
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
"""From a job's id and the bench's own operator, whom the procedure asks."""
