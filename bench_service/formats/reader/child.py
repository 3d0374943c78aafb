"""Child process that reads one import: it limits itself, reads, sends findings and samples, and ends."""

import errno
import json
import os
import resource
import socket
import traceback
from pathlib import Path
from typing import Any

import numpy as np

from bench_service.formats.bounds import MEGABYTE, Bounds
from bench_service.formats.description import ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.import_file import ImportedRecording, read_import
from bench_service.formats.import_request import MOST_FILES, ImportFile
from bench_service.formats.proposal.propose import propose
from bench_service.formats.reader.frames import (
    CHILD,
    END,
    FOUND,
    PROPOSED,
    REFUSED,
    SAMPLES,
    Broken,
    receive,
    send,
    send_json,
)
from procedures.core.errors import BadParameter, DomainError, UnfitRecording

SENT_BYTES = 1024 * 1024
"""Largest number of sample bytes in a frame."""
SPOOLED_BYTES = 2_000 * MEGABYTE
"""Largest file that a reader may write: stamps that do not fit into its memory."""


def serve(line: socket.socket) -> None:
    """Answer the one request that comes on a line: limit this process, read the files, send findings and samples."""
    try:
        _, descriptors, _, _ = socket.recv_fds(line, 1, MOST_FILES)
        send(line, CHILD, str(os.getpid()).encode())
        _, request = receive(line)
        asked = json.loads(request)
        sizes = [os.fstat(d).st_size for d in descriptors]
        _limit(Bounds.of(sum(sizes)))
        files = [
            ImportFile(name, os.fdopen(descriptor, "rb"))
            for name, descriptor in zip(asked["names"], descriptors, strict=True)
        ]
        if "describe" in asked:
            _describe(line, files[0], asked["describe"])
        else:
            _answer(line, files, ImportDescription.model_validate_json(asked["description"]))
    except (OSError, Broken):
        return  # the client has gone


def _limit(bounds: Bounds) -> None:
    """Limit memory, processor time and file size to the import's; a platform without a limit has none."""
    pages = int(Path("/proc/self/statm").read_text().split()[0]) if Path("/proc/self/statm").exists() else 0
    wanted = {
        resource.RLIMIT_CPU: int(2 * bounds.time_s) + 1,
        resource.RLIMIT_FSIZE: SPOOLED_BYTES,
        resource.RLIMIT_CORE: 0,
    }
    if pages:
        wanted[resource.RLIMIT_AS] = pages * resource.getpagesize() + bounds.memory_bytes
    for kind, value in wanted.items():
        try:
            hard = resource.getrlimit(kind)[1]
            allowed = value if hard == resource.RLIM_INFINITY else min(value, hard)
            resource.setrlimit(kind, (allowed, allowed))
        except (OSError, ValueError):
            continue


def _answer(line: socket.socket, files: list[ImportFile], description: ImportDescription) -> None:
    try:
        imported = read_import(files, description)
        send_json(line, FOUND, _found(imported))
        for block in imported.blocks():
            rows = max(1, SENT_BYTES // block[:1].nbytes)
            for start in range(0, len(block), rows):
                part = np.ascontiguousarray(block[start : start + rows])
                send(line, SAMPLES, part.tobytes())
        send(line, END, b"")
    except (BrokenPipeError, ConnectionResetError):
        raise
    except Exception as error:  # whatever a file does to its reader, the service continues
        send_json(line, REFUSED, _refusal(error, files[0].name))


def _describe(line: socket.socket, file: ImportFile, asked: dict[str, str | None]) -> None:
    try:
        proposal = propose(file, asked["unit"], asked["format"], asked["table"])
        send(line, PROPOSED, proposal.model_dump_json().encode())
    except (BrokenPipeError, ConnectionResetError):
        raise
    except Exception as error:  # whatever a file does to its reader, the service continues
        send_json(line, REFUSED, _refusal(error, file.name))


def _found(imported: ImportedRecording) -> dict[str, Any]:
    return {
        "rate_hz": imported.rate_hz,
        "count": imported.count,
        "dtype": np.dtype(imported.dtype).name,
        "source": imported.source,
        "simulated": imported.description.simulated,
    }


def _refusal(error: Exception, name: str) -> dict[str, Any]:
    """Convert a refusal to JSON; the client makes the same error of it."""
    if isinstance(error, UnreadableFile):
        return {"kind": "unreadable", "name": error.name, "problem": error.problem}
    if isinstance(error, BadParameter):
        value = error.value if isinstance(error.value, (str, int, float, list)) else str(error.value)
        return {"kind": "parameter", "field": error.field, "value": value, "allowed": error.allowed}
    if isinstance(error, UnfitRecording | DomainError):
        return {"kind": "unfit", "message": str(error)}
    if isinstance(error, MemoryError):
        return {"kind": "memory", "name": name}
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        return {"kind": "full", "message": f"no room for the stamps of {name} in the temporary folder"}
    return {
        "kind": "unforeseen",
        "name": name,
        "problem": type(error).__name__,
        "log": "".join(traceback.format_exception(error))[-4000:],
    }
