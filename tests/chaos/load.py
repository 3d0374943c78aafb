"""The clients of a chaos run: they submit jobs and campaigns, pause, resume, cancel, and ask again without an answer.

What was acknowledged to them is what the service must keep; they note it and judge nothing.
"""

import random
import time
from dataclasses import dataclass, field
from threading import Event, Thread
from typing import Any

import httpx

FINAL = ("succeeded", "failed", "cancelled")
OPEN_JOBS = 1
"""How many jobs of a bench wait or run at any time, as long as the load lasts; beside them a campaign run."""
SECOND_RUN = 0.003
"""How often, of all looks, a second campaign run is asked for while a bench has an open one: it must wait."""
LOST_ANSWERS = 0.2
"""Of the submissions, how many clients hang up before the answer."""

SHORT = {"dwell_s": 5.0, "settle_s": 0.5}
WARM = {
    "temperatures_c": [23.5, 25.0, 26.5, 28.0, 29.5],
    "ramp_c_min": 5.0,
    "slope_c_min": 10.0,
    "window_s": 60.0,
    "settle_s": 0.0,
    "record_s": 5.0,
    "sample_rate_hz": 20.0,
}
"""A quarter of an hour in the chamber, away from its ambient all the time, with a current on the converter."""
RECIPES: tuple[tuple[str, dict[str, Any], tuple[int, ...], int], ...] = (
    ("calibration_12_orientations", SHORT, (1, 1001), 4),
    ("verification_9_orientations", SHORT, (3,), 2),
    ("static_run", {"launches": 2, "duration_s": 1000.0, "off_time_s": 10.0, "settle_s": 0.0}, (1,), 1),
    ("converter_bench", WARM, (1,), 2),
    ("no_operation", {}, (4,), 2),
)
"""Procedure, parameters, seeds (the campaign's, for each job needs an undisturbed twin), how often it is chosen."""
FIRST = "converter_bench"
"""What each bench begins with: so that in a short run, too, a chamber is away from ambient when a kill comes."""
CAMPAIGN: dict[str, Any] = {
    "name": "chaos",
    "steps": [
        {"name": "calibration", "procedure": "calibration_12_orientations", "parameters": SHORT, "retries": 1},
        {
            "name": "magnitude",
            "method": "scalar_calibration",
            "recordings_of": ["calibration"],
            "parameters": {"gravity_m_s2": 9.81},
        },
        {"name": "verification", "procedure": "verification_9_orientations", "parameters": SHORT, "retries": 1},
        {"name": "nothing", "procedure": "no_operation", "retries": 1},
    ],
}
KNOWN = [
    {
        "triad": triad,
        "origin": "nominal scale factors",
        "choose": True,
        "coefficients": [
            {"name": f"b_{axis}", "value": 0.0, "unit": unit, "standard_uncertainty": size} for axis in "xyz"
        ]
        + [
            {"name": f"K{i}{j}", "value": float(i == j), "unit": "1", "standard_uncertainty": 0.2}
            for i in (1, 2, 3)
            for j in (1, 2, 3)
        ],
    }
    for triad, unit, size in (("gyro", "deg/h", 1.0), ("accelerometer", "m/s^2", 0.2))
]
"""Coefficients that a person enters and chooses: a verification needs some, and so short a calibration fails."""
BASE_SEED = 1
RETRY_SEED = 1000
"""What a retry of a step adds to its seed, as the service's documents say; a step's number is added too."""


@dataclass
class Asked:
    """A job or a campaign run that was asked for, and what was said of it."""

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
    asked_at: str = "/api/v1/jobs"
    """Where it is asked for."""
    seen_at: str = "/api/v1/jobs"
    """Where all of its kind are seen."""

    @property
    def id(self) -> str:
        return self.ids[0] if self.ids else ""


@dataclass
class Stop:
    """A bench that was seen stopped, and until when [s, Unix time] it was asked to be released."""

    bench: str
    said: str
    """When, and why."""
    until: float


Recipe = tuple[str, dict[str, Any], int]


def recipes_of_campaign(retry: int) -> list[Recipe]:
    """Procedure, parameters and seed of the jobs of the campaign's steps in one of their attempts, from 0."""
    return [
        (step["procedure"], step.get("parameters", {}), BASE_SEED + number + RETRY_SEED * retry)
        for number, step in enumerate(CAMPAIGN["steps"])
        if step.get("retries", -1) >= retry
    ]


def recipes_beside_campaign() -> list[Recipe]:
    """The same of every other job that there may be: a retry's, or one that is asked for by itself."""
    alone = [(procedure, parameters, seed) for procedure, parameters, seeds, _ in RECIPES for seed in seeds]
    retried = recipes_of_campaign(1)
    return retried + [one for one in alone if one not in (*retried, *recipes_of_campaign(0))]


