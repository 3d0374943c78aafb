"""Manual mode over HTTP on a simulated bench: demands, refusals, the queue, every end, and who may do what.

The bench runs at a factor of 20, so a move of seconds takes tenths; a lease's time is real time.
"""

from collections.abc import Generator
from pathlib import Path
from typing import Any
from uuid import uuid4

import httpx
import pytest

from bench_service.cli.asking.client import connect
from bench_service.drivers.device_register import DeviceRegister
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, now, pause
from tests.kit.busy_machine import BUSY_S
from tests.service.client import Client

BENCH = "/api/v1/benches/sim"
MANUAL = f"{BENCH}/manual"
FACTOR = 20.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("devices")


@pytest.fixture(scope="module")
def client(folder: Path) -> Generator[Client]:
    url = f"sqlite:///{folder / 'bench.sqlite'}"
    with connect(Settings(database_url=url, device_folder=folder, real_time_factor=FACTOR), None, drive=True) as http:
        yield Client(http)


class Hand:
    """An operator with a lease."""

    def __init__(self, client: Client, minutes: float = 5.0, **more: Any) -> None:
        self.http: httpx.Client = client.http
        body = {"reason": "a look at the table", "minutes": minutes, "by": "ann", **more}
        answer = self.http.post(MANUAL, json=body)
        assert answer.status_code == 201, answer.text
        self.lease = answer.json()
        self.path = f"{MANUAL}/{self.lease['id']}"

    def ask(self, kind: str, key: str | None = None, **values: Any) -> httpx.Response:
        headers = {"Idempotency-Key": key or str(uuid4())}
        return self.http.post(f"{self.path}/demands", json={"kind": kind, "by": "ann", **values}, headers=headers)

    def answered(self, kind: str, **values: Any) -> dict[str, Any]:
        """A demand, once nothing more becomes of it."""
        made = self.ask(kind, **values)
        assert made.status_code == 202, made.text
        return self.over(made.json()["key"])

    def over(self, key: str) -> dict[str, Any]:
        return _until(lambda: (d := self.http.get(f"{self.path}/demands/{key}").json())["over"] and d)

    def live(self) -> dict[str, Any]:
        return self.http.get(BENCH).json()["live"]

    def read(self) -> dict[str, Any]:
        return self.http.get(self.path).json()

    def ended(self) -> dict[str, Any]:
        return _until(lambda: (lease := self.read())["ended_at"] and lease)

    def end(self) -> dict[str, Any]:
        assert self.http.post(f"{self.path}/end", json={"by": "bob"}).status_code == 200
        return self.ended()


@pytest.fixture
def leave(client: Client) -> Generator[None]:
    """Whatever a test leaves open ends with it."""
    yield
    lease = client.http.get(f"{MANUAL}/now")
    if lease.is_success:
        client.http.post(f"{MANUAL}/{lease.json()['id']}/end", json={})
        _until(lambda: client.http.get(f"{MANUAL}/now").status_code == 404)


pytestmark = pytest.mark.usefixtures("leave")


def _until(ready: Any, seconds: float = 20.0) -> Any:
    deadline = monotonic_s() + seconds
    while not (found := ready()):
        assert monotonic_s() < deadline
        pause(0.02)
    return found


def _safe(folder: Path) -> bool:
    state = DeviceRegister(folder, "sim").read()
    return state is not None and state.safe


def test_a_lease_from_home_to_its_end(client: Client, folder: Path) -> None:
    hand = Hand(client)
    assert (hand.lease["holder"], hand.lease["proven"], hand.lease["unit"]) == ("ann", False, "SIM-0001")
    done = hand.answered("go_to", middle_deg=30.0, inner_deg=-45.0)
    assert (done["state"], done["text"]) == ("done", "at rest at 0.0000, 30.0000, -45.0000 deg")
    assert hand.answered("supply_on")["state"] == "done"
    assert hand.answered("chamber", temperature_c=40.0)["text"].startswith("commanded to 40 °C at ")
    rate = hand.ask("rate", axis="outer", rate_deg_s=10.0, duration_s=200.0).json()

    def read_out() -> dict[str, Any] | None:
        live = hand.live()
        known = live["manual"] and live["manual"]["sensors"]
        return live if known and abs(live["devices"]["rates_deg_s"][0] - 10.0) < 0.01 else None

    turning_s = _until(read_out)["manual"]["sensors_at_s"]  # the sensors' mean may still be of the ramp
    live = _until(lambda: (new := read_out()) and new["manual"]["sensors_at_s"] > turning_s + 0.3 and new)
    devices, manual = live["devices"], live["manual"]
    assert (manual["holder"], manual["doing"], manual["sensors_problem"]) == ("ann", "rate", "")
    assert devices["voltage_v"] == pytest.approx(28.0, abs=0.5)
    assert devices["chamber"]["target_c"] == 40.0
    values = {sensor["name"]: sensor["value"] for sensor in manual["sensors"]}
    # The outer axis carries the unit's axes by angles that are known: only the size of its rate is compared here.
    turned = sum(values[f"gyro_{axis}"] ** 2 for axis in "xyz") ** 0.5
    assert turned == pytest.approx(0.17453, rel=0.01)
    assert any("temperature" in name or "thermometer" in name for name in values) or len(values) > 6
    assert hand.answered("halt")["state"] == "done"
    assert hand.over(rate["key"])["state"] == "stopped"
    assert hand.answered("home")["text"] == "at rest at 0.0000, 0.0000, 0.0000 deg"
    assert not _safe(folder)
    lease = hand.end()
    assert (lease["ended_because"], lease["safe"]) == ("ended by bob", True)
    assert _safe(folder)
    assert hand.ask("home").status_code == 409
    states = {d["kind"]: d["state"] for d in hand.http.get(f"{hand.path}/demands").json()["items"]}
    assert states == {
        "home": "done",
        "halt": "done",
        "rate": "stopped",
        "chamber": "done",
        "supply_on": "done",
        "go_to": "done",
    }


