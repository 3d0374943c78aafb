"""Analyses that processes share: the same numbers and the same refusals as in one thread, and processes that end."""

import os
import signal
from collections.abc import Callable, Iterator

import numpy as np
import psutil
import pytest

from bench_service.campaigns.stores import Stores
from bench_service.evidence.spread_processes import MANY_VALUES, SpreadProcesses
from bench_service.model.records import NewRecording
from bench_service.wall_clock import monotonic_s, pause
from procedures.analysis.fitness.watched import Watch
from procedures.analysis.launch.analysis import INSPECTION, analyse_launches
from procedures.analysis.launch.results import LaunchNoise
from procedures.analysis.launch.settings import LaunchSettings
from procedures.core.errors import UnfitRecording
from procedures.core.recording import RawArray, Recording
from procedures.core.spread import each, spread_over

RATE_HZ, SECONDS = 50.0, 400
SETTINGS = LaunchSettings(wavelet_rule=None)
Store = Callable[[RawArray], Recording]


@pytest.fixture(scope="module")
def processes() -> Iterator[SpreadProcesses]:
    """Processes that have begun: a second or two of imports."""
    shared = SpreadProcesses()
    shared.begin(MANY_VALUES)
    yield shared
    shared.close()


@pytest.fixture
def store(stores: Stores, new_recording: Callable[..., NewRecording]) -> Store:
    """A function that stores counts of six channels, (n, 6)."""

    def stored(raw: RawArray) -> Recording:
        writer = stores.recordings.open(new_recording(rate_hz=RATE_HZ))
        writer.write(raw)
        return stores.recordings.load(writer.seal().id)

    return stored


def _raw(seed: int) -> RawArray:
    """Counts of white noise of forty counts at rest, accelerometer x upwards, (n, 6)."""
    rng = np.random.Generator(np.random.PCG64(seed))
    raw = rng.normal(0.0, 40.0, (int(RATE_HZ * SECONDS), 6))
    raw[:, 3] += 9.81 / RATE_HZ / 3.7e-4
    return raw.round().astype(np.int32)


def _analysed(recordings: list[Recording], shared: SpreadProcesses | None) -> tuple[tuple[LaunchNoise, ...], Watch]:
    watch = Watch(recordings, INSPECTION)
    with spread_over(shared):
        return analyse_launches(watch.recordings, ["a", "b", "c"][: len(recordings)], SETTINGS), watch


@pytest.mark.parametrize("launches", [1, 2, 3])
def test_shared_or_not_the_numbers_are_the_same_to_the_last_bit(
    store: Store, processes: SpreadProcesses, launches: int
) -> None:
    recordings = [store(_raw(seed)) for seed in range(launches)]
    alone, watch = _analysed(recordings, None)
    shared, shared_watch = _analysed(recordings, processes)
    assert repr(shared) == repr(alone)
    assert [r.is_read for r in shared_watch.recordings] == [True] * launches
    assert [r.seen() for r in shared_watch.recordings] == [r.seen() for r in watch.recordings]


@pytest.mark.parametrize("launches", [1, 2])
def test_a_refusal_is_the_same(store: Store, processes: SpreadProcesses, launches: int) -> None:
    hung = _raw(1)
    hung[5000:9000] = hung[5000]
    recordings = [store(hung) for _ in range(launches)]
    with pytest.raises(UnfitRecording) as alone:
        _analysed(recordings, None)
    with pytest.raises(UnfitRecording) as shared:
        _analysed(recordings, processes)
    assert str(shared.value) == str(alone.value)


def _own_number(_: int) -> int:
    return os.getpid()


def _killed_elsewhere(service: int) -> int:
    if os.getpid() != service:
        os.kill(os.getpid(), signal.SIGKILL)
    return service


def test_where_a_process_dies_the_work_is_done_here_and_the_next_begins_anew() -> None:
    shared, here = SpreadProcesses(), os.getpid()
    try:
        with spread_over(shared):
            assert each(_killed_elsewhere, [here, here, here]) == [here] * 3
            assert here not in each(_own_number, [1, 2])
    finally:
        shared.close()
    with spread_over(shared):
        assert each(_own_number, [1, 2]) == [here, here], "a closed service begins no process"


def _fails_in_the_second(service: int) -> int:
    if os.getppid() != service:
        raise TypeError("boom")
    pause(0.3)  # so the second one takes a part
    return service


def test_an_error_of_the_second_process_that_nobody_foresaw_comes_as_it_is(processes: SpreadProcesses) -> None:
    here = os.getpid()
    with spread_over(processes), pytest.raises(TypeError, match="boom"):
        each(_fails_in_the_second, [here, here])
    with spread_over(processes):
        assert here not in each(_own_number, [1, 2]), "the processes go on"


def test_idle_processes_end_and_short_recordings_begin_none() -> None:
    shared = SpreadProcesses(idle_s=0.2)
    shared.begin(MANY_VALUES - 1)
    assert shared.processes() == []
    try:
        with spread_over(shared.over(MANY_VALUES)):
            shared.begin(MANY_VALUES)
            numbers = set(each(_own_number, list(range(4))))
        pause(0.5)
        assert numbers <= set(shared.processes()), "they wait for the analysis that was announced"
        shared.done()
        deadline_s = monotonic_s() + 30.0
        while any(psutil.pid_exists(number) for number in numbers):
            assert monotonic_s() < deadline_s
            pause(0.05)
        assert shared.processes() == []
    finally:
        shared.close()
