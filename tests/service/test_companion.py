"""The supervisor beside a driving process is started again when it ends, at a pace, and not in another one's place."""

import logging
from dataclasses import dataclass, field
from itertools import pairwise

import pytest

from bench_service.cli.processes.companion import AGAIN_S, SLOWEST_S, UNSUPERVISED_S, Companion
from bench_service.cli.processes.supervising import SUPERVISED_ALREADY

KILLED = -9


@dataclass
class Child:
    """A process that ends when it is told to."""

    code: int | None = None

    def poll(self) -> int | None:
        return self.code


@dataclass
class Host:
    """Starts children, and knows whether somebody else supervises."""

    started: list[Child] = field(default_factory=list)
    another: bool = False
    refuses: bool = False

    def spawn(self) -> Child:
        if self.refuses:
            raise OSError("no process can be had")
        self.started.append(Child())
        return self.started[-1]

    def supervised(self) -> bool:
        return self.another or bool(self.started and self.started[-1].code is None)


@pytest.fixture
def host() -> Host:
    return Host()


@pytest.fixture
def companion(host: Host) -> Companion:
    return Companion("sim", host.spawn, host.supervised)


def test_one_that_was_killed_comes_back_at_once_but_not_twice_within_a_second_and_it_is_said(
    host: Host, companion: Companion, caplog: pytest.LogCaptureFixture
) -> None:
    companion.look(0.0)
    companion.look(5.0)
    assert len(host.started) == 1
    host.started[0].code = KILLED
    with caplog.at_level(logging.WARNING):
        companion.look(10.0)
    assert "bench sim was ended by signal 9: started again now" in caplog.text
    assert len(host.started) == 2
    host.started[1].code = KILLED
    companion.look(10.5)
    companion.look(10.0 + 1.9 * AGAIN_S)
    assert len(host.started) == 2
    companion.look(10.0 + 2 * AGAIN_S)
    assert len(host.started) == 3


def test_one_that_does_not_last_is_started_ever_more_slowly_and_one_that_lasted_soon_again(
    host: Host, companion: Companion
) -> None:
    """Ended as soon as it is seen: the times of the starts, looked for every half second of ten minutes."""
    at: list[float] = []
    for half_seconds in range(1200):
        companion.look(now_s := half_seconds / 2)
        if len(host.started) > len(at):
            at.append(now_s)
            host.started[-1].code = 1
    pauses = [later - earlier for earlier, later in pairwise(at)]
    assert min(pauses) >= AGAIN_S
    assert pauses == sorted(pauses)
    assert pauses[-1] == pytest.approx(SLOWEST_S, abs=1.0)
    host.started[-1].code = None
    companion.look(10_000.0)  # the next start, which lasts
    count = len(host.started)
    companion.look(10_000.0 + SLOWEST_S)
    host.started[-1].code = KILLED
    companion.look(10_100.0)
    assert len(host.started) == count + 1


def test_one_that_left_the_bench_to_another_comes_back_only_when_nobody_has_supervised_it_for_a_while(
    host: Host, companion: Companion
) -> None:
    host.another = True
    companion.look(0.0)  # the first start is not asked for twice: the other one may be about to leave
    host.started[0].code = SUPERVISED_ALREADY
    for second in range(1, 100):
        companion.look(float(second))
    assert len(host.started) == 1
    host.another = False
    companion.look(100.0)
    host.another = True  # whoever keeps it has started it again
    companion.look(99.0 + UNSUPERVISED_S)
    host.another = False
    companion.look(102.0 + UNSUPERVISED_S)
    assert len(host.started) == 1
    companion.look(99.0 + 2 * UNSUPERVISED_S)
    assert len(host.started) == 2


def test_a_host_that_can_start_no_process_is_asked_again(host: Host, companion: Companion) -> None:
    host.refuses = True
    companion.look(0.0)
    host.refuses = False
    companion.look(0.5 * AGAIN_S)
    assert not host.started
    companion.look(AGAIN_S)
    assert len(host.started) == 1
