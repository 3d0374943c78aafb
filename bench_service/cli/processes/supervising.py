"""The command ``bench supervise``. Imports no engine, no simulator, no numerics.

It has a composition of its own, because that of the service loads what a supervisor must do without.
"""

import logging
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial

from bench_service.bench.devices import BenchDevices
from bench_service.bench.heartbeat import Heartbeat, HeartbeatFile
from bench_service.bench.stop.channel import StopChannel
from bench_service.bench.stop.listener import StopListener
from bench_service.bench.stop.messages import made_secret
from bench_service.bench.supervisor import Supervisor
from bench_service.bench.worker_time_limits import hung_after_s
from bench_service.cli.processes.ending import ending_on_signals
from bench_service.cli.processes.logs import set_up
from bench_service.cli.processes.private_files import protect
from bench_service.drivers.composition import longest_safe_s, own_devices
from bench_service.model.errors import BenchBusy
from bench_service.persistence import acquire_lease
from bench_service.persistence.bench.host_files import HostFiles, SupervisorLock
from bench_service.persistence.bench.lease import SUPERVISOR
from bench_service.persistence.bench.safety_books import SqlSafetyBooks
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause

TAKE_OVER_S = 2.0
"""Time for which a companion tries to become the supervisor [s]: an earlier one that ends is gone by then."""
log = logging.getLogger(__name__)
SUPERVISED_ALREADY = 3
"""Exit code of a companion that leaves its bench to another supervisor."""


def supervise(settings: Settings, companion: bool, say: Callable[[str], object]) -> int:
    """Supervise the settings' bench until SIGTERM or SIGINT, and return the exit code. Raises `BenchBusy` if it is
    supervised.

    A companion then leaves it at that, and ends with `SUPERVISED_ALREADY`: one supervisor looks after every process
    that drives the bench.
    """
    set_up(settings, "info")
    protect(settings)
    ending = ending_on_signals()
    folder, bench = settings.devices_in(), settings.bench_id
    files = HostFiles(folder, bench)
    with ExitStack() as closing:
        try:
            closing.callback(_lock(files, TAKE_OVER_S if companion else 0.0).release)
        except BenchBusy:
            if companion:
                return SUPERVISED_ALREADY
            raise
        books = SqlSafetyBooks(settings.database_url, bench)
        closing.callback(books.close)
        take_lease = partial(acquire_lease, settings.database_url, bench, SUPERVISOR)
        devices = own_devices(settings)
        channel, heartbeat = StopChannel(folder, bench), HeartbeatFile(folder, bench)
        try:
            channel.prepare()
        except OSError as error:  # a full disk: what there is must do
            log.warning("the stop channel of bench %s: %s", bench, error)
        listener = _listener(settings, channel, devices)
        if listener is not None:
            listener.begin()
            closing.callback(listener.end)
        if companion:
            log.info("supervising bench %s", bench)
        else:
            say(f"supervising bench {bench}")
        hung_s = hung_after_s(longest_safe_s(settings))
        watching = Supervisor(bench, devices, files, books, take_lease, channel, heartbeat, listener, hung_s=hung_s)
        beats = Heartbeat(HeartbeatFile(folder, bench, of_supervisor=True), watching.goes_on)
        beats.begin()
        closing.callback(beats.end)
        watching.run(ending, companion)
    return 0


def _listener(settings: Settings, channel: StopChannel, devices: BenchDevices) -> StopListener | None:
    """Takes stops from other hosts; None where the settings want none, or no secret can be had."""
    if not settings.stop_listen:
        return None
    secret = made_secret(settings.stop_secret_in())
    if secret is None:
        log.warning("no stop is accepted from other hosts: %s holds no secret", settings.stop_secret_in())
        return None

    def is_safe() -> bool:
        state = devices.device_state()
        return state is not None and state.safe

    return StopListener(settings.stop_listen, secret, channel, is_safe)


def _lock(files: HostFiles, patience_s: float) -> SupervisorLock:
    deadline = monotonic_s() + patience_s
    while True:
        try:
            return files.supervise()
        except BenchBusy:
            if monotonic_s() > deadline:
                raise
        pause(0.1)
