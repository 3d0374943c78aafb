"""The clients of a chaos run: they submit, pause, resume and cancel, and ask again where no answer came.

What was acknowledged to them is what the service must keep; they note it and judge nothing.
"""

import random
import time
from dataclasses import dataclass, field
from threading import Event, Thread
from typing import Any

import httpx

FINAL = ("succeeded", "failed", "cancelled")
OPEN_JOBS = 2
"""How many jobs of a bench wait or run at any time, as long as the load lasts."""
LOST_ANSWERS = 0.2
"""Of the submissions, how many clients hang up before the answer."""

SHORT = {"dwell_s": 5.0, "settle_s": 0.5}
RECIPES: tuple[tuple[str, dict[str, Any], tuple[int, ...], int], ...] = (
    ("calibration_12_orientations", SHORT, (1, 2), 4),
    ("verification_9_orientations", SHORT, (1,), 3),
    ("static_run", {"launches": 2, "duration_s": 1000.0, "off_time_s": 10.0, "settle_s": 0.0}, (1,), 1),
    ("no_operation", {}, (1,), 2),
)
"""Procedure, parameters, seeds (few, so that an undisturbed twin of every job can be run), how often it is chosen."""


@dataclass
class Asked:
    """A job that was asked for, and what was said of it."""

    key: str
    body: dict[str, Any]
    wish: str
    """none, cancel, pause (and resume later)."""
    ids: list[str] = field(default_factory=list)
    """The id in each acknowledgement (202): there may be several, and they must agree."""
    state: str = ""
    wished: bool = False
    cancel_asked: bool = False
    resume_at: float = 0.0
    resumed: int = 0

    @property
    def id(self) -> str:
        return self.ids[0] if self.ids else ""


class Clients(Thread):
    """All clients of one run, in one thread; `defects` are answers that no disaster excuses."""

    def __init__(self, ports: tuple[int, ...], benches: tuple[str, ...], seed: int, most: int) -> None:
        super().__init__(name="clients", daemon=True)
        self.jobs: list[Asked] = []
        self.defects: list[str] = []
        self.unanswered = 0
        self.released: list[str] = []
        self._chance = random.Random(f"clients {seed}")
        self._benches = benches
        self._most = most
        self._http = [httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=20, trust_env=False) for port in ports]
        self._submitting = True
        self._ending = Event()

    def run(self) -> None:
        while not self._ending.wait(0.05):
            for asked in [asked for asked in self.jobs if asked.state not in FINAL]:
                self._follow(asked)
            for bench in self._benches:
                self._keep_busy(bench)
            self._release()

    def submit_no_more(self) -> None:
        """From now on only what was begun is followed to its end; what is paused is resumed at once."""
        self._submitting = False

    def end(self) -> None:
        self._ending.set()
        self.join()
        for http in self._http:
            http.close()

    @property
    def open(self) -> list[Asked]:
        """Jobs that have not ended as far as is known."""
        return [asked for asked in self.jobs if asked.state not in FINAL]

    def ask(self, method: str, path: str, expected: tuple[int, ...], **more: Any) -> httpx.Response | None:
        """Ask some process of the service; None where it could not answer now."""
        http = self._chance.choice(self._http)
        try:
            answer = http.request(method, path, **more)
        except httpx.TransportError:
            self.unanswered += 1
            return None
        if answer.status_code in expected:
            return answer
        if answer.status_code == 503:  # the database is being restarted, and it says so
            self.unanswered += 1
            return None
        self.defects.append(f"{method} {path} {more.get('json', '')}: {answer.status_code} {answer.text[:400]}")
        return None

    def _keep_busy(self, bench: str) -> None:
        mine = sum(asked.body["bench"] == bench for asked in self.open)
        if self._submitting and mine < OPEN_JOBS and len(self.jobs) < self._most:
            self.jobs.append(self._drawn(bench))

    def _drawn(self, bench: str) -> Asked:
        chance, number = self._chance, len(self.jobs)
        procedure, parameters, seeds, _ = chance.choices(RECIPES, [weight for *_, weight in RECIPES])[0]
        body = {
            "procedure": procedure,
            "unit": "SIM-0001",
            "bench": bench,
            "parameters": parameters,
            "seed": chance.choice(seeds),
            "priority": chance.choice((5, 10, 10, 20)),
            "retries": 5,
            "labels": {"chaos": str(number)},
        }
        return Asked(f"chaos-{number}", body, chance.choices(("none", "pause", "cancel"), (8, 2, 1))[0])

    def _follow(self, asked: Asked) -> None:
        if not asked.ids:
            self._submit(asked)
            return
        answer = self.ask("GET", f"/api/v1/jobs/{asked.id}", (200,))
        if answer is None:
            return
        asked.state = answer.json()["state"]
        if asked.state in FINAL:
            return
        if asked.state in ("paused", "interrupted"):
            self._resume(asked)
        elif not asked.wished and asked.wish != "none" and self._chance.random() < 0.3:
            self._wish(asked)

    def _submit(self, asked: Asked) -> None:
        headers = {"Idempotency-Key": asked.key}
        if self._chance.random() < LOST_ANSWERS:  # the client is gone before the answer: it asks again with its key
            impatient = httpx.Timeout(20, read=self._chance.choice((0.002, 0.02, 0.1)))
            again = self.ask("POST", "/api/v1/jobs", (202,), json=asked.body, headers=headers, timeout=impatient)
            if again is not None:
                asked.ids.append(again.json()["id"])
        answer = self.ask("POST", "/api/v1/jobs", (202,), json=asked.body, headers=headers)
        if answer is not None:
            asked.ids.append(answer.json()["id"])

    def _wish(self, asked: Asked) -> None:
        asked.cancel_asked = asked.cancel_asked or asked.wish == "cancel"  # an answer that is lost may have been yes
        answer = self.ask("POST", f"/api/v1/jobs/{asked.id}/{asked.wish}", (202, 409))
        if answer is not None:
            asked.wished = True
            asked.resume_at = time.monotonic() + self._chance.uniform(0.2, 2.0)

    def _resume(self, asked: Asked) -> None:
        if self._submitting and time.monotonic() < asked.resume_at:
            return
        if self.ask("POST", f"/api/v1/jobs/{asked.id}/resume", (202, 409)) is not None:
            asked.resumed += 1

    def _release(self) -> None:
        """A person who looks at a bench that was stopped, and lets it work again."""
        if self._chance.random() > 0.1:
            return
        for bench in self._benches:
            seen = self.ask("GET", f"/api/v1/benches/{bench}", (200, 404))
            if seen is not None and seen.status_code == 200 and seen.json()["stopped"]:
                self.released.append(f"{bench}: {seen.json()['stopped']}")
                self.ask("POST", f"/api/v1/benches/{bench}/release", (200, 409))
