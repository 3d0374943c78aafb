"""A bench on wires: made safe in parallel and read back, compared with its register, driven, mixed with simulation."""

import asyncio
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any

import pytest

from bench_service.bench.devices import AT_REST, MOVING
from bench_service.bench.make_safe import over_new_link
from bench_service.bench.safety import SafetyService
from bench_service.drivers.bench_file.document import read_bench_file
from bench_service.drivers.composition import devices_of, driver_of
from bench_service.drivers.device_register import DeviceRegister
from bench_service.drivers.interface import registry
from bench_service.drivers.registered import RegisteredDevices
from bench_service.drivers.wired.devices import WiredDevices
from bench_service.drivers.wired.driver import BenchFileDriver
from bench_service.settings import Settings
from procedures.bench import BenchNeeds
from procedures.bench.errors import BenchError, DeviceFault, Disconnected
from procedures.core.recording import Station
from procedures.core.table_angles import TableAngles
from procedures.steps import record_station
from tests.kit import line_devices
from tests.kit.line_devices import LineChamber, LineDevice, bench_text, served


@dataclass
class East:
    """A served bench with its file."""

    folder: Path
    table: LineDevice
    supply: LineDevice
    chamber: LineDevice
    path: Path

    def register(self) -> DeviceRegister:
        return DeviceRegister(self.folder, "east")

    def devices(self) -> WiredDevices:
        return WiredDevices(lambda: read_bench_file(self.path), self.register())

    def leave(self, **state: Any) -> None:
        """Leave the register as a process that died."""
        link = self.register().open("a process that died", "job-1")
        link.note("a test", {}, chamber_ambient_c=22.0, bench_file=str(self.path), **state)
        link.close()

    def driver(self) -> BenchFileDriver:
        settings = Settings(database_url=f"sqlite:///{self.folder / 'b.sqlite'}", bench_file=self.path)
        made = driver_of(settings, lambda _job, operator: operator)  # pyright: ignore[reportArgumentType]
        assert isinstance(made, BenchFileDriver)
        return made


