"""Small records at fixed places of a file, each overwritten in place by a single write.

Once the file has its full length no write needs a free byte or a free inode, so a record changes on a full disk too.
(On a file system that copies on write, such as btrfs or zfs, it may still need room: `StopChannel` has sockets
for that, in addition to its file.) Processes of one host see a record at once; a checksum detects a torn record.
"""

import json
import os
import zlib
from collections.abc import Mapping
from typing import Any

from bench_service.wall_clock import pause

RECORD_BYTES = 4096
"""Length of a record, one page: a longer one could be torn by a power failure."""
TRIES = 50
"""Maximum number of retries of a reader that meets a half-written record."""
AGAIN_S = 0.002


class Unreadable(Exception):
    """Raised for a record that does not match its checksum."""


def encoded(document: Mapping[str, Any]) -> bytes | None:
    """Return the bytes of a record: CRC-32, then the document as JSON, padded; None where the document is too long for
    one.
    """
    text = json.dumps(document, ensure_ascii=False)
    body = text.encode(errors="backslashreplace")  # a lone surrogate becomes its JSON escape
    if len(body) > RECORD_BYTES - 16:
        return None
    return f"{zlib.crc32(body):08x} ".encode() + body + b" " * (RECORD_BYTES - 10 - len(body)) + b"\n"


def decoded(record: bytes) -> dict[str, Any] | None:
    """Return the document in the bytes of a record; None in an empty one. Raises `Unreadable` where the checksum does
    not match.
    """
    if not record.strip(b"\0"):
        return None
    checksum, _, body = record.partition(b" ")
    body = body.rstrip()
    if checksum != f"{zlib.crc32(body):08x}".encode():
        raise Unreadable
    return json.loads(body)


def read_record(file: int, number: int = 0) -> dict[str, Any] | None:
    """Read the document of record `number` of an open file; None where nothing was written. Raises `Unreadable`,
    `OSError`.
    """
    for _ in range(TRIES):
        try:
            return decoded(os.pread(file, RECORD_BYTES, number * RECORD_BYTES))
        except Unreadable:
            pause(AGAIN_S)
    raise Unreadable


def write_record(file: int, number: int, record: bytes) -> None:
    """Write an encoded record over record `number` of an open file. Raises `OSError`."""
    os.pwrite(file, record, number * RECORD_BYTES)


def preallocate(file: int, records: int) -> None:
    """Give a file its full length, in allocated blocks. Raises `OSError` where there is no room."""
    size = os.fstat(file).st_size
    missing = records * RECORD_BYTES - size
    if missing > 0:  # zeros that are written, not a hole: a hole would need its blocks when it is filled
        os.pwrite(file, b"\0" * missing, size)
        os.fsync(file)
