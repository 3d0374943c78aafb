"""Journal of the verbs asked of a bench's devices, with the process that asked: a witness that depends on no lock.

One JSON line for each verb, appended with one write; bounded by size. A full disk costs lines, never a job.
"""

import json
import logging
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from bench_service import wall_clock

ROTATE_BYTES = 2_000_000
"""Size at which a journal becomes an old one [bytes]."""
KEPT = 3
"""Number of old journals that are kept."""

log = logging.getLogger(__name__)


class DeviceJournal:
    """Journal of one bench's devices: a file to which any process appends lines; whole lines never mix."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: int | None = None
        self._size = 0
        self._told = False
        self._cut = b""
        """Bytes that end a line for which there was not room enough."""

    def write(self, verb: str, arguments: Mapping[str, Any], **more: Any) -> None:
        """Append a line of JSON: time, process id, verb, arguments, and the fields of `more`. Never raises: a full disk
        costs the line.
        """
        entry = {"at": wall_clock.now().isoformat(), "pid": os.getpid(), "verb": verb, "arguments": dict(arguments)}
        line = json.dumps({**entry, **more}, separators=(",", ":"), default=str).encode() + b"\n"
        try:
            if self._file is None:
                self._open()
            assert self._file is not None
            whole = self._cut + line
            written = os.write(self._file, whole)
            self._cut = b"" if written == len(whole) else b"\n"
        except OSError as error:
            if not self._told:
                log.warning("the journal %s cannot be written: %s", self.path, error)
                self._told = True
            return
        self._size += len(line)

    def rotate(self) -> None:
        """Start a new file when the journal is long enough; only the holder of the devices' link may call it."""
        if self._size < ROTATE_BYTES:
            return
        self.close()
        for number in range(KEPT, 1, -1):
            younger = self._old(number - 1)
            if younger.exists():
                younger.replace(self._old(number))
        self.path.replace(self._old(1))

    def entries(self) -> list[dict[str, Any]]:
        """Return every line that is kept, oldest first, as JSON objects; without those that a full disk cut."""
        found: list[dict[str, Any]] = []
        for file in [*(self._old(number) for number in range(KEPT, 0, -1)), self.path]:
            for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else []:
                with suppress(json.JSONDecodeError):
                    found.append(json.loads(line))
        return found

    def close(self) -> None:
        """Close the journal's file; the next line opens it again."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def _old(self, number: int) -> Path:
        return self.path.with_name(f"{self.path.name}.{number}")

    def _open(self) -> None:
        self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o644)
        self._size = os.fstat(self._file).st_size
