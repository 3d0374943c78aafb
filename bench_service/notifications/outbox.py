"""Queue of one target's undelivered messages: one file each, oldest first, so that none is lost with the process."""

import logging
import os
from datetime import datetime, timedelta
from pathlib import Path

from pydantic import TypeAdapter

from bench_service.notifications.channels import Undelivered, deliver
from bench_service.notifications.messages import Message, digest
from bench_service.notifications.targets import URGENT, Mail, Webhook
from bench_service.wall_clock import now

OLDEST = timedelta(days=1)
"""Age at which a message that could not be delivered is given up."""
FIRST_PAUSE = timedelta(seconds=5)
LONGEST_PAUSE = timedelta(minutes=15)
HOUR = timedelta(hours=1)
REMEMBERED = 2000
"""Number of messages that are remembered, so that a service that starts again does not repeat them."""
MOST_FILES = 1000
"""Maximum number of waiting messages; further ones are logged and left out."""

_MESSAGE = TypeAdapter(Message)
log = logging.getLogger(__name__)


class Outbox:
    """Queue of one target's undelivered messages, one file each, so that it survives a restart. It delivers them with
    growing pauses after failures.
    """

    def __init__(self, folder: Path, target: Mail | Webhook, pages: str) -> None:
        self.target = target
        self._folder = folder / target.name
        self._pages = pages
        self._sent: list[datetime] = []
        self._pause = FIRST_PAUSE
        self._due = datetime.min.replace(tzinfo=now().tzinfo)
        self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._book = self._folder / "kept.txt"
        self._urgent: dict[str, bool] = {}
        self._kept = self._book.read_text(encoding="utf-8").split()[-REMEMBERED:] if self._book.exists() else []
        if self._kept:
            self._book.write_text("\n".join(self._kept) + "\n", encoding="utf-8")

    def put(self, message: Message) -> None:
        """Write a message into a file of the queue, if the target wants its kind; a message with a known key is left
        out.

        An urgent one is tried at once, also while the target is left alone after a failure.
        """
        urgent = message.kind in URGENT
        file = self._folder / f"{message.key}.json"
        if message.kind not in self.target.events or message.key in self._kept:
            return
        if not urgent and len(self._files()) >= MOST_FILES:
            log.error(
                "%s has %d messages waiting: this one is dropped: %s", self.target.name, MOST_FILES, message.title
            )
            return
        part = file.with_suffix(".part")
        part.write_bytes(_MESSAGE.dump_json(message))
        os.replace(part, file)
        self._kept.append(message.key)
        with self._book.open("a", encoding="utf-8") as book:
            book.write(message.key + "\n")
        if urgent:
            self._due, self._pause = datetime.min.replace(tzinfo=now().tzinfo), FIRST_PAUSE

    def send(self, at: datetime) -> int:
        """Deliver the messages that are due, and return the number of those that still wait. Blocks while the target
        answers.

        Urgent ones go first, each by itself, and neither count for `per_hour` nor wait for it.
        """
        while at >= self._due and (waiting := self._files()):
            urgent = next((file for file in waiting if self._is_urgent(file)), None)
            batch = [urgent] if urgent is not None else self._ordinary(waiting, at)
            messages = [message for file in batch if (message := self._read(file)) is not None]
            if not batch or (messages and not self._deliver(_one(messages, at), at)):
                break
            for file in batch:
                file.unlink(missing_ok=True)
                self._urgent.pop(file.stem, None)
        return len(self._files())

    def _ordinary(self, waiting: list[Path], at: datetime) -> list[Path]:
        """The files of the next ordinary message: the oldest, all in the last place of the hour, none after it."""
        self._sent = [moment for moment in self._sent if at - moment < HOUR]
        room = self.target.per_hour - len(self._sent)
        if room <= 0:
            return []
        return waiting if len(waiting) > room and room == 1 else waiting[:1]

    def _is_urgent(self, file: Path) -> bool:
        if file.stem not in self._urgent:
            message = self._read(file)
            self._urgent[file.stem] = message is not None and message.kind in URGENT
        return self._urgent[file.stem]

    def _files(self) -> list[Path]:
        return sorted(self._folder.glob("*.json"), key=lambda file: (file.stat().st_mtime_ns, file.name))

    def _read(self, file: Path) -> Message | None:
        try:
            return _MESSAGE.validate_json(file.read_bytes())
        except ValueError as error:
            log.error("a waiting message cannot be read and is dropped (%s): %s", file, error)
            return None

    def _deliver(self, message: Message, at: datetime) -> bool:
        """Try once; True where the message is done with: delivered, refused for good, or too old."""
        try:
            deliver(self.target, message, self._pages)
        except Undelivered as error:
            if error.final or at - message.at > OLDEST:
                log.error("not delivered, and not tried again: %s: %s", message.title, error)
                return True
            log.warning("not delivered, tried again in %s: %s: %s", self._pause, message.title, error)
            self._due, self._pause = at + self._pause, min(2 * self._pause, LONGEST_PAUSE)
            return False
        if message.kind not in URGENT:
            self._sent.append(at)
        self._pause = FIRST_PAUSE
        return True


def _one(messages: list[Message], at: datetime) -> Message:
    return messages[0] if len(messages) == 1 else digest(messages, messages[0].bench, at)
