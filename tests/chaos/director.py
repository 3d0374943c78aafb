"""The director of a chaos run: a seeded list of disasters, brought upon real processes one after the other."""

import json
import random
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import httpx

from tests.chaos.databases import OwnPostgres, SqliteFile
from tests.chaos.load import CAMPAIGN, KNOWN, SHORT, Asked, Clients
from tests.chaos.processes import Ledger, Program, Topology
from tests.chaos.witnesses import DatabaseWitness, DeviceWitness, Listener, is_safe, is_warm, register

START_S = 120.0
"""How long the first start may take [s], with the migration of an empty database, on a loaded machine."""
RETURN_S = 60.0
"""How long a process that was started again may take to drive its bench [s]."""
BUSY_S = 12.0
"""How long a disaster waits for a moment at which it hurts [s]; then it comes at any."""
PATIENCE_S = 1.0
"""How much longer one waits for a chamber that is led away from ambient, once the bench is not safe [s]."""
DRAIN_S = 240.0
"""How long the jobs may take to end after the last disaster [s]."""
LISTENERS = 3
"""How many jobs have a listener at once."""
LOST_S = 3.0
"""How long a link that is lost stays lost [s]: longer than what a worker tries, and than most kills take."""
FAULTS = (
    ("turntable.move_to", "fault", 0.01),
    ("turntable.move_to", "hang", 0.008),
    ("turntable.move_to", "lost", 0.004),
    ("chamber.command", "lost", 0.02),
    ("imu.block", "disconnect", 0.002),
)
"""What breaks of itself on the simulated benches meanwhile: verb, kind, probability each time."""
SETTINGS = {"BENCH_REAL_TIME_FACTOR": "150", "BENCH_RETRY_SCALE": "0.02"}
"""A move lasts a tenth of a second: long enough to be hit."""


def faults(seed: int) -> str:
    """The benches' setting for what breaks of itself."""
    rules = [{"verb": verb, "kind": kind, "probability": chance} for verb, kind, chance in FAULTS]
    lasting = [{**rule, "lasts_s": LOST_S} if rule["kind"] == "lost" else rule for rule in rules]
    return json.dumps({"seed": seed, "rules": lasting})


KINDS = {"worker": 6, "api": 2, "supervisor": 2, "worker and supervisor": 2, "all": 1, "term": 1, "database": 2}
"""Disasters, and how often each is chosen."""
SURE = 2
"""Which disaster is a restart of the database in every run that has a server: also in a short one."""


@dataclass(frozen=True)
class Disaster:
    """Disaster that happens to a bench: after a while, at a chosen moment, with a pause before the return."""

    kind: str
    bench: str
    api: int
    after_s: float
    aim: str
    """any; moving: while the bench is not safe; warm: while its chamber is led away from ambient, if it soon is."""
    mode: str
    """Of a database's restart."""
    pause_s: float
    patient: bool
    """Whether the next disaster waits until this one is over; else it may hit a process that is just starting."""


def disasters(seed: int, topology: Topology, restarts: bool) -> list[Disaster]:
    """More than any run needs, the same for the same seed."""
    chance = random.Random(f"disasters {seed}")
    kinds = {kind: weight for kind, weight in KINDS.items() if restarts or kind != "database"}
    if len(topology.apis) == 1:
        kinds.pop("api")
    return [
        Disaster(
            "database" if restarts and number == SURE else chance.choices(list(kinds), list(kinds.values()))[0],
            chance.choice(topology.benches),
            chance.randrange(len(topology.apis)),
            chance.uniform(0.0, 1.0),
            chance.choice(("any", "moving", "moving", "warm")),
            chance.choice(("fast", "immediate")),
            chance.uniform(0.0, 0.5),
            chance.random() < 0.7,
        )
        for number in range(5000)
    ]


