"""Mixed load on a service for a stated time: jobs, calibrations, imports, analyses, exports, pages, stops."""

import html
import itertools
import random
import re
from collections import Counter
from collections.abc import Callable
from threading import Event, Lock, Thread

import httpx

from bench_service.wall_clock import pause

DESCRIPTION = '{"unit": "IMPORTED-1", "time_column": "t", "channels": [{"name": "gyro_x", "column": "x", '
DESCRIPTION += '"quantity": "angular_rate", "unit": "deg/s"}]}'
CLIENTS = 3
QUEUED_MOST = 20
"""Jobs that may wait: the load does not run ahead of the bench."""
RELEASES = 25
"""Attempts at the release of a bench."""
PAGES = ("/", "/benches/sim/stops", "/metrics", "/readyz", "/api/v1/jobs", "/api/v1/recordings", "/api/v1/database")
ROWS, RATE_HZ = 3000, 20.0
"""Of an imported recording: 150 s, of which a noise analysis needs 120."""
WATCHED = 20
"""Pieces that a listener reads of the stream of events before it leaves."""
NEEDED = ("job", "calibration", "import", "analysis", "export", "page", "figure", "listener", "stop")
"""Kinds of request of which each must have succeeded: a load that is refused shows nothing."""


class Load:
    """Clients of one service, and what their requests came to."""

    def __init__(self, address: str, seed: int, pause_s: float) -> None:
        """Set up clients that pause for `pause_s` seconds between two requests."""
        self._address = address
        self._pause_s = pause_s
        self._ending = Event()
        self._mutex = Lock()
        self.answers: Counter[str] = Counter()
        self.faults: Counter[str] = Counter()
        self._recordings: list[str] = []
        self._results: list[str] = []
        self._threads = [Thread(target=self._work, args=(seed + n,), daemon=True) for n in range(CLIENTS)]

    def begin(self) -> None:
        for thread in self._threads:
            thread.start()

    @property
    def never(self) -> list[str]:
        """Kinds of request of which none has succeeded."""
        return [name for name in NEEDED if not any(f"{name} {status}" in self.answers for status in (200, 201, 202))]

    def end(self) -> None:
        self._ending.set()
        for thread in self._threads:
            thread.join(120)

    def _work(self, seed: int) -> None:
        chance = random.Random(seed)
        acts: list[tuple[str, Callable[[httpx.Client, random.Random], httpx.Response | None], int]] = [
            ("job", self._job, 8),
            ("calibration", self._calibration, 2),
            ("import", self._import, 4),
            ("analysis", self._analysis, 2),
            ("export", self._export, 3),
            ("page", self._page, 6),
            ("figure", self._figure, 1),
            ("listener", self._listener, 1),
            ("stop", self._stop, 1),
        ]
        turns = list(itertools.chain.from_iterable([(name, act)] * share for name, act, share in acts))
        with httpx.Client(base_url=self._address, timeout=120) as client:
            while not self._ending.is_set():
                name, act = chance.choice(turns)
                try:
                    self._count(name, act(client, chance))
                except httpx.TransportError as error:
                    with self._mutex:
                        self.faults[f"{name}: {type(error).__name__}"] += 1
                pause(self._pause_s)

    def _count(self, name: str, answer: httpx.Response | None) -> None:
        if answer is None:
            return
        refused = answer.status_code == 503 and "Retry-After" in answer.headers
        with self._mutex:
            self.answers[f"{name} {answer.status_code}"] += 1
            if answer.status_code >= 500 and not refused:
                self.faults[f"{name}: {answer.status_code} {answer.text[:100]}"] += 1

    def _room(self, client: httpx.Client) -> bool:
        return len(client.get("/api/v1/benches/sim/queue").json()["entries"]) < QUEUED_MOST

    def _job(self, client: httpx.Client, chance: random.Random) -> httpx.Response | None:
        if not self._room(client):
            return None
        return client.post("/api/v1/jobs", json={"procedure": "no_operation", "unit": "SIM-0001"})

    def _calibration(self, client: httpx.Client, chance: random.Random) -> httpx.Response | None:
        if not self._room(client):
            return None
        body = {"procedure": "calibration_12_orientations", "unit": "SIM-0001", "seed": chance.randrange(1000)}
        return client.post("/api/v1/jobs", json={**body, "parameters": {"dwell_s": 5.0, "settle_s": 0.5}})

    def _import(self, client: httpx.Client, chance: random.Random) -> httpx.Response:
        turn = chance.randrange(1000)
        rows = "\n".join(f"{i / RATE_HZ:.2f},{chance.gauss(turn / 1000, 1.0):.6f}" for i in range(ROWS))
        files = [("files", ("a.csv", f"t,x\n{rows}\n".encode()))]
        answer = client.post("/api/v1/recordings", files=files, data={"description": DESCRIPTION})
        if answer.status_code == 201:
            with self._mutex:
                self._recordings = [*self._recordings[-50:], answer.json()["id"]]
        return answer

    def _some(self, chance: random.Random) -> str | None:
        with self._mutex:
            return chance.choice(self._recordings) if self._recordings else None

    def _analysis(self, client: httpx.Client, chance: random.Random) -> httpx.Response | None:
        recording = self._some(chance)
        if recording is None:
            return None
        answer = client.post("/api/v1/analyses", json={"method": "noise_analysis", "recordings": [recording]})
        if answer.status_code == 201:
            with self._mutex:
                self._results = [*self._results[-50:], answer.json()["id"]]
        return answer

    def _figure(self, client: httpx.Client, chance: random.Random) -> httpx.Response | None:
        """A result's page and its first figure."""
        with self._mutex:
            result = chance.choice(self._results) if self._results else None
        if result is None:
            return None
        page = client.get(f"/results/{result}")
        image = re.search(r'"(/results/[^"]+\.svg\?[^"]+)"', page.text)
        return page if image is None else client.get(html.unescape(image[1]))

    def _listener(self, client: httpx.Client, chance: random.Random) -> httpx.Response:
        """A browser's stream of events for a while; it beats every second."""
        with client.stream("GET", "/api/v1/feed") as stream:
            for _ in zip(stream.iter_raw(), range(chance.randrange(1, WATCHED)), strict=False):
                if self._ending.is_set():
                    break
        return stream

    def _export(self, client: httpx.Client, chance: random.Random) -> httpx.Response | None:
        recording = self._some(chance)
        form = chance.choice(("csv", "arrow", "parquet"))
        return None if recording is None else client.get(f"/api/v1/recordings/{recording}/data?format={form}")

    def _page(self, client: httpx.Client, chance: random.Random) -> httpx.Response:
        return client.get(chance.choice(PAGES))

    def _stop(self, client: httpx.Client, chance: random.Random) -> httpx.Response:
        answer = client.post("/api/v1/benches/sim/stop", json={"reason": "a soak", "by": f"client {chance.random()}"})
        for _ in range(RELEASES):  # refused while the bench is being made safe; then the bench would do nothing more
            standing = client.get("/api/v1/benches/sim").json()["stops"]
            if not standing:
                break
            for stop in standing:
                path = f"/api/v1/benches/sim/stops/{stop['id']}/release"
                client.post(path, json={"by": "a soak", "remark": "goes on"})
            pause(0.2)
        return answer
