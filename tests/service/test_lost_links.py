"""A device whose link is lost is not called safe by anybody, however often its link is taken anew, until it is back."""

import asyncio
import json
from collections.abc import Generator
from contextlib import contextmanager
from datetime import datetime, timedelta
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from bench_service import wall_clock
from bench_service.bench.devices import AT_REST, DeviceState
from bench_service.cli.asking.client import connect
from bench_service.drivers.device_faults import FaultPlan
from bench_service.drivers.device_register import DeviceRegister
from bench_service.drivers.registered import RegisteredDevices
from bench_service.drivers.simulated import SimulatedDriver
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, now, pause
from procedures.bench import BenchNeeds
from procedures.bench.errors import Disconnected
from procedures.core.table_angles import TableAngles
from tests.kit.abandoned_bench import abandoned
from tests.kit.thermal_plan import SHORT
from tests.service.client import Client

RELEASE, BENCH = "/api/v1/benches/sim/release", "/api/v1/benches/sim"


CHAMBER = "the chamber cannot be reached: its link is lost"


@pytest.fixture
def register(tmp_path: Path) -> DeviceRegister:
    """Register of a bench that a process left in a move, its chamber commanded to 60 °C, its ambient being 22 °C."""
    made = abandoned(tmp_path, "job-1")
    link = made.open("a process that died too")
    link.note("chamber.command", {}, chamber_target_c=60.0, chamber_ambient_c=22.0)
    link.close()
    return made


def state(register: DeviceRegister) -> DeviceState:
    found = register.read()
    assert found is not None
    return found


def test_a_lost_link_is_back_once_its_file_is_deleted_or_its_time_is_over(
    register: DeviceRegister, monkeypatch: pytest.MonkeyPatch
) -> None:
    cables = register.cables
    cables.need("chamber")
    real = wall_clock.now
    cables.cut("chamber", "a test", 60.0)
    with pytest.raises(Disconnected, match=r"^the chamber cannot be reached: its link is lost \(a test\)$"):
        cables.need("chamber")
    cables.need("turntable")
    with monkeypatch.context() as later:
        later.setattr(wall_clock, "now", lambda: real() + timedelta(seconds=61))
        cables.need("chamber")
    cables.file("chamber").unlink()
    cables.file("chamber").touch()  # what a person does who pulls it out
    cables.cut("chamber", "a moment only", 1e-3)
    pause(0.01)
    with pytest.raises(Disconnected):
        DeviceRegister(cables.file("chamber").parent, "sim").cables.need("chamber")
    cables.file("chamber").unlink()
    cables.need("chamber")


def test_what_can_be_reached_is_made_safe_and_what_cannot_is_named(register: DeviceRegister) -> None:
    devices = RegisteredDevices(register)
    register.cables.cut("chamber", "")
    register.cables.cut("supply", "")
    for _ in range(2):  # another try is no other truth
        with pytest.raises(ExceptionGroup) as refused:
            devices.make_safe("a test")
        assert [str(error) for error in refused.value.exceptions] == [
            CHAMBER,
            "the supply cannot be reached: its link is lost",
        ]
        left = state(register)
        assert (left.table, left.powered, left.chamber_target_c) == (AT_REST, True, 60.0)
        assert left.unsafe[:2] == ("the unit is on", "the chamber is commanded to 60 °C")
        assert left.fault == f"{CHAMBER}; the supply cannot be reached: its link is lost"
        assert not left.linked, "the link of the others is kept from everybody"
    register.cables.file("supply").unlink()
    with pytest.raises(ExceptionGroup):
        devices.make_safe("a test")
    left = state(register)
    assert (left.powered, left.fault, left.safe) == (False, CHAMBER, False)
    register.cables.file("chamber").unlink()
    assert devices.make_safe("a test").safe


def faulty_bench(folder: Path, from_s: float) -> Path:
    """The truth file of a bench whose chamber's link is lost for good from a moment of bench time."""
    shipped = files("simulators").joinpath("truths", "default_bench.toml").read_text(encoding="utf-8")
    path = folder / "bench.toml"
    path.write_text(f'{shipped}\n[[chamber_faults]]\nname = "link_lost"\nfrom_s = {from_s}\n', encoding="utf-8")
    return path


def test_a_chamber_that_was_lost_while_nobody_asked_it_is_lost_for_the_next_process(tmp_path: Path) -> None:
    register = DeviceRegister(tmp_path, "sim")
    driver = SimulatedDriver("sim", bench_truth=faulty_bench(tmp_path, 90.0), register=register)
    bench = driver.open("SIM-0001", 1, None, BenchNeeds(temperatures=True), "job-1")

    async def drive() -> None:
        assert bench.chamber is not None
        await bench.supply.switch_on()
        await bench.chamber.command(60.0, 5.0)
        await bench.clock.sleep(60.0)
        await bench.turntable.move_to(TableAngles(0.0, 5.0, 0.0))
        assert not register.cables.file("chamber").exists()
        await bench.clock.sleep(60.0)
        await bench.turntable.move_to(TableAngles(0.0, 10.0, 0.0))

    asyncio.run(drive())
    bench.close()  # as at its process's death, nothing is made safe
    with pytest.raises(ExceptionGroup) as refused:
        RegisteredDevices(DeviceRegister(tmp_path, "sim")).make_safe("the next process")
    assert [str(e) for e in refused.value.exceptions] == [f"{CHAMBER} (as the bench's truth file has it)"]
    left = state(register)
    assert (left.table, left.powered, left.chamber_target_c) == (AT_REST, False, 60.0)