@dataclass
class Run:
    """Record of a run, for the checker."""

    folder: Path
    topology: Topology
    clients: Clients
    devices: DeviceWitness
    rows: DatabaseWitness
    listeners: list[Listener] = field(default_factory=list)
    done: list[str] = field(default_factory=list)
    """Disasters in order, in words."""
    unsupervised: set[int] = field(default_factory=set)
    """Processes that were killed together with their supervisor, or while it was away."""
    restarts: int = 0
    drained: bool = False
    seconds: float = 0.0
    striking_s: float = 0.0
    """Of these, from the first disaster to the last [s]."""
    draining_s: float = 0.0
    """Of these, from the last disaster to the end of all that was begun [s]."""

    @property
    def kills(self) -> int:
        """Processes that were sent SIGKILL by the director."""
        return sum(death.how == "SIGKILL" for death in self.topology.ledger.deaths)


class Director:
    """Brings disasters upon a service until a number of its processes have been killed."""

    def __init__(self, database: SqliteFile | OwnPostgres, folder: Path, kills: int, seed: int, most_s: float) -> None:
        """`most_s`: after this time nothing more is killed, whatever was reached [s]."""
        self._most_s = most_s
        self._database = database
        self._kills = kills
        settings = {**SETTINGS, "BENCH_DEVICE_FAULTS": faults(seed)}
        self.topology = Topology(Ledger(), folder, database.url, settings)
        self._starting = False
        self._disasters = iter(disasters(seed, self.topology, database.restarts))
        clients = Clients(self.topology.ports, self.topology.benches, seed, 3 * kills + 20)
        devices = DeviceWitness(folder, self.topology.benches, LOST_S)
        self.run = Run(folder, self.topology, clients, devices, DatabaseWitness(database.url))

    def direct(self) -> Run:
        """The whole run. Whatever happens, no process of it is left."""
        run, begun = self.run, time.monotonic()
        witnesses = (run.devices, run.rows)
        try:
            self._begin()
            for thread in (*witnesses, run.clients):
                thread.start()
            first = time.monotonic()
            while run.kills < self._kills and time.monotonic() < begun + self._most_s:
                self._listen()
                self._bring(next(self._disasters))
            run.striking_s = time.monotonic() - first
            run.clients.submit_no_more()
            run.drained = self._drain()
            run.draining_s = time.monotonic() - first - run.striking_s
            self.topology.end_in_order()
        finally:
            for thread in (run.clients, *run.listeners, *witnesses):
                if thread.is_alive():
                    thread.end()
            self.topology.end_at_once()
            run.seconds = time.monotonic() - begun
        return run

    def _begin(self) -> None:
        """Start everything, store the campaign, enter known coefficients, and calibrate the unit once."""
        self.topology.start()
        address = f"http://127.0.0.1:{self.topology.ports[0]}"
        with httpx.Client(base_url=address, timeout=30, trust_env=False) as http:
            self._until(lambda: _answers(http), START_S, "the service answers")
            self._until(lambda: all(map(self.topology.drives, self.topology.benches)), START_S, "benches are driven")
            added = http.post("/api/v1/campaigns", json=CAMPAIGN)
            assert added.status_code == 201, added.text
            for coefficients in KNOWN:
                entered = http.post("/api/v1/units/SIM-0001/calibrations", json=coefficients)
                assert entered.status_code == 201, entered.text
        body = {"procedure": "calibration_12_orientations", "unit": "SIM-0001", "parameters": SHORT, "retries": 5}
        first = Asked("chaos-first", {**body, "bench": self.topology.benches[0], "seed": 1}, "none")
        clients = self.run.clients  # devices fail already: a bench may have to be released before its job goes on
        self._until(lambda: clients.see_through(first) == "succeeded", START_S, "the unit is calibrated")
        self._until(lambda: all(map(self.topology.supervisor, self.topology.benches)), START_S, "all are supervised")

    def _bring(self, disaster: Disaster) -> None:
        topology, bench = self.topology, disaster.bench
        time.sleep(disaster.after_s)
        if disaster.aim != "any" and not self._starting:
            self._wait_for_harm(bench, PATIENCE_S if disaster.aim == "warm" else 0.0)
        said = f"{disaster.kind} of {bench}" if disaster.kind not in ("all", "api", "database") else disaster.kind
        self.run.done.append(f"{said} {disaster.mode}" if disaster.kind == "database" else said)
        if disaster.kind == "database":
            self._database.restart(disaster.mode)
            self.run.restarts += 1
        elif disaster.kind == "term":
            topology.workers[bench].strike(signal.SIGTERM)
        elif disaster.kind == "api":
            topology.apis[disaster.api].strike()
        elif disaster.kind == "supervisor":
            topology.strike_supervisor(bench)
        else:
            self._kill(disaster)
        time.sleep(disaster.pause_s)
        topology.start()
        if disaster.kind in ("supervisor", "worker and supervisor", "all"):
            for each in topology.benches:
                if not topology.supervisor(each):
                    topology.supervise(each)
        self._starting = not disaster.patient
        if disaster.patient:
            self._until(lambda: topology.drives(bench), RETURN_S, f"bench {bench} is driven again")

    def _kill(self, disaster: Disaster) -> None:
        topology = self.topology
        benches = topology.benches if disaster.kind == "all" else (disaster.bench,)
        alone = {bench for bench in benches if disaster.kind != "worker" or not topology.supervisor(bench)}
        for bench in benches:
            if disaster.kind != "worker":
                topology.strike_supervisor(bench)
            worker = topology.workers[bench]
            if bench in alone:
                self.run.unsupervised.add(worker.pid)
            worker.strike()
        if disaster.kind == "all":
            for api in topology.apis:
                api.strike()

    def _wait_for_harm(self, bench: str, patience_s: float) -> None:
        """Until the bench is not safe: that is when a death matters. For the chamber's sake, `patience_s` longer."""
        end, unsafe_since = time.monotonic() + BUSY_S, None
        while (now := time.monotonic()) < end:
            state = register(self.run.folder / f"bench-{bench}.devices")
            if state is not None and not is_safe(state) and state["linked"]:
                unsafe_since = now if unsafe_since is None else unsafe_since
                if is_warm(state) or now - unsafe_since >= patience_s:
                    return
            time.sleep(0.005)

    def _listen(self) -> None:
        """Give some of the open jobs a listener."""
        heard = {listener.job for listener in self.run.listeners}
        jobs = [asked for asked in self.run.clients.open if asked in self.run.clients.jobs]
        fresh = [asked for asked in jobs if asked.id and asked.id not in heard]
        busy = sum(listener.job in {asked.id for asked in jobs} for listener in self.run.listeners)
        for asked in fresh[: max(0, LISTENERS - busy)]:
            listener = Listener(self.topology.ports, asked.id)
            listener.start()
            self.run.listeners.append(listener)

    def _drain(self) -> bool:
        """Let everything that was begun come to its end, and every bench be safe: a link that is lost comes back.

        A process that ended by itself is started again.
        """
        end = time.monotonic() + DRAIN_S
        while (self.run.clients.open or not self._safe()) and time.monotonic() < end:
            self.topology.start()
            time.sleep(0.1)
        while any(listener.is_alive() for listener in self.run.listeners) and time.monotonic() < end:
            time.sleep(0.1)  # they hear the last
        time.sleep(1.0)  # witnesses see it
        return not self.run.clients.open

    def _safe(self) -> bool:
        states = [register(self.run.folder / f"bench-{bench}.devices") for bench in self.topology.benches]
        return all(state is None or is_safe(state) for state in states)

    def _until(self, reached: Callable[[], object], seconds: float, what: str) -> None:
        end = time.monotonic() + seconds
        while not reached():
            if time.monotonic() > end:
                logs = "\n".join(
                    f"== {p.name}\n{p.log.read_text()[-2000:]}" for p in self._programs() if p.log.exists()
                )
                raise AssertionError(f"not within {seconds:g} s: {what}\n{logs}")
            self.topology.start()  # a worker whose bench was still held ends, and is started again
            time.sleep(0.02)

    def _programs(self) -> tuple[Program, ...]:
        return (*self.topology.apis, *self.topology.workers.values())


def _answers(http: httpx.Client) -> bool:
    try:
        return http.get("/healthz").is_success
    except httpx.TransportError:
        return False
