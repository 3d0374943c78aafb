"""Host process with the file readers loaded: it forks one child for each import, which starts in milliseconds.

It has one thread and opens no file itself. It ends when the service closes the line between them.
"""

import gc
import os
import signal
import socket

from bench_service.formats.reader.child import serve


def main(descriptor: int) -> None:
    """Fork a child for each line that comes through the socket of that descriptor, until the service closes it."""
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # children are not waited for
    for number in (signal.SIGINT, signal.SIGHUP):  # Ctrl-C, a closed terminal: for the service, which closes the line
        signal.signal(number, signal.SIG_IGN)
    gc.collect()
    gc.freeze()
    with socket.socket(fileno=descriptor) as control:
        control.sendall(b"r")
        while True:
            data, lines, _, _ = socket.recv_fds(control, 1, 1)
            if not data:
                return
            if not os.fork():
                _child(control, lines)
            for line in lines:
                os.close(line)


def _child(control: socket.socket, lines: list[int]) -> None:
    """Serve one import in this process, and end it whatever happens."""
    try:
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        control.close()
        for line in lines:
            serve(socket.socket(fileno=line))
    finally:
        os._exit(0)