@pytest.mark.parametrize(
    ("kind", "values", "field", "allowed"),
    [
        ("go_to", {"middle_deg": 191.0}, "middle_deg", "-190 … 190"),
        ("go_to", {}, "outer_deg", "one axis at least"),
        ("rate", {"axis": "outer", "rate_deg_s": 0.0, "duration_s": 5.0}, "rate_deg_s", "not 0"),
        ("rate", {"axis": "outer", "rate_deg_s": 9999.0, "duration_s": 50.0}, "rate_deg_s", "from -"),
        ("rate", {"axis": "outer", "rate_deg_s": 5.0, "duration_s": 1.0}, "duration_s", "from two ramps, 2"),
        ("rate", {"axis": "outer", "rate_deg_s": 50.0, "duration_s": 9.0, "ramp_s": 0.01}, "ramp_s", "from "),
        ("chamber", {"temperature_c": 900.0}, "temperature_c", "the chamber's range"),
        ("chamber", {"temperature_c": 30.0, "ramp_c_min": 99.0}, "ramp_c_min", "at most"),
        ("supply_on", {"voltage_v": 99.0}, "voltage_v", "…"),
    ],
)
def test_a_demand_beyond_a_limit_is_refused_with_field_value_and_range(
    client: Client, kind: str, values: dict[str, Any], field: str, allowed: str
) -> None:
    hand = Hand(client)
    answer = hand.ask(kind, **values)
    assert answer.status_code == 422, answer.text
    (error,) = answer.json()["errors"]
    assert error["field"] == field
    assert allowed in error["message"]
    assert error["value"] == values.get(field)
    assert hand.http.get(f"{hand.path}/demands").json()["items"] == []
    hand.end()


def test_what_only_the_table_knows_is_refused_by_the_worker(client: Client) -> None:
    hand = Hand(client)
    assert hand.answered("go_to", middle_deg=180.0)["state"] == "done"
    refused = hand.answered("rate", axis="middle", rate_deg_s=10.0, duration_s=20.0)
    assert (refused["state"], refused["field"], refused["value"]) == ("refused", "duration_s", 20.0)
    assert refused["allowed"].startswith("at most 2: from 180 deg")
    turning = hand.ask("rate", axis="outer", rate_deg_s=5.0, duration_s=400.0).json()["key"]
    _until(lambda: (hand.live()["manual"] or {}).get("doing") == "rate")
    assert hand.answered("go_to", middle_deg=0.0)["text"].startswith("the table is moving (rate): halt it")
    hand.end()
    assert hand.over(turning)["state"] == "stopped"


def test_a_key_makes_one_demand(client: Client) -> None:
    hand = Hand(client)
    first, again = (hand.ask("go_to", "one", outer_deg=5.0) for _ in range(2))
    assert (first.json()["at"], first.status_code) == (again.json()["at"], again.status_code)
    other = hand.ask("go_to", "one", outer_deg=6.0)
    assert (other.status_code, other.json()["type"]) == (409, "/problems/IdempotencyConflict")
    hand.over("one")
    assert len(hand.http.get(f"{hand.path}/demands").json()["items"]) == 1
    hand.end()


