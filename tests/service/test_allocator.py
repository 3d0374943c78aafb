"""The limit on the C library's arenas, asked of that library itself: threads that allocate at once share the two."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

GLIBC = "glibc" in (os.confstr("CS_GNU_LIBC_VERSION") or "") if "CS_GNU_LIBC_VERSION" in os.confstr_names else False
pytestmark = pytest.mark.skipif(not GLIBC, reason="another C library has no arenas of this kind")
ARENAS_OF_THREADS = """
import ctypes, sys, threading
from bench_service.cli.processes.allocator import few_arenas

if sys.argv[2] == "limited":
    assert few_arenas()
libc = ctypes.CDLL(None)
libc.malloc.restype, libc.malloc.argtypes = ctypes.c_void_p, (ctypes.c_size_t,)
barrier = threading.Barrier(12)


def allocate():  # each thread's first block decides about its arena
    barrier.wait()
    assert libc.malloc(4096)
    barrier.wait()


threads = [threading.Thread(target=allocate) for _ in range(12)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
libc.fopen.restype = ctypes.c_void_p
file = libc.fopen(sys.argv[1].encode(), b"w")
libc.malloc_info(0, ctypes.c_void_p(file))
libc.fclose(ctypes.c_void_p(file))
"""


def arenas(folder: Path, how: str, **environment: str) -> int:
    report = folder / "malloc.xml"
    bare = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}
    command = [sys.executable, "-c", ARENAS_OF_THREADS, str(report), how]
    subprocess.run(command, check=True, timeout=60, env={**bare, **environment})
    return report.read_text().count("<heap nr=")


def test_twelve_threads_share_two_arenas(tmp_path: Path) -> None:
    assert arenas(tmp_path, "limited") <= 2
    assert arenas(tmp_path, "unlimited") > 2, "the limit would show nothing"


def test_the_environments_own_limit_comes_first(tmp_path: Path) -> None:
    assert 2 < arenas(tmp_path, "limited", MALLOC_ARENA_MAX="5") <= 5
