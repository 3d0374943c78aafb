"""The command ``bench stop``: stop a bench from its own host. Imports no database and no numerics.

The request goes into the bench's stop channel. It needs neither API nor database nor a free byte of disk; the process
that watches the channel acts, and where no process does, the devices are made safe from here.
"""

import argparse
import getpass
import os
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from bench_service.bench.processes import HOST
from bench_service.bench.stop.channel import StopChannel
from bench_service.bench.stop.word import StopWord
from bench_service.device_folder import BENCH_ID, DATABASE_URL, bench_id_in, device_folder
from bench_service.wall_clock import monotonic_s, pause

LOOK_S = 0.02
ALONE_S = 1.5
"""Time without an answer from worker or supervisor after which this command makes the devices safe itself [s]."""
NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,31}")
HELP = (
    "Stop a bench on its own host, also without API, database and free disk. Not the hardware emergency stop. "
    "Exit code: 0 safe, 1 asked for and not safe in time, 2 not asked for."
)
REASON, WAIT_S = "stopped by an operator", 15.0
MOST_WAIT_S = 86_400.0
"""Longest time that this command may be asked to wait [s]."""
SAFE, NOT_SAFE, REFUSED = 0, 1, 2


def stop_here(bench: str, folder: Path, reason: str, wait_s: float, say: Callable[[str], object]) -> int:
    """Stop a bench whose device files are in a folder, wait, and return the exit code: 0 safe, 1 not within `wait_s`, 2
    not asked for.
    """
    channel = StopChannel(folder, bench)
    word = StopWord(reason, _person(), "command")
    asked_s = monotonic_s()
    if _known(folder, bench):
        with suppress(OSError):  # it is there since the bench was driven first; or on a full disk the devices must do
            channel.prepare()
    asked = channel.ask(word)
    if not asked and not _known(folder, bench):
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
            done, why = _make_safe(folder, bench)
            if done:
                say(f"bench {bench} was made safe from here: neither its worker nor its supervisor answered")
                return SAFE
            if not asked:
                say(why)
                return NOT_SAFE
        if passed_s > wait_s:
            say(
                f"bench {bench} is NOT safe after {passed_s:.1f} s: use the hardware emergency stop. "
                f"{_unsafe(folder, bench)}"
            )
            return NOT_SAFE
        pause(LOOK_S)


def stop_command(arguments: Sequence[str], environ: Mapping[str, str]) -> int:
    """Run ``bench stop`` by itself, without the rest of the command line; return its exit code.

    Of the environment it reads what it needs: a setting that another command would refuse does not keep a stop out.
    """
    parser = argparse.ArgumentParser(prog="bench stop", description=HELP)
    parser.add_argument("--bench", help="default: the one in the settings")
    parser.add_argument("--reason", default=REASON, help="for the person who releases it")
    parser.add_argument("--wait", type=waiting_s, default=WAIT_S, metavar="SECONDS", help="until it is safe")
    try:
        given = parser.parse_args(list(arguments))
    except SystemExit as ended:
        return REFUSED if ended.code else SAFE
    folder = environ.get("BENCH_DEVICE_FOLDER")
    where = device_folder(environ.get("BENCH_DATABASE_URL", DATABASE_URL), None if folder is None else Path(folder))
    bench = given.bench or _own(environ, where)
    if bench is None:
        there = ", ".join(_benches(where)) or "none"
        print(
            f"bench: NOTHING IS STOPPED: the bench file {environ['BENCH_FILE']} does not tell which bench this is: "
            f"name it with --bench; in {where.absolute()} are: {there}",
            file=sys.stderr,
        )
        return REFUSED
    if not NAME.fullmatch(bench):
        print(f"bench: --bench {bench}: small letters, digits, - and _ are expected", file=sys.stderr)
        return REFUSED
    return stop_here(bench, where, given.reason or REASON, given.wait, _say)


def waiting_s(text: str) -> float:
    """Return a time to wait [s] from its text. Raises `ArgumentTypeError` for one that never ends, or is over before
    it begins.
    """
    with suppress(ValueError):
        seconds = float(text)
        if 0.0 <= seconds <= MOST_WAIT_S:  # neither holds for "nan"
            return seconds
    raise argparse.ArgumentTypeError(f"{text}: seconds from 0 to {MOST_WAIT_S:.0f} are expected; NOTHING IS STOPPED")


def _own(environ: Mapping[str, str], folder: Path) -> str | None:
    """The bench of the settings: by its id, or by its bench file; None where that file cannot be read.

    The only bench of the folder then: the default one would be another bench, which is stopped and reported as safe
    while this one moves.
    """
    if "BENCH_ID" in environ:
        return environ["BENCH_ID"]
    if "BENCH_FILE" not in environ:
        return BENCH_ID
    named, there = bench_id_in(Path(environ["BENCH_FILE"])), _benches(folder)
    return named or (there[0] if len(there) == 1 else None)


def _benches(folder: Path) -> list[str]:
    """The benches whose devices were ever driven from a folder of this host."""
    with suppress(OSError):
        return sorted(name[6:-8] for name in os.listdir(folder) if re.fullmatch(r"bench-.+\.devices", name))
    return []


def _say(line: str) -> None:
    with suppress(OSError):  # the output is closed, or its disk is full: the stop continues
        print(line, flush=True)


def _person() -> str:
    try:
        return f"{getpass.getuser()} on {HOST}"
    except (OSError, KeyError):
        return f"a user of {HOST}"


def _known(folder: Path, bench: str) -> bool:
    """Return whether the bench's devices were ever driven from this host."""
    return os.path.exists(folder / f"bench-{bench}.devices")  # unlike `Path.exists`, false for another's folder


def _make_safe(folder: Path, bench: str) -> tuple[bool, str]:
    """Make safe over the devices' own link, where no other process has it; numerics are loaded here, and only here."""
    from bench_service.bench.make_safe import over_new_link
    from bench_service.drivers.composition import devices_of

    obstacle = over_new_link(devices_of(folder, bench), f"bench stop by {_person()}")
    return obstacle is None, "" if obstacle is None else f"bench {bench}: {obstacle}"


def _unsafe(folder: Path, bench: str) -> str:
    from bench_service.drivers.device_register import DeviceRegister

    state = DeviceRegister(folder, bench).read()
    return "" if state is None else f"Its devices say: {', '.join(state.unsafe) or 'nothing unsafe'}."