def test_the_job_makes_safe_what_it_reaches_and_names_every_device_that_it_does_not(tmp_path: Path) -> None:
    register = DeviceRegister(tmp_path, "sim")
    bench = SimulatedDriver("sim", register=register).open("SIM-0001", 1, None, BenchNeeds(temperatures=True), "job")
    asyncio.run(bench.supply.switch_on())
    asyncio.run(bench.turntable.move_to(TableAngles(0.0, 5.0, 0.0)))
    register.cables.cut("chamber", "")
    register.cables.cut("turntable", "")
    with pytest.raises(ExceptionGroup) as refused:
        asyncio.run(bench.make_safe())
    assert all(isinstance(error, Disconnected) for error in refused.value.exceptions)
    left = state(register)
    assert not left.powered
    assert left.fault == f"turntable: the turntable cannot be reached: its link is lost; chamber: {CHAMBER}"
    for device in ("chamber", "turntable"):
        register.cables.file(device).unlink()
    asyncio.run(bench.make_safe())
    assert state(register).safe
    bench.close()


@contextmanager
def service(folder: Path, **settings: Any) -> Generator[Client]:
    with connect(Settings(database_url=f"sqlite:///{folder / 'bench.sqlite'}", **settings), None, drive=True) as http:
        yield Client(http)


def bench_of(client: Client) -> dict[str, Any]:
    return client.http.get(BENCH).json()


def refused_release(client: Client) -> str:
    """Why a release is refused; the bench is stopped after as before."""
    answer = client.http.post(RELEASE)
    assert answer.status_code == 409, answer.text
    assert answer.json()["type"] == "/problems/NotSafe"
    assert bench_of(client)["state"] == "stopped"
    return answer.json()["detail"]


def test_a_chamber_lost_for_good_stops_the_bench_until_a_person_plugs_it_in(tmp_path: Path) -> None:
    """The scripted fault of the truth file, through a job, a stop, refused releases, a restart, and the repair."""
    truth = faulty_bench(tmp_path, 2400.0)
    with service(tmp_path, bench_truth=truth) as client:
        job = client.wait(client.submit("thermal_cycle", parameters=SHORT, seed=1)["id"])
        assert (job["state"], job["error"]["kind"]) == ("failed", "Disconnected")
        seen = bench_of(client)
        assert seen["state"] == "stopped"
        assert f"could not be made safe: {CHAMBER}" in seen["stopped"]
        assert seen["stopped"].count("cannot be reached") == 1, "the second try says the same again"
        assert seen["safety"]["safe"] is False
        devices = seen["safety"]["devices"]
        assert (devices["table"], devices["powered"], devices["chamber_target_c"]) == ("at rest", False, 20.0)
        assert CHAMBER in seen["safety"]["explanation"]
        assert f"'sim' is not released: could not be made safe: {CHAMBER}" in refused_release(client)
        waiting = client.submit("no_operation")["id"]
        assert client.job(waiting)["state"] == "queued"
    with service(tmp_path, bench_truth=truth) as client:
        assert bench_of(client)["safety"]["safe"] is False
        assert CHAMBER in refused_release(client)
        (tmp_path / "bench-sim.chamber.lost").unlink()
        released = client.http.post(RELEASE)
        assert released.status_code == 200, released.text
        assert released.json()["safety"]["safe"] is True
        client.wait(waiting, "succeeded")


def test_a_link_that_is_lost_for_a_while_keeps_the_bench_stopped_for_so_long(tmp_path: Path) -> None:
    rule = {"verb": "turntable.move_to", "kind": "lost", "probability": 1.0, "lasts_s": 4.0}
    with service(tmp_path, device_faults=json.dumps({"rules": [rule]})) as client:
        job = client.wait(client.submit(seed=1)["id"])
        lost = json.loads((tmp_path / "bench-sim.turntable.lost").read_text())
        begun = monotonic_s()
        assert "the turntable cannot be reached: its link is lost (an injected fault)" in job["error"]["message"]
        assert "the turntable cannot be reached" in refused_release(client)
        assert bench_of(client)["safety"]["devices"]["powered"] is False
        while client.http.post(RELEASE).status_code == 409:
            assert monotonic_s() - begun < 20.0
            pause(0.2)
        assert bench_of(client)["safety"]["safe"] is True
        assert now() >= datetime.fromisoformat(lost["until"])


def test_a_unit_whose_link_is_lost_fails_its_job_and_leaves_a_safe_bench(tmp_path: Path) -> None:
    """Nothing that makes a bench safe goes over the unit's own data link."""
    plan = FaultPlan.parse('{"rules": [{"verb": "imu.block", "kind": "lost", "probability": 1.0}]}')
    register = DeviceRegister(tmp_path, "sim")
    bench = SimulatedDriver("sim", register=register, faults=plan).open("SIM-0001", 1, None, BenchNeeds(), "job-1")

    async def record() -> None:
        await bench.supply.switch_on()
        async for _ in bench.imu.record(1.0).blocks:
            pass

    with pytest.raises(Disconnected, match="the imu cannot be reached"):
        asyncio.run(record())
    asyncio.run(bench.make_safe())
    assert state(register).safe
    bench.close()
