"""Hindrances of a stop, put there while the table moves and taken away after the press."""

import errno
import os
import resource
import shutil
import signal
import socket
import sqlite3
import subprocess
import threading
import time
from collections.abc import Generator, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path

import httpx

from tests.chaos.stop_bench import StopBench

ANALYSES, SOCKETS, DESCRIPTORS = 100, 2000, 1024
ROWS = 200_000
SHIM = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdlib.h>
#include <time.h>
#include <sys/time.h>
#include <unistd.h>
static long offset(void) {
    const char *name = getenv("CLOCK_OFFSET_FILE");
    char text[32] = {0};
    int file = name ? open(name, O_RDONLY | O_CLOEXEC) : -1;
    if (file < 0) return 0;
    if (read(file, text, sizeof text - 1) < 0) text[0] = 0;
    close(file);
    return atol(text);
}
int clock_gettime(clockid_t clock, struct timespec *at) {
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = dlsym(RTLD_NEXT, "clock_gettime");
    int found = real(clock, at);
    if (!found && clock == CLOCK_REALTIME) at->tv_sec += offset();
    return found;
}
"""
"""A wall clock that a file moves, for the processes that it is loaded into."""


class NotHere(Exception):
    """This machine cannot show a cell; the message says why."""


@contextmanager
def sqlite_bench(folder: Path, **how: object) -> Generator[StopBench]:
    """A bench on an SQLite file of the folder, in one process unless `apart`."""
    bench = StopBench(folder, f"sqlite:///{folder / 'bench.sqlite'}", **how)  # type: ignore[arg-type]
    try:
        bench.start()
        yield bench
    finally:
        bench.end()


@contextmanager
def small_disk(folder: Path, options: str) -> Generator[Path]:
    """A file system of its own, that ends with the block."""
    place = folder / "disk"
    place.mkdir()
    made = subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", place], capture_output=True, check=False)
    if made.returncode != 0:
        raise NotHere("a small file system can only be mounted by root")
    try:
        yield place
    finally:
        subprocess.run(["umount", "--lazy", place], check=True)


def fill(place: Path) -> None:
    """To the last byte."""
    with (place / "ballast").open("ab", buffering=0) as file, suppress(OSError):
        for size in (1 << 20, 1 << 12, 1):
            while shutil.disk_usage(place).free >= size:
                file.write(b"\0" * size)


def use_up_inodes(place: Path) -> None:
    """To the last file."""
    (place / "many").mkdir(exist_ok=True)
    for number in range(200_000):
        try:
            (place / "many" / str(number)).touch()
        except OSError as error:
            if error.errno != errno.ENOSPC:
                raise
            return


@contextmanager
def nothing(folder: Path) -> Iterator[StopBench]:
    with sqlite_bench(folder) as bench:
        bench.submit()
        bench.until_it_moves()
        yield bench


@contextmanager
def full_disk(folder: Path) -> Iterator[StopBench]:
    with small_disk(folder, "size=48m") as place, sqlite_bench(place) as bench:
        bench.submit()
        bench.until_it_moves()
        fill(place)
        yield bench


@contextmanager
def no_inode(folder: Path) -> Iterator[StopBench]:
    with small_disk(folder, "size=48m,nr_inodes=200") as place, sqlite_bench(place) as bench:
        bench.submit()
        bench.until_it_moves()
        use_up_inodes(place)
        yield bench


@contextmanager
def locked_sqlite(folder: Path) -> Iterator[StopBench]:
    with sqlite_bench(folder) as bench, closing(sqlite3.connect(folder / "bench.sqlite", timeout=30)) as other:
        other.isolation_level = None
        bench.submit()
        bench.until_it_moves()
        other.execute("BEGIN IMMEDIATE")
        try:
            yield bench
        finally:
            other.execute("ROLLBACK")


@contextmanager
def analyses(folder: Path) -> Iterator[StopBench]:
    """A hundred of them asked for at once, at a service that drives its bench."""
    with sqlite_bench(folder) as bench:
        recording = recording_of(bench.http)
        body = {"method": "noise_analysis", "recordings": [recording], "parameters": {}}
        going = True

        def ask() -> None:
            with suppress(httpx.HTTPError), httpx.Client(base_url=bench.url, timeout=120, trust_env=False) as http:
                while going:
                    http.post("/api/v1/analyses", json=body)

        bench.submit()
        bench.until_it_moves()
        threads = [threading.Thread(target=ask, daemon=True) for _ in range(ANALYSES)]
        for thread in threads:
            thread.start()
        try:
            time.sleep(2.0)
            if not bench.moves():
                bench.until_it_moves()
            yield bench
        finally:
            going = False


def recording_of(http: httpx.Client, count: int = ROWS) -> str:
    """A recording of one channel that can be analysed; its id."""
    import json
    import random

    chance = random.Random(1)
    rows = "\n".join(str(chance.randrange(-(2**20), 2**20)) for _ in range(count))
    channel = {"name": "gyro_x", "quantity": "angular_rate", "unit": "count", "scale": 1e-9}
    description = {"unit": "FILE-1", "channels": [channel], "rate_hz": 100.0}
    answer = http.post(
        "/api/v1/recordings",
        files={"files": ("a.csv", ("gyro_x\n" + rows + "\n").encode())},
        data={"description": json.dumps(description)},
    )
    assert answer.status_code == 201, answer.text
    return answer.json()["id"]


def few_descriptors() -> None:
    """Limit of descriptors, as `ulimit -n 1024` sets it."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (DESCRIPTORS, DESCRIPTORS))


