"""``bench stop``: stop a bench from its own host, whatever else works there. Imports no database and no numerics.

The word goes into the bench's stop channel. It needs neither API nor database nor a free byte of disk; who watches the
channel acts, and where nobody does, the devices are made safe from here.
"""

import getpass
from collections.abc import Callable
from contextlib import suppress

from bench_service.bench.processes import HOST
from bench_service.bench.stop_channel import StopChannel
from bench_service.bench.stop_word import StopWord
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause

LOOK_S = 0.02
ALONE_S = 1.5
"""After so long without an answer from worker or supervisor the devices are tried from here [s]."""
SAFE, NOT_SAFE, REFUSED = 0, 1, 2


def stop_here(settings: Settings, reason: str, wait_s: float, say: Callable[[str], object]) -> int:
    """Stop the settings' bench; the exit code: 0 safe, 1 asked for and not safe within `wait_s`, 2 not asked for."""
    bench, folder = settings.bench_id, settings.devices_in()
    channel = StopChannel(folder, bench)
    word = StopWord(reason, _person(), "command")
    asked_s = monotonic_s()
    if _known(settings):
        with suppress(OSError):  # it is there since the bench was driven first; or on a full disk the devices must do
            channel.prepare()
    asked = channel.ask(word)
    if not asked and not _known(settings):
        say(
            f"bench {bench} has no devices in {folder.absolute()}: run this on the bench's host, "
            "with its BENCH_DEVICE_FOLDER"
        )
        return REFUSED
    said = ""
    while True:
        passed_s = monotonic_s() - asked_s
        state = channel.state(word.id)
        if state != said and asked:
            say(f"stop of bench {bench}: {state} after {passed_s:.2f} s")
            said = state
        if state == "safe":
            return SAFE
        if state == "asked" and (not asked or passed_s > ALONE_S):
            done, why = _make_safe(settings)
            if done:
                say(f"bench {bench} was made safe from here: neither its worker nor its supervisor answered")
                return SAFE
            if not asked:
                say(why)
                return NOT_SAFE
        if passed_s > wait_s:
            say(
                f"bench {bench} is NOT safe after {passed_s:.1f} s: use the hardware emergency stop. "
                f"{_unsafe(settings)}"
            )
            return NOT_SAFE
        pause(LOOK_S)


def _person() -> str:
    try:
        return f"{getpass.getuser()} on {HOST}"
    except (OSError, KeyError):
        return f"a user of {HOST}"


def _known(settings: Settings) -> bool:
    """Whether the bench's devices were ever driven from this host."""
    return (settings.devices_in() / f"bench-{settings.bench_id}.devices").exists()


def _make_safe(settings: Settings) -> tuple[bool, str]:
    """Over the devices' own link, where no other process has it; numerics are loaded here, and only here."""
    from bench_service.bench.make_safe import over_new_link
    from bench_service.drivers.device_register import DeviceRegister
    from bench_service.drivers.registered import RegisteredDevices

    devices = RegisteredDevices(DeviceRegister(settings.devices_in(), settings.bench_id))
    obstacle = over_new_link(devices, f"bench stop by {_person()}")
    return obstacle is None, "" if obstacle is None else f"bench {settings.bench_id}: {obstacle}"


def _unsafe(settings: Settings) -> str:
    from bench_service.drivers.device_register import DeviceRegister

    state = DeviceRegister(settings.devices_in(), settings.bench_id).read()
    return "" if state is None else f"Its devices say: {', '.join(state.unsafe) or 'nothing unsafe'}."
