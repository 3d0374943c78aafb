"""A bench under real processes whose stop is measured: from the press until its devices say that they are safe."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

import httpx
import psutil

from tests.chaos.processes import ROOT, free_port
from tests.chaos.witnesses import is_safe, register

START_S = 90.0
MOVE_S = 60.0
"""How long a table may take until it moves with the unit powered [s]."""
SAFE_S = 30.0
"""After so long a stop that made nothing safe is given up [s]."""
WAYS = ("API", "page", "command")
TRUTH = (ROOT / "simulators/truths/default_bench.toml").read_text().replace("rate_deg_s = 60.0", "rate_deg_s = 3.0")
"""A table that takes half a minute from one station to the next: so that there is time to be in mid-move."""


@dataclass
class Outcome:
    """One press."""

    hindrance: str
    way: str
    answer: str
    """What the one who pressed was told."""
    answered_s: float
    safe_s: float | None
    """From the press until the devices were safe; None: not within `SAFE_S`."""
    journal_s: float | None
    """The same by the moment in the devices' journal, where the wall clock can be believed."""
    killed: bool
    """Whether the worker had to be killed."""
    limit_s: float

    @property
    def kept(self) -> bool:
        return self.safe_s is not None and self.safe_s <= self.limit_s

    def __str__(self) -> str:
        safe = "NOT SAFE" if self.safe_s is None else f"safe {self.safe_s:6.3f} s"
        journal = "" if self.journal_s is None else f" (journal {self.journal_s:.3f})"
        killed = ", worker killed" if self.killed else ""
        word = "ok  " if self.kept else "LATE"
        return (
            f"{word} {self.hindrance:28} {self.way:8} {safe}{journal}{killed}; {self.answered_s:6.3f} s: {self.answer}"
        )