@contextmanager
def idle_sockets(folder: Path) -> Iterator[StopBench]:
    """More connections than the service has descriptors, and none of them ever says a word."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard != resource.RLIM_INFINITY and hard < SOCKETS + 500:
        raise NotHere("this process may not open so many sockets")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, SOCKETS + 500), hard))
    with ExitStack() as stack, sqlite_bench(folder, api_before=few_descriptors) as bench:
        bench.submit()
        bench.until_it_moves()
        for _ in range(SOCKETS):
            made = stack.enter_context(socket.socket())
            made.setblocking(False)
            with suppress(BlockingIOError):
                made.connect(("127.0.0.1", bench.port))
        time.sleep(1.0)
        if not bench.moves():
            bench.until_it_moves()
        yield bench


@contextmanager
def hostile_import(folder: Path) -> Iterator[StopBench]:
    """A line of a megabyte of blanks, as a table whose columns are parted by white space."""
    import json

    channel = {"name": "gyro_x", "quantity": "angular_rate", "unit": "count"}
    description = {"unit": "FILE-1", "channels": [channel], "rate_hz": 100.0, "delimiter": "whitespace"}
    body = b"gyro_x\n1" + b" " * 1_000_000 + b"2\n"

    def send() -> None:
        with suppress(httpx.HTTPError), httpx.Client(base_url=bench.url, timeout=40, trust_env=False) as http:
            files = {"files": ("a.txt", body)}
            http.post("/api/v1/recordings", files=files, data={"description": json.dumps(description)})

    with sqlite_bench(folder) as bench:
        bench.submit()
        bench.until_it_moves()
        threading.Thread(target=send, daemon=True).start()
        time.sleep(0.5)
        yield bench


@contextmanager
def stopped_worker(folder: Path) -> Iterator[StopBench]:
    with sqlite_bench(folder, apart=True) as bench:
        bench.submit()
        bench.until_it_moves()
        os.kill(bench.driver(), signal.SIGSTOP)
        yield bench


@contextmanager
def killed_supervisor(folder: Path) -> Iterator[StopBench]:
    with sqlite_bench(folder, apart=True) as bench:
        bench.submit()
        bench.until_it_moves()
        os.kill(bench.supervisor(), signal.SIGKILL)
        yield bench


@contextmanager
def full_log_disk(folder: Path) -> Iterator[StopBench]:
    """Every line of every log meets a full disk."""
    with sqlite_bench(folder, apart=True, log=Path("/dev/full")) as bench:
        bench.submit()
        bench.until_it_moves()
        yield bench


@contextmanager
def clock_jump(folder: Path) -> Iterator[StopBench]:
    """The wall clock of every process jumps by a day, forward and back, while the table moves."""
    source, library, offset = folder / "shim.c", folder / "shim.so", folder / "offset"
    source.write_text(SHIM)
    offset.write_text("0")
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        raise NotHere("there is no C compiler to make a clock that jumps")
    subprocess.run([compiler, "-shared", "-fPIC", "-O1", "-o", library, source, "-ldl"], check=True)
    more = {"LD_PRELOAD": str(library), "CLOCK_OFFSET_FILE": str(offset)}
    with sqlite_bench(folder, settings=more) as bench:
        bench.submit()
        bench.until_it_moves()
        offset.write_text("86400")
        time.sleep(0.3)
        offset.write_text("-86400")
        yield bench
