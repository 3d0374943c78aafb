"""Files of a driving process in the bench's device folder: stop channel, heartbeat, and its identity.

Composed here because it joins devices, stop guard and database.
"""

from collections.abc import Callable, Iterable

from bench_service.bench.heartbeat import HeartbeatFile
from bench_service.bench.make_safe import Rescue, before_anything_else
from bench_service.bench.processes import ProcessIdentity
from bench_service.bench.stop.channel import StopChannel
from bench_service.bench.stop.guard import StopGuard
from bench_service.bench.stop.keeper import StopKeeper
from bench_service.bench.stop.word import StopWord
from bench_service.campaigns.stores import Stores
from bench_service.drivers.composition import own_devices
from bench_service.jobs.stop_entry import StopEntry
from bench_service.model.errors import StorageFull
from bench_service.model.records import BenchStop
from bench_service.persistence.bench.host_files import HostFiles
from bench_service.settings import Settings


class BenchFiles:
    """Device files of the settings' bench on this host: stop channel, heartbeat, identity of the driving process."""

    def __init__(self, settings: Settings) -> None:
        folder, self._bench_id = settings.devices_in(), settings.bench_id
        self.host = HostFiles(folder, self._bench_id)
        self._folder = folder
        self._channel = StopChannel(folder, self._bench_id)
        self._heartbeat = HeartbeatFile(folder, self._bench_id)
        self._devices = own_devices(settings)

    def rescue(self) -> Rescue | None:
        """Make safe the devices that a dead process left unsafe, before a database is opened; None where they were
        safe. See `before_anything_else`.
        """
        return before_anything_else(self._devices, f"the service, {ProcessIdentity.own()}")

    def begin_driving(self) -> None:
        """Write this process into the files as the bench's driver; its lease must be held. Raises `StorageFull`."""
        try:
            self._channel.prepare()
            self._heartbeat.prepare()
            self.host.begin_driving()
        except OSError as error:
            raise StorageFull(
                f"no bench is driven without its stop channel and heartbeat, and {self._folder} takes neither: {error}"
            ) from error

    def stopped(self) -> bool:
        """Return whether a stop stands on the bench's channel."""
        return bool(self._channel.standing())

    def guard(self, make_safe: Callable[[], object], wake: Callable[[], object]) -> StopGuard:
        """Return the stop guard of this process, which has the bench made safe and the worker woken."""
        return StopGuard(self._channel, self._heartbeat, self._is_safe, make_safe, wake)

    def keep_books(self, stores: Stores) -> StopKeeper:
        """Start the thread that enters stops of the channel into the database and removes released ones, and
        return it.
        """
        keeper = StopKeeper(self._channel, _Books(stores, self._bench_id))
        keeper.begin()
        return keeper

    def _is_safe(self) -> bool:
        """Return whether the devices report that they are safe; not where their register cannot be read."""
        try:
            state = self._devices.device_state()
        except OSError:  # no descriptor left, for one
            return False
        return state is not None and state.safe


class _Books:
    """A `bench_service.bench.stop.exchange.StopBooks` over a service's stores."""

    def __init__(self, stores: Stores, bench_id: str) -> None:
        self._stores = stores
        self._bench_id = bench_id
        self._entry = StopEntry(stores.benches, stores.queue, stores.jobs, stores.audit)

    def standing(self) -> tuple[BenchStop, ...]:
        return self._stores.benches.standing_stops(self._bench_id)

    def stored(self, ids: Iterable[str]) -> tuple[BenchStop, ...]:
        return self._stores.benches.stored_stops(ids)

    def enter(self, word: StopWord) -> None:
        self._entry.enter(self._bench_id, word)
