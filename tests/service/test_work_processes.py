"""Life of the processes for analyses and drawings: begun by work or ahead of it, ended without it."""

import os
from contextlib import closing
from typing import Any

import psutil

from bench_service.evidence.work_processes import Run, WorkProcesses
from bench_service.wall_clock import monotonic_s, pause

LONGEST_S = 60.0
"""Longest wait for the end of a process [s]."""


def open_naming() -> Run:
    """Prepare a process whose only work is to name itself."""

    def run(_name: str, _arguments: tuple[Any, ...]) -> str:
        return str(os.getpid())

    return run


def gone(pid: int) -> bool:
    until = monotonic_s() + LONGEST_S
    while psutil.pid_exists(pid):
        if monotonic_s() > until:
            return False
        pause(0.02)
    return True


def test_processes_end_when_they_are_idle_and_the_next_work_begins_new_ones() -> None:
    with closing(WorkProcesses(open_naming, at_once=1, idle_s=0.1)) as processes:
        first = int(processes.result("name"))
        assert gone(first)
        assert int(processes.result("name")) != first


def test_a_process_that_was_begun_ahead_does_the_work() -> None:
    with closing(WorkProcesses(open_naming, at_once=1)) as processes:
        before = {child.pid for child in psutil.Process().children()}
        processes.begin()
        processes.begin()
        begun = {child.pid for child in psutil.Process().children() if "spawn_main" in " ".join(child.cmdline())}
        assert int(processes.result("name")) in begun - before
        assert len(begun - before) == 1
