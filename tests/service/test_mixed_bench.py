"""A mixed bench behind the service: a job over real wires, what its recordings and its result say, and certificates."""

from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import pytest

from bench_service.cli.asking.client import connect
from bench_service.drivers.interface import registry
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause
from tests.kit import line_devices
from tests.kit.line_devices import LineDevice, bench_text, served
from tests.service.client import Client

CERTIFICATE = 'certificate = { number = "AT-117", laboratory = "PTB", due = 2020-03-02 }\n'
WARN = '[policy]\nexpired_certificate = "warn"\n[environment]\ntemperature_c = 21.5\n'
PLAN = {"positions": [[0, 90, 0, 1], [45, 0, -30, 1]], "delay_from": "rest", "settle_s": 0.0}


@pytest.fixture(scope="module")
def chamber() -> LineDevice:
    return line_devices.chamber()


@pytest.fixture(scope="module")
def east(tmp_path_factory: pytest.TempPathFactory, chamber: LineDevice) -> Generator[tuple[Client, LineDevice]]:
    """A service on a mixed bench whose table has an overdue certificate, under the policy that warns."""
    folder = tmp_path_factory.mktemp("east")
    table, supply = line_devices.table(), line_devices.supply()
    with pytest.MonkeyPatch.context() as patch, served(table, supply, chamber):
        patch.setattr(registry, "SHIPPED", line_devices.SHIPPED)
        path = folder / "east.toml"
        text = bench_text(table, supply, chamber, WARN)
        path.write_text(text.replace("[turntable]\n", "[turntable]\n" + CERTIFICATE))
        settings = Settings(database_url=f"sqlite:///{folder / 'bench.sqlite'}", bench_file=path)
        with connect(settings, None, drive=True) as http:
            yield Client(http), table


@pytest.fixture(scope="module")
def done(east: tuple[Client, LineDevice]) -> dict[str, Any]:
    client, _ = east
    return client.wait(client.submit("table_program", parameters=PLAN)["id"], seconds=60.0)


def test_a_job_runs_over_real_wires(east: tuple[Client, LineDevice], done: dict[str, Any]) -> None:
    client, table = east
    assert done["state"] == "succeeded", done
    assert table.demands().count("move") == 2
    assert (done["bench"], done["simulated"]) == ("east", True)
    found = client.http.get("/api/v1/benches/east").json()["description"]
    assert {d["name"]: d["simulated"] for d in found["devices"]}["unit_link"] is True


def test_a_recording_says_device_by_device_where_it_comes_from(
    east: tuple[Client, LineDevice], done: dict[str, Any]
) -> None:
    client, _ = east
    recording = client.recordings(done["id"])[0]
    assert recording["source"]["origin"] == "mixed"
    devices = recording["source"]["devices"]
    assert {name: d["simulated"] for name, d in devices.items()} == {
        "turntable": False,
        "supply": False,
        "unit_link": True,
        "chamber": False,
        "operator": True,
        "environment": False,
    }
    assert devices["turntable"]["identity"]["serial"] == "T-7"
    assert devices["turntable"]["certificate"] == {"number": "AT-117", "laboratory": "PTB", "due": "2020-03-02"}
    measured, angles = recording["measured"], recording["station"]["angles"]
    assert measured["angles"]["mean"] == angles
    assert measured["supply"]["voltage_v"] == 28.0
    assert measured["environment"] == {"temperature_c": 21.5, "humidity_percent": None, "pressure_hpa": None}


def test_the_result_is_marked_and_says_which_angles_were_used(
    east: tuple[Client, LineDevice], done: dict[str, Any]
) -> None:
    client, _ = east
    result = client.http.get(f"/api/v1/jobs/{done['id']}/result").json()
    warnings = result["document"]["warnings"]
    assert warnings[0] == "the certificate AT-117 of the turntable has expired: it was valid until 2020-03-02"
    assert warnings[1] == "the angles are those that the table's encoders measured, at all 2 stations"