def test_no_job_starts_meanwhile_and_the_queue_says_why(client: Client) -> None:
    hand = Hand(client)
    job = client.submit("no_operation", seed=1)
    waiting = _until(lambda: client.job(job["id"]).get("waiting"))
    assert waiting.startswith("bench sim is in manual mode by ann until "), waiting
    assert waiting.endswith(": a look at the table")
    second = hand.http.post(MANUAL, json={"reason": "me too", "by": "cyd"})
    assert (second.status_code, "is in manual mode by ann" in second.json()["detail"]) == (409, True)
    assert client.job(job["id"])["state"] == "queued"
    hand.end()
    assert client.wait(job["id"])["state"] == "succeeded"


def test_it_is_refused_while_a_job_runs(client: Client) -> None:
    job = client.submit(seed=3, parameters={"dwell_s": 200.0, "settle_s": 0.5})
    client.wait(job["id"], "running")
    answer = client.http.post(MANUAL, json={"reason": "now", "by": "ann"})
    assert (answer.status_code, answer.json()["type"]) == (409, "/problems/ManualRefused")
    assert f"job {job['id']} drives bench sim" in answer.json()["detail"]
    client.http.post(f"/api/v1/jobs/{job['id']}/cancel")
    client.wait(job["id"])


def test_it_is_refused_where_another_holder_has_reserved(client: Client) -> None:
    made = client.http.post("/api/v1/reservations", json={"bench": "sim", "holder": "dan", "minutes": 5}).json()
    refused = client.http.post(MANUAL, json={"reason": "now", "by": "ann"})
    assert (refused.status_code, refused.json()["type"]) == (409, "/problems/AlreadyReserved")
    Hand(client, reservation=made["id"]).end()
    client.http.delete(f"/api/v1/reservations/{made['id']}")


def test_only_its_holder_commands_and_renews_and_anybody_ends(client: Client) -> None:
    hand = Hand(client)
    hand.answered("supply_on")  # the lease has begun: one that ends before was nothing to make safe
    for path, body in (("demands", {"kind": "home"}), ("renew", {"minutes": 5})):
        answer = hand.http.post(f"{hand.path}/{path}", json={**body, "by": "bob"})
        assert (answer.status_code, answer.json()["type"]) == (403, "/problems/NotAllowed")
    renewed = hand.http.post(f"{hand.path}/renew", json={"minutes": 60, "by": "ann"}).json()
    assert renewed["until"] > hand.lease["until"]
    assert hand.end()["safe"] is True


def test_a_stop_ends_it_at_once(client: Client, folder: Path) -> None:
    hand = Hand(client)
    hand.answered("supply_on")
    hand.ask("rate", axis="outer", rate_deg_s=30.0, duration_s=600.0)
    _until(lambda: abs((hand.live()["devices"] or {}).get("rates_deg_s", [0])[0] - 30.0) < 0.01)
    begun = monotonic_s()
    assert hand.http.post(f"{BENCH}/stop", json={"reason": "smoke"}).status_code == 202
    _until(lambda: _safe(folder))
    assert monotonic_s() - begun < BUSY_S, "it turned to the end of its 30 s"
    assert hand.ended()["ended_because"].startswith("the bench was stopped")
    refused = hand.http.post(MANUAL, json={"reason": "now", "by": "ann"})
    assert (refused.status_code, "is stopped" in refused.json()["detail"]) == (409, True)
    assert hand.http.post(f"{BENCH}/release").status_code == 200


def test_it_ends_by_itself_in_mid_motion_while_the_service_is_busy(client: Client, folder: Path) -> None:
    hand = Hand(client, minutes=0.05)
    hand.answered("supply_on")
    hand.ask("rate", axis="outer", rate_deg_s=30.0, duration_s=600.0)
    while now().isoformat() < hand.lease["until"].replace("Z", "+00:00"):  # requests as fast as they are answered
        assert client.http.get("/api/v1/jobs").status_code == 200
    lease = hand.ended()
    assert (lease["ended_because"], lease["safe"]) == ("its time has ended", True)
    assert _safe(folder)
    # A quarter of a second for the look at the time, a second for braking at the factor, and a busy machine.
    late_s = (_moment(lease["ended_at"]) - _moment(lease["until"])).total_seconds()
    assert 0.0 <= late_s < BUSY_S


def test_its_end_is_in_the_audit_trail(client: Client) -> None:
    hand = Hand(client)
    _until(lambda: hand.read()["began_at"])
    hand.end()
    entries = _until(
        lambda: [
            e
            for e in client.http.get("/api/v1/audit", params={"target": hand.lease["id"]}).json()["items"]
            if e["action"] == "manual_ended"
        ]
    )
    assert entries[0]["detail"] == {"because": "ended by bob", "safe": True}
    actions = {e["action"] for e in client.http.get("/api/v1/audit").json()["items"]}
    assert {"begin_manual", "end_manual", "demand_by_hand", "renew_manual"} <= actions


def _moment(text: str):
    from datetime import datetime

    return datetime.fromisoformat(text.replace("Z", "+00:00"))
