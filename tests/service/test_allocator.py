"""The limits of the C library's allocator, read from that library itself: two arenas, large blocks apart."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

GLIBC = "glibc" in (os.confstr("CS_GNU_LIBC_VERSION") or "") if "CS_GNU_LIBC_VERSION" in os.confstr_names else False
pytestmark = pytest.mark.skipif(not GLIBC, reason="another C library has no arenas of this kind")
ARENAS_OF_THREADS = """
import ctypes, sys, threading
from bench_service.cli.processes.allocator import limit_allocator

if sys.argv[2] == "limited":
    assert limit_allocator()
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


LARGE_BLOCKS = """
import ctypes, sys
from bench_service.cli.processes.allocator import MAPPED_BYTES, limit_allocator

if sys.argv[2] == "limited":
    assert limit_allocator()
libc = ctypes.CDLL(None)
libc.malloc.restype, libc.malloc.argtypes = ctypes.c_void_p, (ctypes.c_size_t,)
libc.free.argtypes = (ctypes.c_void_p,)
libc.free(libc.malloc(4 * MAPPED_BYTES))  # from now on glibc would place smaller ones on the heap
held = libc.malloc(2 * MAPPED_BYTES)
libc.fopen.restype = ctypes.c_void_p
file = libc.fopen(sys.argv[1].encode(), b"w")
libc.malloc_info(0, ctypes.c_void_p(file))
libc.fclose(ctypes.c_void_p(file))
"""


def mapped_mb(folder: Path, how: str) -> float:
    report = folder / f"malloc-{how}.xml"
    bare = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}
    subprocess.run([sys.executable, "-c", LARGE_BLOCKS, str(report), how], check=True, timeout=60, env=bare)
    found = re.search(r'<total type="mmap" count="\d+" size="(\d+)"', report.read_text())
    assert found is not None
    return int(found[1]) / 1e6


def test_a_large_block_is_mapped_apart_also_after_a_larger_one_was_freed(tmp_path: Path) -> None:
    assert mapped_mb(tmp_path, "limited") > 8.0
    assert mapped_mb(tmp_path, "unlimited") < 8.0, "the limit would show nothing"


def test_twelve_threads_share_two_arenas(tmp_path: Path) -> None:
    assert arenas(tmp_path, "limited") <= 2
    assert arenas(tmp_path, "unlimited") > 2, "the limit would show nothing"


def test_the_environments_own_limit_comes_first(tmp_path: Path) -> None:
    assert 2 < arenas(tmp_path, "limited", MALLOC_ARENA_MAX="5") <= 5
