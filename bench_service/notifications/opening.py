"""Opening of the notifier from the settings: its targets, the outboxes where messages wait, and the watch."""

from collections.abc import Callable
from contextlib import ExitStack

from bench_service.bench.processes import Watch
from bench_service.campaigns.stores import Stores
from bench_service.notifications.notifier import Notifier
from bench_service.notifications.outbox import Outbox
from bench_service.notifications.targets import read_targets
from bench_service.settings import Settings


def begin_notifier(
    settings: Settings,
    stores: Stores,
    free_bytes: Callable[[], int | None],
    least_free_bytes: int,
    watch: Watch,
    closing: ExitStack,
) -> None:
    """Start the notifier of this process's bench, where `BENCH_NOTIFY` names a file of targets; it ends with `closing`.
    Raises `Misconfigured`. `free_bytes`: returns the free space of the database's disk, None where it is not known.
    """
    if settings.notify is None:
        return
    targets = read_targets(settings.notify)
    outboxes = [Outbox(settings.devices_in() / "messages", target, targets.pages) for target in targets.target]
    notifier = Notifier(settings.bench_id, stores, outboxes, free_bytes, least_free_bytes, watch)
    notifier.begin()
    closing.callback(notifier.end)
