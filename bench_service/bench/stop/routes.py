"""The way of a stop to its bench: the stop channel of this host, or the listener of the supervisor on another one.

Neither needs the database. The address of a bench's supervisor is read while the database answers, and kept in
memory (`StopAddresses`).
"""

import logging
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Protocol

from bench_service.bench.processes import HOST
from bench_service.bench.safety import Safety
from bench_service.bench.stop.channel import StopChannel
from bench_service.bench.stop.word import StopWord

log = logging.getLogger(__name__)
BENCH_ID = re.compile(r"[a-z0-9][a-z0-9_-]{0,31}")
"""Bench names that may become part of a file's name."""


@dataclass(frozen=True)
class Sent:
    """Outcome of a stop request: whether a process took it, and the bench's safety where that process said so."""

    taken: bool
    """True where the bench has it: in the stop channel's file, or in the hands of its worker or supervisor."""
    safety: Safety | None = None
    """Safety of the bench after the stop; None: this route does not report it."""


class StopRoute(Protocol):
    """A route of a stop to one bench. Interface: over the channel of this host, or over TCP to another one."""

    @property
    def here(self) -> bool:
        """True where the bench's devices are on this host."""
        ...

    def ask(self, word: StopWord) -> Sent:
        """Send a stop request to the bench. Raises nothing: one that did not arrive is not taken."""
        ...


class ChannelRoute:
    """The route of a stop over the channel in this host's device folder, and over the supervisor's listener where the
    channel fails. Implements `StopRoute`.

    The channel takes nothing where its file belongs to another user, or no descriptor is left.
    """

    here = True

    def __init__(self, channel: StopChannel, otherwise: Callable[[str], StopRoute | None]) -> None:
        self._channel = channel
        self._otherwise = otherwise

    def ask(self, word: StopWord) -> Sent:
        if self._channel.ask(word):
            return Sent(True)
        log.warning("the stop channel of bench %s did not take a stop by %s", self._channel.bench_id, word.by)
        other = self._otherwise(self._channel.bench_id)
        return Sent(False) if other is None else other.ask(word)


class StopRoutes:
    """The routes of a stop to every bench that can be stopped from this process, with the channels of this host kept
    open.
    """

    def __init__(
        self,
        folder: Path | None,
        elsewhere: Callable[[str], StopRoute | None] = lambda _: None,
        where: Callable[[str], str] = lambda _: "",
    ) -> None:
        """Set up with `folder`, the place of this host's stop channels, and `elsewhere`, which returns the route
        to a bench on another host.

        `where`: the name of that host, empty where it is not known.
        """
        self._folder = folder
        self._elsewhere = elsewhere
        self._where = where
        self._mutex = Lock()
        self._channels: dict[str, StopChannel] = {}

    def channel(self, bench_id: str) -> StopChannel | None:
        """Return the stop channel of a bench; None where the bench has no device files on this host. It stays open, so
        that a stop needs no new file descriptor.
        """
        with self._mutex:
            found = self._channels.get(bench_id)
            if found is None and self._folder is not None and BENCH_ID.fullmatch(bench_id):
                found = StopChannel(self._folder, bench_id)
                if not found.exists:
                    return None
                with suppress(OSError):  # for a bench that an older version drove; else the file is complete already
                    found.prepare()
                self._channels[bench_id] = found
            return found

    def to(self, bench_id: str) -> StopRoute | None:
        """Return the route to a bench; None where the database is the only one."""
        channel = self.channel(bench_id)
        return self._elsewhere(bench_id) if channel is None else ChannelRoute(channel, self._elsewhere)

    def wake(self, bench_id: str) -> None:
        """Wake the bench's worker, if it is on this host, so that it looks into its queue."""
        channel = self.channel(bench_id)
        if channel is not None:
            channel.wake()

    def unreached(self, bench_id: str, here: bool) -> str:
        """Return the message to a person whose stop has reached no process; `here`: the bench is on this host."""
        host = HOST if here else self._where(bench_id)
        at = f"host {host}" if host else "the bench's own host"
        why = (
            "its stop channel on this host takes nothing (the device folder belongs to another user, or this process "
            "has no file descriptor left)"
            if here
            else "its devices are not on this host"
        )
        return (
            f"the stop has NOT reached bench {bench_id!r}: {why}, its supervisor cannot be reached from here, and the "
            f"database does not answer. Press the hardware emergency stop, or run `bench stop --bench {bench_id}` at "
            f"{at}{', as the user whose service drives the bench' if here else ''}."
        )
