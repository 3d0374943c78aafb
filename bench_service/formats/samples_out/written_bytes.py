"""Write-only file object for writers whose files are streamed while they are written."""


class WrittenBytes:
    """Write-only file object: collects bytes until they are taken; not seekable."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []
        self._position = 0
        self.closed = False

    def write(self, data: bytes) -> int:
        """Append bytes; return their number."""
        self._pieces.append(bytes(data))
        self._position += len(data)
        return len(data)

    def flush(self) -> None:
        """Flush nothing: no data are buffered."""

    def close(self) -> None:
        """Close; what was written can still be taken."""
        self.closed = True

    def seekable(self) -> bool:
        """Return False: there is no seeking."""
        return False

    def take(self) -> bytes:
        """Return the bytes that were written since the last call, and forget them."""
        taken = b"".join(self._pieces)
        self._pieces.clear()
        return taken
