"""Many who listen to one job: a process of their own, so that a service pays only for what itself does for them.

``python -m tests.benchmarks.crowd HOST PORT JOB LISTENERS LOSSES``: prints "here" as soon as everybody has heard the
job's first event, and at the end one JSON document. They speak HTTP over bare sockets: a client library would take
longer to read a frame than the service to write it, and its delay would be taken for the service's.
"""

import asyncio
import json
import sys
from dataclasses import dataclass, field
from datetime import UTC, datetime

LINE = b'data: {"sequence"'
"""So begins the document of an event; one frame is never cut, so its lines are found between the chunks' own."""


@dataclass
class Ear:
    """Events that one listener has heard, in order, and how late [s] where he was already there, or on his way."""

    sequences: list[int] = field(default_factory=list[int])
    delays_s: list[float] = field(default_factory=list[float])
    here: asyncio.Event = field(default_factory=asyncio.Event)


async def listen(host: str, port: int, job: str, ear: Ear, lose_after: int | None) -> bool:
    """One connection, until the stream ends, or lost after so many events. Whether it ended."""
    since, fresh = datetime.now(UTC), 0
    reader, writer = await asyncio.open_connection(host, port)
    last = ear.sequences[-1] if ear.sequences else 0
    ask = f"GET /api/v1/jobs/{job}/events HTTP/1.1\r\nHost: {host}\r\nLast-Event-ID: {last}\r\n\r\n"
    writer.write(ask.encode())
    try:
        status = await reader.readline()
        assert b" 200 " in status, status
        while (line := await reader.readline()) != b"0\r\n":
            assert line, "the stream was cut"
            if not line.startswith(LINE):
                continue
            event = json.loads(line.removeprefix(b"data: "))
            ear.sequences.append(event["sequence"])
            ear.here.set()
            at = datetime.fromisoformat(event["at"])
            if at > since:
                ear.delays_s.append((datetime.now(UTC) - at).total_seconds())
            fresh += 1
            if fresh == lose_after:
                return False
        return True
    finally:
        writer.transport.abort()


async def listener(host: str, port: int, job: str, ear: Ear, number: int, losses: int) -> None:
    """Listen to the end, and lose the connection so often on the way: everybody at another event."""
    for loss in range(losses):
        if await listen(host, port, job, ear, 2 + (number + loss) % 4):
            return
    await listen(host, port, job, ear, None)


async def crowd(host: str, port: int, job: str, listeners: int, losses: int) -> list[Ear]:
    """Everybody at once."""
    ears = [Ear() for _ in range(listeners)]
    async with asyncio.TaskGroup() as everybody:
        for number, ear in enumerate(ears):
            everybody.create_task(listener(host, port, job, ear, number, losses))
        for ear in ears:
            await ear.here.wait()
        print("here", flush=True)
    return ears


if __name__ == "__main__":
    _, host, port, job, listeners, losses = sys.argv
    heard = asyncio.run(crowd(host, int(port), job, int(listeners), int(losses)))
    print(json.dumps({"heard": [e.sequences for e in heard], "delays_s": [d for e in heard for d in e.delays_s]}))