def test_an_encoder_that_disagrees_fails_the_job(east: tuple[Client, LineDevice]) -> None:
    client, table = east
    honest = table.answer

    def lying(request: dict[str, Any]) -> dict[str, Any]:
        answer = honest(request)
        return {**answer, "angles": [a + 5.0 for a in answer["angles"]]} if request["verb"] == "read" else answer

    table.answer = lying  # type: ignore[method-assign]
    try:
        job = client.wait(client.submit("table_program", parameters=PLAN)["id"])
    finally:
        table.answer = honest  # type: ignore[method-assign]
    assert job["state"] == "failed"
    assert "encoder shows" in job["error"]["message"]
    assert "find out why before anything else moves" in job["error"]["message"]


def test_a_simulated_unit_follows_the_real_chambers_air(east: tuple[Client, LineDevice], chamber: LineDevice) -> None:
    """By hand: the real chamber's air jumps, and the unit's case sensor goes after it; a thermal job is planned too."""
    client, _ = east
    preview = client.http.post(
        "/api/v1/jobs/preview", json={"procedure": "thermal_cycle", "unit": "SIM-0001", "parameters": {}}
    )
    assert "does not feel" not in preview.text
    manual = "/api/v1/benches/east/manual"
    lease = client.http.post(manual, json={"reason": "heat", "by": "ann"}).json()["id"]

    def case_c() -> float | None:
        live = client.http.get("/api/v1/benches/east").json()["live"]
        sensors = {s["name"]: s["value"] for s in (live["manual"] or {"sensors": []})["sensors"]}
        return sensors.get("temperature_case")

    def once(ready: Callable[[], Any], seconds: float = 20.0) -> Any:
        deadline = monotonic_s() + seconds
        while not (found := ready()):
            assert monotonic_s() < deadline
            pause(0.05)
        return found

    try:
        client.http.post(f"{manual}/{lease}/demands", json={"kind": "supply_on", "by": "ann"})
        first = once(case_c)
        assert first == pytest.approx(22.0, abs=1.0)
        chamber.state["air"] = 82.0
        # 60 K between air and case warm the case of the shipped truth by some 0.1 K/s; its power alone does far less.
        once(lambda: (case_c() or 0.0) > first + 0.3)
    finally:
        chamber.state["air"] = 22.0
        client.http.post(f"{manual}/{lease}/end", json={})
        once(lambda: client.http.get(f"{manual}/{lease}").json()["ended_at"])


def test_an_overdue_certificate_refuses_a_job_where_the_policy_says_so(
    tmp_path: Path, east: tuple[Client, LineDevice]
) -> None:
    """Planned by a service that drives nothing: the policy travels with the bench's description."""
    from bench_service.bench.directory import BenchDirectory
    from bench_service.drivers.bench_file.description import described
    from bench_service.drivers.bench_file.document import read_bench_file
    from bench_service.drivers.simulated import SimulatedDriver
    from bench_service.evidence.catalogue import Catalogue
    from bench_service.jobs.planning import Planner
    from bench_service.model.errors import NotFound

    simulated = SimulatedDriver("east")
    devices = (line_devices.table(), line_devices.supply(), line_devices.chamber())
    text = bench_text(*devices).replace(':0"', ':2049"').replace("[turntable]\n", "[turntable]\n" + CERTIFICATE)
    path = tmp_path / "east.toml"
    path.write_text(text)
    description = described(read_bench_file(path), simulated.description)

    class _Units:
        def unit(self, serial: str) -> Any:
            raise NotFound("unit", serial)

    class _Driver:
        def __init__(self) -> None:
            self.description = description
            self.mounted = simulated.mounted

    directory = BenchDirectory(None, _Units(), _Driver(), "east", lambda _: None, lambda _: None)  # pyright: ignore[reportArgumentType]
    planner = Planner(_Units(), directory, Catalogue())  # pyright: ignore[reportArgumentType]
    plan = planner.plan("calibration_12_orientations", "SIM-0001", {})
    assert plan.parameters.model_dump()["pointing_sd_arcsec"] == 0.5
    assert plan.violations[0] == "the certificate AT-117 of the turntable has expired: it was valid until 2020-03-02"
