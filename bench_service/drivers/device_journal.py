"""What a bench's devices were asked, verb by verb and by whom: a witness that does not depend on any lock.

One JSON line a verb, appended with one write; bounded by size. A full disk costs lines, never a job.
"""

import json
import logging
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bench_service import wall_clock

ROTATE_BYTES = 2_000_000
"""A journal of this size becomes an old one."""
KEPT = 3
"""How many old ones are kept."""

log = logging.getLogger(__name__)


class DeviceJournal:
    """The journal of one bench; any process may append a line, whole lines never mix."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: int | None = None
        self._size = 0
        self._told = False

    def write(self, verb: str, arguments: Mapping[str, Any], **more: Any) -> None:
        """Append a line: when, which process, verb, arguments, and whatever else matters."""
        entry = {"at": wall_clock.now().isoformat(), "pid": os.getpid(), "verb": verb, "arguments": dict(arguments)}
        line = json.dumps({**entry, **more}, separators=(",", ":"), default=str).encode() + b"\n"
        try:
            if self._file is None:
                self._open()
            assert self._file is not None
            os.write(self._file, line)
        except OSError as error:
            if not self._told:
                log.warning("the journal %s cannot be written: %s", self.path, error)
                self._told = True
            return
        self._size += len(line)

    def rotate(self) -> None:
        """Begin a new journal where this one is long enough; only for whoever has the devices' link."""
        if self._size < ROTATE_BYTES:
            return
        self.close()
        for number in range(KEPT, 1, -1):
            younger = self._old(number - 1)
            if younger.exists():
                younger.replace(self._old(number))
        self.path.replace(self._old(1))

    def entries(self) -> list[dict[str, Any]]:
        """Every line that is kept, oldest first."""
        files = [self._old(number) for number in range(KEPT, 0, -1)] + [self.path]
        return [json.loads(line) for file in files if file.exists() for line in file.read_text().splitlines()]

    def close(self) -> None:
        """Close the file; the next line opens it again."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def _old(self, number: int) -> Path:
        return self.path.with_name(f"{self.path.name}.{number}")

    def _open(self) -> None:
        self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o644)
        self._size = os.fstat(self._file).st_size
