"""Messages gathered until there are enough of them to be decoded at once."""

from collections.abc import Iterator

import numpy as np

from bench_service.formats.logs.ros.messages import Decoder
from bench_service.formats.logs.table import Numbers

_AT_ONCE = 8192
_BYTES = 8 * 1024 * 1024


class Batches:
    """Gathers messages of one topic and decodes them in batches."""

    def __init__(self, decoder: Decoder) -> None:
        self._decoder = decoder
        self._clear()

    def _clear(self) -> None:
        self._messages: list[bytes] = []
        self._times: list[int] = []
        self._bytes = 0

    def add(self, data: bytes | memoryview, received_ns: int, published_ns: int = 0) -> Iterator[list[Numbers]]:
        """Add a message; yield blocks of columns once there are enough messages to decode."""
        self._messages.append(bytes(data))  # a view would keep its whole chunk, with the images that are in it
        self._times.append(received_ns)
        self._times.append(published_ns)
        self._bytes += len(data)
        if len(self._messages) >= _AT_ONCE or self._bytes > _BYTES:
            yield from self.rest()

    def rest(self) -> Iterator[list[Numbers]]:
        """Yield blocks of columns of all messages that were gathered and not decoded yet."""
        if not self._messages:
            return
        messages, times = self._messages, np.array(self._times, np.uint64).astype(np.int64).reshape(-1, 2)
        self._clear()
        yield from self._decoder.decode(messages, times[:, 0], times[:, 1])
