"""Register of a bench's devices: seen from outside, with real processes that are really killed."""

import asyncio
import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import groupby
from pathlib import Path
from typing import Any

import pytest

from bench_service.bench.devices import AT_REST, MOVING
from bench_service.drivers import device_journal
from bench_service.drivers.device_cables import DeviceCables
from bench_service.drivers.device_faults import DeviceFaults, FaultPlan
from bench_service.drivers.device_journal import KEPT, ROTATE_BYTES
from bench_service.drivers.device_register import DeviceRegister
from bench_service.drivers.registered import RegisteredDevices
from bench_service.drivers.simulated import SimulatedDriver
from bench_service.model.errors import Misconfigured
from procedures.bench import Bench, BenchNeeds
from procedures.bench.errors import DeviceBusy, DeviceFault, Disconnected, OutOfRange
from procedures.core.table_angles import TableAngles
from procedures.core.turn import Turn

ROOT = Path(__file__).resolve().parents[2]
MOVER = """
import asyncio, sys
from pathlib import Path
from bench_service.drivers.device_register import DeviceRegister
from bench_service.drivers.simulated import SimulatedDriver
from procedures.bench import BenchNeeds
from procedures.core.table_angles import TableAngles
driver = SimulatedDriver("sim", real_time_factor=1.0, register=DeviceRegister(Path(sys.argv[1]), "sim"))
bench = driver.open("SIM-0001", 1, None, BenchNeeds(), "job-1")
async def go():
    await bench.supply.switch_on()
    print("on", flush=True)
    await bench.turntable.move_to(TableAngles(0.0, 90.0, -45.0))
asyncio.run(go())
"""
RACER = """
import sys
from pathlib import Path
from bench_service.drivers import device_journal
from bench_service.drivers.device_register import DeviceRegister
from bench_service.wall_clock import pause
from procedures.bench.errors import DeviceBusy
device_journal.ROTATE_BYTES = 10**12
register = DeviceRegister(Path(sys.argv[1]), "sim")
print("there", flush=True)
sys.stdin.readline()
had = refused = 0
while had < 60:
    try:
        link = register.open()
    except DeviceBusy:
        refused += 1
        continue
    had += 1
    for number in range(20):
        link.note("turntable.move_to", {"number": number})
        if number == 10:
            pause(0.0005)
    link.close()
print(refused, flush=True)
"""
"""Has the link a fixed number of times, however fast the machine, and each time long enough for the others to try. No
line is lost to rotation."""
RACER_LINKS = 60
RACER_LINES = 22
"""Of one link: it is opened, moves twenty times, is closed."""


@contextmanager
def process(script: str, folder: Path) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-c", script, str(folder)]
    with subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as running:
        try:
            yield running
        finally:
            running.kill()


def said(running: subprocess.Popen[str]) -> str:
    assert running.stdout is not None
    return running.stdout.readline()


def opened(folder: Path) -> tuple[DeviceRegister, Bench]:
    register = DeviceRegister(folder, "sim")
    return register, SimulatedDriver("sim", register=register).open("SIM-0001", 1, None, BenchNeeds(), "job-1")


def verbs(register: DeviceRegister) -> list[str]:
    return [entry["verb"] for entry in register.journal.entries()]


def test_a_table_goes_on_moving_when_its_master_is_killed_and_the_next_master_stops_it(tmp_path: Path) -> None:
    register = DeviceRegister(tmp_path, "sim")
    devices = RegisteredDevices(register)
    assert devices.device_state() is None  # nobody here knows anything of it
    with process(MOVER, tmp_path) as mover:
        assert said(mover) == "on\n"
        while (state := register.read()) is None or state.table != MOVING:
            pass
        with pytest.raises(DeviceBusy, match=f"'sim' are driven by process {mover.pid} on "):
            register.open()
        with pytest.raises(DeviceBusy):
            devices.make_safe("a test")
        mover.kill()
        mover.wait()
    state = register.read()
    assert state is not None
    assert (state.safe, state.table, state.powered, state.job, state.linked) == (False, MOVING, True, "job-1", True)
    assert state.unsafe == ("the table moves", "the unit is on")
    assert devices.make_safe("a test").safe
    safe = register.read()
    assert safe is not None
    assert (safe.safe, safe.table, safe.powered, safe.by, safe.linked) == (True, AT_REST, False, "a test", False)
    before = len(verbs(register))
    assert devices.make_safe("again").safe
    assert len(verbs(register)) == before, "a safe bench was asked for something"


