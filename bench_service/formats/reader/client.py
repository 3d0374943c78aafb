"""Client of the process that reads a file: it waits within a deadline, and trusts nothing that comes back."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import numpy as np

from bench_service.formats.bounds import Bounds
from bench_service.formats.description import ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.import_request import MOST_FILES, ImportFile
from bench_service.formats.proposal.model import Proposal
from bench_service.formats.reader.frames import (
    CHILD,
    END,
    FOUND,
    PROPOSED,
    REFUSED,
    SAMPLES,
    Broken,
    receive,
    send_json,
)
from bench_service.formats.reader.refusals import NoRoom, refused
from bench_service.wall_clock import monotonic_s
from procedures.core.errors import BadParameter
from procedures.core.recording import Channel, RawArray

AT_ONCE = 2
"""Largest number of files that are read at one time."""
LOADING_S = 60.0
"""Time that the host may take to load its readers [s]."""
_ENVIRONMENT = {
    "ARROW_DEFAULT_MEMORY_POOL": "system",
    "MALLOC_ARENA_MAX": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
}
"""A memory limit counts addresses: allocators that keep large ranges of them in reserve would use it up."""
_BEGIN = (
    "import json,sys;sys.path[:]=json.loads(sys.argv[1]);from bench_service.formats.reader.host import main;main(%d)"
)


class NoReader(Exception):
    """Raised where the process that reads files cannot be begun, or is gone."""


@dataclass
class _Budget:
    """Time for which a process may be waited for, all its waits together [s]."""

    left_s: float
    line: socket.socket = field(repr=False)
    _since_s: float = field(default_factory=monotonic_s)

    def begin(self) -> None:
        """Start or continue the wait."""
        self._since_s = monotonic_s()

    def before_wait(self) -> None:
        """Subtract the time that has passed. Raises `TimeoutError`."""
        now_s = monotonic_s()
        self.left_s -= now_s - self._since_s
        self._since_s = now_s
        if self.left_s <= 0.0:
            raise TimeoutError
        self.line.settimeout(self.left_s)


@dataclass(frozen=True)
class _Reading:
    """An import that a process reads: what `formats.import_file.Imported` asks for."""

    description: ImportDescription
    rate_hz: float
    count: int
    dtype: type[np.int32] | type[np.float64]
    source: dict[str, Any]
    _receive: "_Line" = field(repr=False)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Channels of the imported recording."""
        return tuple(channel.channel() for channel in self.description.channels)

    def blocks(self) -> Iterator[RawArray]:
        """The samples in order, each block (n, channels), once. Raises as the reading itself does."""
        width = len(self.description.channels)
        while True:
            kind, payload = self._receive.frame()
            if kind == END:
                return
            if kind != SAMPLES or len(payload) % (width * np.dtype(self.dtype).itemsize):
                raise Broken(f"a frame of kind {kind!r}")
            if self.dtype is np.int32:
                yield np.frombuffer(payload, np.int32).reshape(-1, width)
            else:
                yield np.frombuffer(payload, np.float64).reshape(-1, width)


