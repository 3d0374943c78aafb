"""Opens the notifier of a process: its targets from the file of the settings, an outbox each, its thread at work."""

from collections.abc import Callable

from bench_service.campaigns.stores import Stores
from bench_service.model.errors import Misconfigured
from bench_service.notifications.notifier import Notifier
from bench_service.notifications.outbox import Outbox
from bench_service.notifications.targets import read_targets
from bench_service.settings import Settings


def open_notifier(
    settings: Settings, stores: Stores, free_bytes: Callable[[], int | None], least_free_bytes: int
) -> Notifier:
    """The notifier of this process's bench, at work. Raises `Misconfigured`."""
    if settings.notify is None:
        raise Misconfigured("BENCH_NOTIFY names no file of targets")
    targets = read_targets(settings.notify)
    outboxes = [Outbox(settings.devices_in() / "messages", target, targets.pages) for target in targets.target]
    notifier = Notifier(settings.bench_id, stores, outboxes, free_bytes, least_free_bytes)
    notifier.begin()
    return notifier