def test_of_processes_that_race_one_at_a_time_is_the_master(tmp_path: Path) -> None:
    """Seen in the journal, which knows no lock: from a link's opening to its closing all lines are of one process."""
    with process(RACER, tmp_path) as a, process(RACER, tmp_path) as b, process(RACER, tmp_path) as c:
        racers = (a, b, c)
        assert [said(racer) for racer in racers] == ["there\n"] * 3
        for racer in racers:
            assert racer.stdin is not None
            racer.stdin.write("go\n")
            racer.stdin.flush()
        refused = [int(said(racer)) for racer in racers]
    assert sum(refused) > 0, "nobody met anybody"
    register = DeviceRegister(tmp_path, "sim")
    journal = register.journal.entries()
    entries = [entry for entry in journal if entry["verb"] != "link.refused"]
    assert len(journal) - len(entries) == sum(refused)
    assert len(entries) == RACER_LINES * RACER_LINKS * len(racers)
    for begin in range(0, len(entries), RACER_LINES):
        link = entries[begin : begin + RACER_LINES]
        assert len({entry["pid"] for entry in link}) == 1
        assert [key for key, _ in groupby(entry["verb"] for entry in link)] == [
            "link.opened",
            "turntable.move_to",
            "link.closed",
        ]
    state = register.read()
    assert state is not None
    assert state.openings == RACER_LINKS * len(racers)


def test_a_process_that_was_refused_before_a_rotation_writes_into_the_new_journal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = DeviceRegister(tmp_path, "sim"), DeviceRegister(tmp_path, "sim")
    monkeypatch.setattr(device_journal, "ROTATE_BYTES", 1)
    link = first.open()
    with pytest.raises(DeviceBusy):
        second.open()
    link.close()
    second.open()
    assert [json.loads(line)["verb"] for line in first.journal.path.read_text().splitlines()] == ["link.opened"]


def test_verbs_become_states_and_a_refused_demand_changes_nothing(tmp_path: Path) -> None:
    register, bench = opened(tmp_path)

    def state() -> tuple[str, bool]:
        found = register.read()
        assert found is not None
        return found.table, found.powered

    assert state() == (AT_REST, False)
    asyncio.run(bench.supply.switch_on())
    with pytest.raises(OutOfRange):
        asyncio.run(bench.turntable.move_to(TableAngles(0.0, 1e6, 0.0)))
    assert state() == (AT_REST, True)
    asyncio.run(bench.turntable.move_to(TableAngles(0.0, 10.0, 0.0)))
    found = register.read()
    assert found is not None
    assert found.angles_deg == (0.0, 10.0, 0.0)
    asyncio.run(bench.turntable.command_turn(Turn("inner", 1, 60.0, 2.0)))
    assert state() == (MOVING, True)
    asyncio.run(bench.turntable.settle())
    assert state() == (AT_REST, True)
    asyncio.run(bench.turntable.command_turn(Turn("inner", -1, 60.0, 2.0)))
    asyncio.run(bench.make_safe())
    assert state() == (AT_REST, False)
    bench.close()
    bench.close()
    with pytest.raises(Disconnected, match="has closed its link"):
        asyncio.run(bench.supply.switch_on())
    assert state() == (AT_REST, False)


