"""The rule on descriptors: a leak is found, a pool that fills late and lines that come and go are none."""

import os
import socket
from collections import Counter

import numpy as np
import psutil
import pytest

from tests.soak.descriptors import Descriptors, changed, descriptors_of

MINUTES, LOOKS = 12.0, 360


def _judged(leaked: np.ndarray, connections: np.ndarray, seed: int) -> list[str]:
    """Judge looks between jobs, three of ten while a job's eight lines are still open, as a wire soak has them."""
    rng, run = np.random.default_rng(seed), Descriptors()
    for k in range(LOOKS):
        working = rng.random() < 0.3
        loops = int(rng.poisson(0.3))
        kinds = {"null": 20 + int(leaked[k]), "TCP to the supply": 8 * working, "anon_inode:[eventpoll]": 2 + 3 * loops}
        kinds |= {"bench.sqlite": int(connections[k]), "bench.sqlite-wal": int(connections[k]), "bench.sqlite-shm": 1}
        run.take(k * MINUTES / LOOKS, Counter(kinds))
    return run.judged(MINUTES)


NONE, POOL = np.zeros(LOOKS), np.repeat([3, 3, 11, 9], LOOKS // 4)


@pytest.mark.parametrize("seed", range(20))
def test_a_pool_that_fills_late_and_lines_that_come_and_go_are_no_leak(seed: int) -> None:
    assert _judged(NONE, POOL, seed) == []


@pytest.mark.parametrize("seed", range(5))
def test_one_descriptor_a_minute_is_a_leak_and_is_named(seed: int) -> None:
    (sentence,) = _judged(np.arange(LOOKS) * MINUTES / LOOKS, POOL, seed)
    assert sentence.startswith("descriptors grow by +")
    assert "null" in sentence


def test_more_connections_than_a_pool_has_are_told() -> None:
    assert _judged(NONE, np.full(LOOKS, 16), 1) == [
        "16 connections to bench.sqlite: a pool has 15 at most",
        "16 connections to bench.sqlite-wal: a pool has 15 at most",
    ]


def test_descriptors_are_told_by_what_they_are() -> None:
    process = psutil.Process()
    with socket.create_server(("127.0.0.1", 0)) as server, open(os.devnull) as null:
        port = server.getsockname()[1]
        before = descriptors_of(process, {port: "the supply"})
        with socket.create_connection(("127.0.0.1", port)), server.accept()[0]:
            after = descriptors_of(process, {port: "the supply"})
        assert null.fileno() > 0
    assert before["listening socket"] >= 1
    assert before["null"] >= 1
    assert changed(before, after) == "+1 TCP from the supply, +1 TCP to the supply"