@pytest.fixture
def east(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Generator[East]:
    monkeypatch.setattr(registry, "SHIPPED", line_devices.SHIPPED)
    table, supply, chamber = line_devices.table(), line_devices.supply(), line_devices.chamber()
    with served(table, supply, chamber):
        path = tmp_path / "east.toml"
        path.write_text(bench_text(table, supply, chamber))
        yield East(tmp_path, table, supply, chamber, path)


UNSAFE = {"table": MOVING, "powered": True, "chamber_target_c": 60.0}


def _unsafe(east: East) -> None:
    east.table.state["moving"] = True
    east.supply.state["on"] = True
    east.chamber.state["target"] = 60.0
    east.leave(**UNSAFE)


def test_everything_is_made_safe_and_reads_back_as_safe(east: East) -> None:
    _unsafe(east)
    state = east.devices().make_safe("a test")
    assert state.safe
    assert (east.table.state["moving"], east.supply.state["on"], east.chamber.state["target"]) == (False, False, 22.0)
    asked = len(east.supply.asked)
    assert east.devices().make_safe("again").safe
    assert len(east.supply.asked) == asked


def test_a_hung_device_holds_up_no_other_and_is_tried_again_alone(east: East) -> None:
    _unsafe(east)
    east.chamber.silent = True
    begun = monotonic()
    obstacle = over_new_link(east.devices(), "a test")
    took_s = monotonic() - begun
    assert obstacle is not None
    assert "chamber" in obstacle.why
    state = east.register().read()
    assert state is not None
    assert (state.table, state.powered, state.chamber_target_c) == (AT_REST, False, 60.0)
    # The others are noted as safe before the chamber's answer is given up.
    times = {e["verb"]: e["at"] for e in east.register().journal.entries()}
    assert times["supply.make_safe"] < times["chamber.make_safe.failed"]
    assert times["turntable.make_safe"] < times["chamber.make_safe.failed"]
    assert took_s < 6.0
    asked = len(east.table.asked), len(east.supply.asked)
    east.chamber.silent = False
    assert over_new_link(east.devices(), "a test") is None
    assert (len(east.table.asked), len(east.supply.asked)) == asked
    assert east.chamber.state["target"] == 22.0


def test_a_device_that_does_not_obey_is_not_called_safe(east: East) -> None:
    _unsafe(east)
    east.supply.state["stuck"] = True
    east.table.state["runaway"] = True
    obstacle = over_new_link(east.devices(), "a test")
    assert obstacle is not None
    assert "the supply still gives 28 V" in obstacle.why
    assert "the turntable still moves" in obstacle.why
    state = east.register().read()
    assert state is not None
    assert state.powered
    assert not state.safe


def test_a_device_that_stands_still_is_not_started(east: East) -> None:
    east.leave(chamber_target_c=60.0)
    assert east.devices().make_safe("a test").safe
    assert east.chamber.state["target"] is None
    assert east.chamber.demands() == []


@pytest.mark.parametrize(("policy", "target"), [("hold", 60.0), ("off", None), ("ambient", 22.0)])
def test_a_chamber_is_led_as_its_policy_says(east: East, policy: str, target: float | None) -> None:
    text = east.path.read_text().replace("[chamber]\n", f'[chamber]\non_safe = "{policy}"\n')
    east.path.write_text(text)
    _unsafe(east)
    assert east.devices().make_safe("a test").safe
    assert east.chamber.state["target"] == target


def test_late_answers_end_in_a_lost_link_and_never_in_a_wrong_value(east: East) -> None:
    _unsafe(east)
    east.supply.late_s = 0.6  # later than the file's 0.4 s
    obstacle = over_new_link(east.devices(), "a test")
    assert obstacle is not None
    assert "does not answer" in obstacle.why
    state = east.register().read()
    assert state is not None
    assert state.powered


def test_real_devices_are_not_called_safe_by_their_register_alone(east: East) -> None:
    _unsafe(east)
    with pytest.raises(BenchError, match=r"only with their bench file, .*east\.toml"):
        RegisteredDevices(east.register()).make_safe("a process without the file")
    assert isinstance(devices_of(east.folder, "east"), WiredDevices)
    assert devices_of(east.folder, "east").make_safe("bench stop").safe
    assert not east.supply.state["on"]


def test_a_file_that_was_spoiled_keeps_no_state_from_being_known(east: East) -> None:
    _unsafe(east)
    good = east.path.read_text()
    east.path.write_text("[bench]\n")
    devices = devices_of(east.folder, "east")
    state = devices.device_state()
    assert state is not None
    assert not state.safe
    obstacle = over_new_link(devices, "bench stop")
    assert obstacle is not None
    assert "east.toml" in obstacle.why
    assert "bench.id is missing" in obstacle.why
    east.path.write_text(good)
    assert over_new_link(devices, "bench stop") is None
    assert not east.supply.state["on"]


@pytest.mark.parametrize(
    ("turned", "words"),
    [
        ({"angles": [0.0, 5.0, 0.0]}, "the middle axis of the turntable stands at 5.0000 deg, and was left at 0"),
        ({"angles": [0.0, 0.0, 360.0]}, "the inner axis of the turntable stands at 360.0000 deg, and was left at 0"),
        ({"homed": False}, "the turntable is not homed"),
        ({"moving": True}, "the turntable moves, and was left at rest"),
        ({"angles": [360.0, 0.0, 0.0]}, None),
        ({"angles": [0.0, 0.002, 0.0]}, None),
    ],
)
def test_a_table_turned_while_the_service_was_down_is_found(
    east: East, turned: dict[str, Any], words: str | None
) -> None:
    """Whole turns of the outer axis, which has slip rings, do not count."""
    east.leave(table=AT_REST, angles_deg=(0.0, 0.0, 0.0))
    east.table.state |= turned
    found = east.devices().compare("a test")
    assert found == () if words is None else words in found[0]
    assert east.table.demands() == []


def test_a_supply_and_a_chamber_switched_on_by_hand_are_found_and_made_safe(east: East) -> None:
    east.leave(table=AT_REST)
    east.supply.state["on"] = True
    east.chamber.state["target"] = 70.0
    stops: list[str] = []

    class _Benches:
        def stop_bench_once(self, stop: Any) -> None:
            stops.append(stop.reason)

    service = SafetyService(_Benches(), lambda _: east.devices(), lambda _: None, lambda *_: None)  # pyright: ignore[reportArgumentType]
    service.at_start("east")
    assert len(stops) == 1
    assert "the supply is on, and was left off" in stops[0]
    assert "the chamber is commanded to 70 °C, and was left standing still" in stops[0]
    assert (east.supply.state["on"], east.chamber.state["target"]) == (False, 22.0)
    state = east.register().read()
    assert state is not None
    assert state.safe
    service.at_start("east")
    assert len(stops) == 1


def _open(east: East) -> Any:
    return east.driver().open("SIM-0001", 3, None, BenchNeeds(), "job-2")


async def _closed(bench: Any) -> None:
    bench.close()
    await asyncio.sleep(0.02)


def test_a_mixed_bench_drives_real_devices_and_records_the_simulated_unit_in_real_time(east: East) -> None:
    bench = _open(east)

    async def work() -> tuple[int, float, Any]:
        begun = monotonic()
        stream = await record_station(bench, Station(0, "o", TableAngles(0.0, 90.0, 0.0), record_s=1.0))
        await asyncio.sleep(0.1)
        count = 0
        async for block in stream.blocks:
            count += len(block)
        state, on = east.register().read(), east.supply.state["on"]
        took_s = monotonic() - begun
        await bench.make_safe()
        assert on
        await _closed(bench)
        return count, took_s, state

    count, took_s, state = asyncio.run(work())
    assert count == 400
    assert took_s > 0.95  # real time: a machine under load is late, never early
    assert east.table.state["angles"] == [0.0, 90.0, 0.0]
    assert state is not None
    assert (state.powered, state.angles_deg, state.bench_file) == (True, (0.0, 90.0, 0.0), str(east.path))
    rest = bench.inner.turntable._below.rest_truth()[1]  # specific force where the encoders show: x is level at 90°
    assert not east.supply.state["on"]
    # Turned by 90° about z the vertical, y, lies along x: f_x = ±g, and nothing of it along y.
    assert abs(rest[0]) == pytest.approx(9.81, abs=0.01)
    assert abs(rest[1]) < 0.01


def test_the_bench_is_made_safe_but_for_one_device_that_hangs(east: East) -> None:
    bench = _open(east)

    async def work() -> None:
        await bench.supply.switch_on()
        east.table.state["moving"] = True
        east.supply.silent = True
        try:
            await bench.make_safe()
        finally:
            await _closed(bench)

    begun = monotonic()
    with pytest.raises(ExceptionGroup) as failed:
        asyncio.run(work())
    assert monotonic() - begun < 5.0, "0.4 s for an answer; the rest is for a busy machine"
    assert str(east.supply.port) in str(failed.value.exceptions)
    assert east.table.state["moving"] is False
    times = {e["verb"]: e["at"] for e in east.register().journal.entries()}
    assert times["turntable.make_safe.done"] < times["supply.make_safe.failed"]


def test_an_unhomed_table_moves_nothing(east: East) -> None:
    bench = _open(east)
    east.table.state["homed"] = False

    async def work() -> None:
        try:
            await bench.turntable.move_to(TableAngles(0.0, 10.0, 0.0))
        finally:
            await _closed(bench)

    with pytest.raises(DeviceFault, match="a person has homed it"):
        asyncio.run(work())
    assert east.table.demands() == []


def test_a_job_says_which_device_does_not_answer(east: East) -> None:
    driver = east.driver()
    east.supply.silent = True
    with pytest.raises(Disconnected, match=r"the supply is not reached: tcp://127\.0\.0\.1"):
        driver.open("SIM-0001", 3, None, BenchNeeds(), "job-2")
    east.supply.silent = False
    driver.open("SIM-0001", 3, None, BenchNeeds(), "job-2").close()


def test_identities_are_in_the_description_and_another_device_refuses_the_job(east: East) -> None:
    driver = east.driver()
    told = {d.name: d.identity for d in driver.description.devices if d.identity is not None}
    assert {name: found.serial for name, found in told.items()} == {
        "turntable": "T-7",
        "supply": "P-3",
        "chamber": "C-1",
    }
    east.supply.state["identity"] = {**east.supply.state["identity"], "serial": "P-4"}
    with pytest.raises(
        DeviceFault, match=r"the supply is Line P1, serial P-4, firmware 4\.0, and was Line P1, serial P-3"
    ):
        driver.open("SIM-0001", 3, None, BenchNeeds(), "job-2")


def test_the_devices_own_limits_narrow_the_description_and_are_logged_once(
    east: East, caplog: pytest.LogCaptureFixture
) -> None:
    east.table.state["limits"] = {"outer.rate_deg_s": 30.0}
    driver = east.driver()
    assert driver.description.outer.rate_deg_s == 30.0
    for _ in range(2):
        driver.open("SIM-0001", 3, None, BenchNeeds(), "job-2").close()
    assert caplog.text.count("turntable.outer.rate_deg_s: the file has 60, the device 30; 30 holds") == 1


def test_a_simulated_unit_stands_in_the_real_chambers_air(east: East) -> None:
    bench = east.driver().open("SIM-0001", 3, None, BenchNeeds(temperatures=True), "job-2")

    async def scene() -> None:
        before = east.chamber.asked.count("read")
        await bench.clock.sleep(1.2)
        assert east.chamber.asked.count("read") - before >= 2
        east.chamber.silent = True
        with pytest.raises(Disconnected):  # the unit's temperature is not known any more
            await bench.clock.sleep(1.2)

    try:
        asyncio.run(scene())
    finally:
        east.chamber.silent = False
        bench.close()


def test_a_wrong_address_is_told_and_commands_nothing(east: East) -> None:
    text = east.path.read_text().replace(f":{east.table.port}", ":1")
    east.path.write_text(text)
    with pytest.raises(Disconnected, match=r"the turntable is not reached: tcp://127\.0\.0\.1:1 does not answer"):
        _open(east)
    assert east.supply.demands() == []


def test_a_driver_that_cannot_make_its_device_keeps_no_other_from_being_made_safe(
    east: East, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As one whose maker's library is gone since an upgrade."""
    _unsafe(east)

    def gone(*_: object) -> Any:
        raise ImportError("no module named 'makers_library'")

    monkeypatch.setattr(LineChamber, "__init__", gone)
    obstacle = over_new_link(east.devices(), "a test")
    assert obstacle is not None
    assert obstacle.reasons == ("the chamber: no module named 'makers_library'",)
    assert not east.table.state["moving"]
    assert not east.supply.state["on"]
    state = east.register().read()
    assert state is not None
    assert state.unsafe == ("the chamber is commanded to 60 °C", "the chamber: no module named 'makers_library'")