@dataclass
class StopBench:
    """Processes of one bench in a folder: one that does everything (`serve`), or API and worker apart."""

    folder: Path
    database_url: str
    apart: bool = False
    settings: dict[str, str] = field(default_factory=dict)
    api_settings: dict[str, str] = field(default_factory=dict)
    worker_prefix: tuple[str, ...] = ()
    api_before: Callable[[], None] | None = None
    """Called in the API's process before it is our program: for limits."""
    log: Path | None = None
    """Where the processes write; None: a file of the folder."""
    worker_env: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self.processes: list[subprocess.Popen[bytes]] = []
        self.worker: subprocess.Popen[bytes] | None = None
        self.http = httpx.Client(base_url=self.url, timeout=60, trust_env=False)
        truth = self.folder / "bench.toml"
        truth.write_text(TRUTH)
        self._environment = {
            **{key: value for key, value in os.environ.items() if not key.startswith("BENCH_")},
            "PYTHONPATH": str(ROOT),
            "OMP_NUM_THREADS": "1",
            "BENCH_DATABASE_URL": self.database_url,
            "BENCH_DEVICE_FOLDER": str(self.folder),
            "BENCH_TRUTH": str(truth),
            "BENCH_REAL_TIME_FACTOR": "1",
            **self.settings,
        }

    def start(self) -> None:
        api = ["serve", "--port", str(self.port)]
        if self.apart:
            self.worker = self._start(["worker"], self.worker_env, self.worker_prefix)
            self._until(lambda: (self.folder / "bench-sim.driver").exists(), START_S, "the worker drives")
            self.api = self._start([*api, "--no-worker"], self.api_settings, (), self.api_before)
        else:
            self.api = self.worker = self._start(api, {**self.api_settings, **self.worker_env}, (), self.api_before)
        self._until(self._answers, START_S, "the service answers")
        self._until(lambda: self.supervisor() > 0, START_S, "the bench is supervised")

    def _start(
        self,
        arguments: list[str],
        more: dict[str, str],
        prefix: tuple[str, ...] = (),
        before: Callable[[], None] | None = None,
    ) -> subprocess.Popen[bytes]:
        log = self.log or self.folder / f"{arguments[0]}.out"
        with log.open("ab") as out:
            made = subprocess.Popen(
                [*prefix, sys.executable, "-m", "bench_service", *arguments],
                env={**self._environment, **more},
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
                start_new_session=True,
                preexec_fn=before,
            )
        self.processes.append(made)
        return made

    def _answers(self) -> bool:
        with suppress(httpx.TransportError):
            return self.http.get("/healthz").status_code == 200
        return False

    def supervisor(self) -> int:
        with suppress(OSError, ValueError, KeyError):
            pid = json.loads((self.folder / "bench-sim.supervisor").read_text())["pid"]
            return pid if psutil.pid_exists(pid) else 0
        return 0

    def driver(self) -> int:
        """Process that drives the bench."""
        return json.loads((self.folder / "bench-sim.driver").read_text())["process"]["pid"]

    def submit(self) -> str:
        parameters = {"dwell_s": 20.0, "settle_s": 0.5}
        body = {"procedure": "calibration_12_orientations", "unit": "SIM-0001", "parameters": parameters, "seed": 1}
        answer = self.http.post("/api/v1/jobs", json=body)
        assert answer.status_code == 202, answer.text
        return answer.json()["id"]

    def state(self) -> dict[str, Any] | None:
        return register(self.folder / "bench-sim.devices")

    def moves(self) -> bool:
        """Whether the table is in mid-move with the unit on."""
        state = self.state()
        return state is not None and state["table"] == "moving" and state["powered"] and state["linked"]

    def until_it_moves(self) -> None:
        """Begin of a move that lasts long enough: not its end."""
        self._until(lambda: not self.moves(), MOVE_S, "a move begins")
        self._until(self.moves, MOVE_S, "the table moves with the unit on")

    def press(self, hindrance: str, way: str, limit_s: float, believes_clock: bool = True) -> Outcome:
        """Stop the bench; how long until it is safe, by the watch that looks at the devices' register."""
        assert self.moves(), f"{hindrance}: the table is not in mid-move: {self.state()}"
        driver = self.driver()
        seen: list[float] = []
        begun_s, wall_s = time.monotonic(), time.time()

        def watch() -> None:
            while time.monotonic() - begun_s < SAFE_S:
                state = self.state()
                if state is not None and is_safe(state):
                    seen.append(time.monotonic() - begun_s)
                    return
                time.sleep(0.004)

        watcher = threading.Thread(target=watch)
        watcher.start()
        try:
            answer = {"API": self._by_api, "page": self._by_page, "command": self._by_command}[way]()
        except (httpx.HTTPError, subprocess.TimeoutExpired) as error:
            answer = f"{type(error).__name__}: nothing answered"
        answered_s = time.monotonic() - begun_s
        watcher.join()
        safe_s = seen[0] if seen else None
        journal_s = self._journal_s(wall_s) if believes_clock and safe_s is not None else None
        killed = not psutil.pid_exists(driver) or psutil.Process(driver).status() == psutil.STATUS_ZOMBIE
        return Outcome(hindrance, way, answer, answered_s, safe_s, journal_s, killed, limit_s)

    def _by_api(self) -> str:
        with httpx.Client(base_url=self.url, timeout=20, trust_env=False) as http:
            return _said(http.post("/api/v1/benches/sim/stop", json={"reason": "the stop matrix", "by": "a test"}))

    def _by_page(self) -> str:
        """As the page's form asks, from a browser on this page."""
        headers = {"Origin": self.url, "Sec-Fetch-Site": "same-origin", "Sec-Fetch-Mode": "cors"}
        with httpx.Client(base_url=self.url, timeout=20, trust_env=False, headers=headers) as http:
            return _said(http.post("/api/v1/benches/sim/stop"))

    def _by_command(self) -> str:
        command = [sys.executable, "-m", "bench_service", "stop", "--reason", "the stop matrix"]
        found = subprocess.run(command, env=self._environment, capture_output=True, text=True, timeout=40, check=False)
        lines = (found.stdout + found.stderr).strip().splitlines() or ["(nothing)"]
        return f"exit {found.returncode}: {lines[-1][:110]}"

    def _journal_s(self, wall_s: float) -> float | None:
        """From the press to the last line of the making safe that began after it."""
        found: float | None = None
        for line in (self.folder / "bench-sim.journal").read_text(errors="replace").splitlines():
            with suppress(ValueError, KeyError):
                entry = json.loads(line)
                at = datetime.fromisoformat(entry["at"]).timestamp() - wall_s
                if at > 0 and entry["verb"] in ("supply.make_safe", "supply.make_safe.done", "bench.make_safe.done"):
                    found = at if found is None else found
                    if entry["verb"] != "supply.make_safe":
                        return at
        return found

    def end(self) -> None:
        """Kill whatever is left of it."""
        self.http.close()
        for pid in {self.supervisor()} - {0}:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        for process in self.processes:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait(20)
        for pid in {self.supervisor()} - {0}:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)

    @staticmethod
    def _until(reached: Callable[[], bool], seconds: float, what: str) -> None:
        end = time.monotonic() + seconds
        while not reached():
            assert time.monotonic() < end, f"not within {seconds:g} s: {what}"
            time.sleep(0.01)


def _said(answer: httpx.Response) -> str:
    if answer.status_code != 202:
        return f"{answer.status_code} {answer.text[:120]}"
    found = answer.json()
    books = f", books: {found['books'][:50]}" if found["books"] else ""
    return f"202, safe {found['safety']['safe']}{books}"
