"""Starts of a service beside devices that a dead process left, and stops that wait for a living one: what is done."""

from collections.abc import Callable
from pathlib import Path
from threading import Thread
from types import SimpleNamespace
from typing import Any

import pytest

from bench_service.bench import safety
from bench_service.bench.processes import Driving, ProcessIdentity
from bench_service.bench.safety import SafetyService
from bench_service.drivers.device_register import DeviceRegister
from bench_service.drivers.registered import RegisteredDevices
from bench_service.model.errors import NotFound
from bench_service.model.records import BenchStop
from bench_service.wall_clock import monotonic_s
from tests.kit.abandoned_bench import abandoned
from tests.kit.busy_machine import BUSY_S
from tests.kit.supervised_bench import Watch

LEFT = "when the service started, the table moves and the unit is on: "


class Scene:
    """A service's safety with books in memory, on the devices of a folder."""

    def __init__(self, register: DeviceRegister, driving: Driving | None = None) -> None:
        self.stops: list[BenchStop] = []
        self.notes: list[tuple[str, str]] = []
        self.register, self.devices = register, RegisteredDevices(register)
        benches: Any = SimpleNamespace(stop_bench_once=self.stops.append)
        self.safety = SafetyService(benches, lambda _: self.devices, lambda _: Watch(driving), self.note)

    def note(self, job: str, kind: str, at: object, said: dict[str, Any]) -> None:
        self.notes.append((job, said["text"]))

    def is_safe(self) -> bool:
        state = self.register.read()
        return state is not None and state.safe

    def commands(self) -> list[str]:
        return [entry["verb"] for entry in self.register.journal.entries() if "make_safe" in entry["verb"]]


def test_what_a_dead_process_left_is_made_safe_and_its_job_says_so(tmp_path: Path) -> None:
    scene = Scene(abandoned(tmp_path, "job-1"))
    scene.safety.at_start("sim")
    assert scene.is_safe()
    assert scene.notes == [("job-1", LEFT + "made safe first")]
    assert scene.stops == []
    done = scene.commands()
    scene.safety.at_start("sim")
    assert scene.commands() == done, "devices that are safe are not commanded again"
    assert len(scene.notes) == 1


def test_devices_that_cannot_be_reached_stop_the_bench_and_the_job_says_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(safety, "START_S", 0.0)
    register = abandoned(tmp_path, "job-1")
    register.cables.cut("supply", "")
    scene = Scene(register)
    scene.safety.at_start("sim")
    assert not scene.is_safe()
    (stop,) = scene.stops
    assert stop.bench == "sim"
    assert "the supply cannot be reached: its link is lost" in stop.reason
    assert scene.notes == [("job-1", LEFT + stop.reason)]


def test_a_link_that_another_process_holds_is_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A supervisor that is just making the bench safe has it for a moment."""
    register = abandoned(tmp_path, "job-1")
    link, looks = register.open(by="the supervisor"), 0

    def given_back_at_the_third(_: float) -> None:
        nonlocal looks
        looks += 1
        if looks == 3:
            link.close()

    monkeypatch.setattr(safety, "pause", given_back_at_the_third)
    monkeypatch.setattr(safety, "START_S", BUSY_S)
    scene = Scene(register)
    scene.safety.at_start("sim")
    assert (scene.is_safe(), looks, scene.stops) == (True, 3, [])


def test_the_first_start_on_a_host_makes_its_devices_known(tmp_path: Path) -> None:
    scene = Scene(DeviceRegister(tmp_path, "sim"))
    scene.safety.at_start("sim")
    assert scene.is_safe()
    assert (scene.stops, scene.notes) == ([], [])


def test_a_job_of_another_database_takes_no_note_and_hinders_nothing(tmp_path: Path) -> None:
    scene = Scene(abandoned(tmp_path, "job-1"))

    def unknown(*_: object) -> None:
        raise NotFound("job", "job-1")

    scene.safety._append = unknown
    scene.safety.at_start("sim")
    assert scene.is_safe()


@pytest.mark.parametrize("asked", [lambda s: s.stopping("sim"), lambda s: s.stopping("sim", patient=True)])
def test_a_stop_waits_for_the_living_worker_that_makes_the_devices_safe(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, asked: Callable[[SafetyService], safety.Safety]
) -> None:
    monkeypatch.setattr(safety, "STOPPING_S", BUSY_S)
    scene = Scene(abandoned(tmp_path, "job-1"), Driving(ProcessIdentity.own()))
    worker = Thread(target=scene.devices.make_safe, args=("the worker",))
    real, looks = safety.pause, 0

    def worked_at_the_second(seconds: float) -> None:
        nonlocal looks
        looks += 1
        if looks == 2:
            worker.start()
        real(seconds)

    monkeypatch.setattr(safety, "pause", worked_at_the_second)
    found = asked(scene.safety)
    worker.join(BUSY_S)
    assert (found.safe, looks >= 2) == (True, True)


def test_a_stop_that_waits_for_nothing_is_answered_at_once_and_commands_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(safety, "STOPPING_S", 120.0)
    scene = Scene(abandoned(tmp_path, "job-1"), Driving(ProcessIdentity.own()))
    begun_s = monotonic_s()
    found = scene.safety.stopping("sim", patient=False)
    assert monotonic_s() - begun_s < BUSY_S
    assert (found.safe, found.worker, scene.commands()) == (False, ProcessIdentity.own(), [])