def campaign_run(bench: str, number: int, wish: str = "none") -> Asked:
    """A run of the campaign, to be asked for."""
    labels = {"chaos": f"run-{number}"}
    body = {"unit": "SIM-0001", "bench": bench, "seed": BASE_SEED, "labels": labels}
    asked_at = f"/api/v1/campaigns/{CAMPAIGN['name']}/runs"
    return Asked(f"chaos-run-{number}", body, wish, asked_at=asked_at, seen_at="/api/v1/campaign-runs")


class Clients(Thread):
    """All clients of one run, in one thread; `defects` are answers that no disaster excuses."""

    def __init__(self, ports: tuple[int, ...], benches: tuple[str, ...], seed: int, most: int) -> None:
        super().__init__(name="clients", daemon=True)
        self.jobs: list[Asked] = []
        self.runs: list[Asked] = []
        self.defects: list[str] = []
        self.unanswered = 0
        self.stops: list[Stop] = []
        self._chance = random.Random(f"clients {seed}")
        self._benches = benches
        self._most = most
        self._http = [httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=20, trust_env=False) for port in ports]
        self._submitting = True
        self._ending = Event()

    def run(self) -> None:
        while not self._ending.wait(0.05):
            for asked in self.open:
                self._follow(asked)
            for bench in self._benches:
                self._keep_busy(bench)
            self._release()

    def see_through(self, asked: Asked) -> str:
        """Requests that the thread makes for all others, of one job alone, before it is started; its state now."""
        self._follow(asked)
        self._release()
        return asked.state

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
        """Jobs and campaign runs that have not ended as far as is known."""
        return [asked for asked in (*self.jobs, *self.runs) if asked.state not in FINAL]

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
        if not self._submitting or len(self.jobs) + len(self.runs) >= self._most:
            return
        mine = [asked for asked in self.open if asked.body["bench"] == bench]
        runs = sum(asked in self.runs for asked in mine)
        if len(mine) - runs < OPEN_JOBS:
            self.jobs.append(self._drawn(bench))
        if runs == 0 or (runs == 1 and self._chance.random() < SECOND_RUN):
            self.runs.append(campaign_run(bench, len(self.runs), self._chance.choices(("none", "cancel"), (7, 1))[0]))

    def _drawn(self, bench: str) -> Asked:
        chance, number = self._chance, len(self.jobs)
        begun = any(asked.body["bench"] == bench for asked in self.jobs)
        weights = [weight if begun else procedure == FIRST for procedure, *_, weight in RECIPES]
        procedure, parameters, seeds, _ = chance.choices(RECIPES, weights)[0]
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
        answer = self.ask("GET", f"{asked.seen_at}/{asked.id}", (200,))
        if answer is None:
            return
        asked.state = answer.json()["state"]
        if asked.state in FINAL:
            return
        if asked.state in ("paused", "interrupted") and asked not in self.runs:
            self._resume(asked)
        elif not asked.wished and asked.wish != "none" and self._chance.random() < 0.3:
            self._wish(asked)

    def _submit(self, asked: Asked) -> None:
        headers = {"Idempotency-Key": asked.key}
        if self._chance.random() < LOST_ANSWERS:  # the client is gone before the answer: it asks again with its key
            impatient = httpx.Timeout(20, read=self._chance.choice((0.002, 0.02, 0.1)))
            again = self.ask("POST", asked.asked_at, (202,), json=asked.body, headers=headers, timeout=impatient)
            if again is not None:
                asked.ids.append(again.json()["id"])
        answer = self.ask("POST", asked.asked_at, (202,), json=asked.body, headers=headers)
        if answer is not None:
            asked.ids.append(answer.json()["id"])

    def _wish(self, asked: Asked) -> None:
        asked.cancel_asked = asked.cancel_asked or asked.wish == "cancel"  # an answer that is lost may have been yes
        answer = self.ask("POST", f"{asked.seen_at}/{asked.id}/{asked.wish}", (202, 409))
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
            said = None if seen is None or seen.status_code == 404 else seen.json()["stopped"]
            if said is None:
                continue
            for one in seen.json()["stops"] if seen is not None else []:
                path = f"/api/v1/benches/{bench}/stops/{one['id']}/release"
                self.ask("POST", path, (200, 409), json={"by": "a person", "remark": "looked at it"})
            known = [stop for stop in self.stops if (stop.bench, stop.said) == (bench, said)]
            if not known:
                self.stops.append(Stop(bench, said, 0.0))
            (known or self.stops)[-1].until = time.time()
