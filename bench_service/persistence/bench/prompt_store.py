"""Requests to the person at the bench, and their answers, in the jobs' own rows."""

from datetime import datetime

from sqlalchemy import select

from bench_service.bench.prompts import Answer, Prompt
from bench_service.model.errors import IllegalTransition
from bench_service.model.job import Job
from bench_service.persistence.database import Database
from bench_service.persistence.jobs.job_changes import append_event, found_job
from bench_service.persistence.jobs.job_rows import job_of_row
from bench_service.persistence.tables.jobs import JobRow


class SqlPromptStore:
    """SQL implementation of `bench_service.bench.prompts.PromptStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def ask(self, job_id: str, prompt: Prompt) -> None:
        asked = {"id": prompt.id, "text": prompt.text, "angles_deg": prompt.angles_deg}
        with self._database.write() as session:
            row = found_job(session, job_id, lock=True)
            row.prompt = {**asked, "asked_at": prompt.at.isoformat()}
            append_event(session, job_id, "prompt", prompt.at, asked)

    def answer(self, job_id: str, prompt_id: str, answer: Answer, at: datetime) -> Job:
        said = {"done": answer.done, "remark": answer.remark, "by": answer.by}
        with self._database.write() as session:
            row = found_job(session, job_id, lock=True)
            if row.prompt is None or "answer" in row.prompt:
                raise IllegalTransition(
                    f"job {job_id} has no open prompt: it was answered or withdrawn, or there was none"
                )
            if row.prompt.get("id", "") != prompt_id:
                text = f"job {job_id} has a newer prompt; this answer is to an older one: read the job again"
                raise IllegalTransition(text)
            row.prompt = {**row.prompt, "answer": said}
            append_event(session, job_id, "answer", at, {**said, "prompt": prompt_id})
            return job_of_row(row)

    def answered(self, job_id: str) -> Answer | None:
        with self._database.read() as session:
            prompt = session.scalar(select(JobRow.prompt).where(JobRow.id == job_id))
        return Answer(**prompt["answer"]) if prompt and "answer" in prompt else None

    def withdraw(self, job_id: str) -> None:
        with self._database.write() as session:
            found_job(session, job_id, lock=True).prompt = None