class FileReader:
    """Reads imported files in processes of their own, with limits of memory and time. `close` ends the host that forks
    them.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._host: subprocess.Popen[bytes] | None = None
        self._control: socket.socket | None = None
        self._places = threading.BoundedSemaphore(AT_ONCE)

    def close(self) -> None:
        """Stop the host process; a reading that is under way ends as it would."""
        with self._lock:
            self._end_host()

    @contextmanager
    def reading(self, files: Sequence[ImportFile], description: ImportDescription) -> Generator[_Reading]:
        """Check files whole; their samples can be taken within the block.

        Raises `UnreadableFile`, `UnfitRecording`, `BadParameter`, and `NoRoom`, `NoReader`.
        """
        if len(files) > MOST_FILES:
            raise BadParameter("files", len(files), f"at most {MOST_FILES} files are joined")
        with ExitStack() as closing, self._places:
            descriptors = [_descriptor(file.stream, closing) for file in files]
            bounds = Bounds.of(sum(os.fstat(d).st_size for d in descriptors))
            line = closing.enter_context(_Line(self._connected(), [file.name for file in files], bounds))
            line.ask(descriptors, {"description": description.model_dump_json()})
            kind, payload = line.frame()
            if kind != FOUND:
                raise NoReader(f"a frame of kind {kind!r} came first")
            found = json.loads(payload)
            dtype = np.int32 if found["dtype"] == "int32" else np.float64
            if found["simulated"]:  # the file itself may say so
                description = description.model_copy(update={"simulated": True})
            yield _Reading(description, found["rate_hz"], found["count"], dtype, found["source"], line)

    def describe(self, file: ImportFile, unit: str | None, form: str | None, table: str | None) -> Proposal:
        """Return a proposed description of a file; `unit`, `form`, `table` as in `propose`.

        Raises `UnreadableFile`, `UnfitRecording`, `BadParameter`, and `NoRoom`, `NoReader`.
        """
        with ExitStack() as closing, self._places:
            descriptor = _descriptor(file.stream, closing)
            bounds = Bounds.of(os.fstat(descriptor).st_size)
            line = closing.enter_context(_Line(self._connected(), [file.name], bounds))
            line.ask([descriptor], {"describe": {"unit": unit, "format": form, "table": table}})
            kind, payload = line.frame()
            if kind != PROPOSED:
                raise NoReader(f"a frame of kind {kind!r} came first")
            return Proposal.model_validate_json(payload)

    def _connected(self) -> socket.socket:
        """Open a line to a new child. Raises `NoReader`."""
        with self._lock:
            for last in (False, True):
                ours, theirs = socket.socketpair()
                try:
                    with theirs:
                        socket.send_fds(self._running(), [b"l"], [theirs.fileno()])
                    return ours
                except OSError as error:
                    ours.close()
                    self._end_host()
                    if last:
                        raise NoReader(f"the process that reads files is gone: {error}") from error
        raise NoReader("the process that reads files is gone")

    def _running(self) -> socket.socket:
        """Return the line to the host, which is started if needed. Raises `OSError`."""
        if self._control is not None and self._host is not None and self._host.poll() is None:
            return self._control
        self._end_host()
        ours, theirs = socket.socketpair()
        with theirs:
            command = [sys.executable, "-c", _BEGIN % theirs.fileno(), json.dumps(sys.path)]
            self._host = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
                env={**os.environ, **_ENVIRONMENT},
                start_new_session=True,
            )
        ours.settimeout(LOADING_S)
        self._control = ours
        if ours.recv(1) != b"r":
            raise ConnectionError("it ended while it was loaded")
        return ours

    def _end_host(self) -> None:
        if self._control is not None:
            self._control.close()
        if self._host is not None:
            try:
                self._host.wait(2.0)
            except subprocess.TimeoutExpired:
                self._host.kill()
                self._host.wait()
        self._host = self._control = None


class _Line:
    """Line to one child; at its end the child is gone, whatever it was doing."""

    def __init__(self, line: socket.socket, names: Sequence[str], bounds: Bounds) -> None:
        self._line = line
        self._names = names
        self._bounds = bounds
        self._budget = _Budget(bounds.time_s, line)
        self._child: int | None = None
        """Open a descriptor of its process, so that another process with the same number is never meant."""

    def __enter__(self) -> "_Line":
        return self

    def __exit__(self, *_: object) -> None:
        if self._child is not None:
            with suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._child, signal.SIGKILL)
            os.close(self._child)
        self._line.close()

    def ask(self, descriptors: Sequence[int], asked: dict[str, Any]) -> None:
        """Hand the files over to the child, with what is asked of it. Raises `NoReader`."""
        try:
            self._line.settimeout(LOADING_S)
            socket.send_fds(self._line, [b"f"], list(descriptors))
            kind, payload = receive(self._line)
            if kind != CHILD:
                raise NoReader(f"a frame of kind {kind!r} came first")
            with suppress(AttributeError, OSError):  # elsewhere it ends by its own limit of time
                self._child = os.pidfd_open(int(payload))
            send_json(self._line, CHILD, {"names": list(self._names), **asked})
        except (OSError, Broken) as error:
            raise NoReader(f"the process that reads files is gone: {error}") from error

    def frame(self) -> tuple[bytes, bytes]:
        """Receive the next frame; raise the refusal that the child sent."""
        self._budget.begin()
        try:
            kind, payload = receive(self._line, self._budget.before_wait)
        except TimeoutError as error:
            raise UnreadableFile(
                self._names[0], f"took longer than {self._bounds.time_s:.0f} s to read, the most for a file of its size"
            ) from error
        except (OSError, Broken) as error:
            raise UnreadableFile(
                self._names[0],
                "cannot be read: the process that read it ended, for want of memory or by a fault of the file",
            ) from error
        if kind == REFUSED:
            raise refused(json.loads(payload), self._bounds)
        return kind, payload


def _descriptor(stream: BinaryIO, closing: ExitStack) -> int:
    """Return a descriptor of a stream's file; a stream in memory is copied into an unnamed one. Raises `NoRoom`."""
    try:
        stream.flush()
        return stream.fileno()
    except (OSError, ValueError, AttributeError):
        pass
    try:
        file = closing.enter_context(tempfile.TemporaryFile())  # noqa: SIM115  closed by the stack
        stream.seek(0)
        shutil.copyfileobj(stream, file)
        file.flush()
    except OSError as error:
        raise NoRoom(f"no room for the file in the temporary folder: {error.strerror}") from error
    return file.fileno()