def test_devices_that_could_not_be_made_safe_are_not_safe(tmp_path: Path) -> None:
    register = DeviceRegister(tmp_path, "sim")
    plan = FaultPlan.parse('{"rules": [{"verb": "turntable.make_safe", "kind": "fault", "probability": 1}]}')
    bench = SimulatedDriver("sim", register=register, faults=plan).open("SIM-0001", 1, None, BenchNeeds(), "job-1")
    asyncio.run(bench.supply.switch_on())
    with pytest.raises(ExceptionGroup):
        asyncio.run(bench.make_safe())
    bench.close()
    state = register.read()
    assert state is not None
    assert (state.safe, state.powered) == (False, False)  # the supply was tried all the same
    assert "turntable" in state.fault
    assert RegisteredDevices(register).make_safe("a test").safe


def test_the_journal_is_bounded(tmp_path: Path) -> None:
    register = DeviceRegister(tmp_path, "sim")
    long = "x" * 1000
    for _ in range(KEPT + 2):
        link = register.open()
        for _ in range(ROTATE_BYTES // 1000):
            link.note("turntable.move_to", {"request": long})
        link.close()
    files = sorted(path.name for path in tmp_path.glob("bench-sim.journal*"))
    assert files == [f"bench-sim.journal.{number}" for number in range(1, KEPT + 1)]
    assert sum(path.stat().st_size for path in tmp_path.iterdir()) < (KEPT + 1) * 1.3 * ROTATE_BYTES


def test_a_full_disk_costs_lines_of_the_journal_and_no_state(small_disk: Path) -> None:
    register = DeviceRegister(small_disk, "sim")
    link = register.open()
    with (small_disk / "filler").open("wb", buffering=0) as filler, suppress(OSError):
        while True:
            filler.write(b"x" * 4096)
    assert shutil.disk_usage(small_disk).free < 4096
    for number in range(1000):
        link.note("chamber.command", {"request": "x" * 100}, chamber_target_c=float(number))
    state = register.read()
    assert state is not None
    assert state.chamber_target_c == 999.0
    link.close()
    assert all(isinstance(entry, dict) for entry in register.journal.entries())


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("hang", "not JSON"),
        ('{"rules": [{"verb": "*", "kind": "hang", "probability": 1.5}]}', "rules.0.probability = 1.5"),
        ('{"rules": [{"verb": "*", "kind": "melt", "probability": 0.5}]}', "rules.0.kind = 'melt'"),
        ('{"rules": [{"verb": "*", "kind": "hang", "probability": 0.5, "lasts_s": 2}]}', "lasts_s applies to a lost"),
        ('{"seed": 1}', "rules"),
        ("[1]", "valid dictionary"),
    ],
)
def test_a_fault_plan_that_cannot_be_used_is_refused_by_name(text: str, named: str) -> None:
    with pytest.raises(Misconfigured, match="BENCH_DEVICE_FAULTS") as refused:
        FaultPlan.parse(text)
    assert named in str(refused.value)


def test_faults_come_as_often_as_said_and_the_same_again(tmp_path: Path) -> None:
    """Number of faults in 2000 tries at 0.1: 200 ± 13.4 (binomial), here within five of them."""
    rules = [{"verb": "supply.*", "kind": "fault", "probability": 0.1}]
    plan = FaultPlan.parse(json.dumps({"seed": 3, "rules": rules}))

    def struck(opening: str, verb: str) -> list[bool]:
        faults, found = DeviceFaults(plan, opening, DeviceCables(tmp_path, "sim")), []
        for _ in range(2000):
            try:
                faults.strike(verb, {})
                found.append(False)
            except DeviceFault:
                found.append(True)
        return found

    first: list[Any] = struck("job 1", "supply.switch_on")
    assert abs(sum(first) - 200) < 67
    assert struck("job 1", "supply.switch_on") == first
    assert struck("job 2", "supply.switch_on") != first
    assert not any(struck("job 1", "turntable.move_to"))
