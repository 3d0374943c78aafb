"""Wires on bad days: N mutated frames for every parser, and a fault at every answer of a verb.

`python -m tests.validation.wires [N]`; N is 10⁶ by default.
"""

import asyncio
import logging
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from procedures.bench.errors import Disconnected
from procedures.core.table_angles import TableAngles
from simulators.served.faults import Fault
from tests.conformance.chambers import chamber
from tests.conformance.mutations import PARSERS, decoder, frame_all, mutated, parse_all, right_stream
from tests.conformance.tables import table

FRAMES_A_STREAM = 20
LINE_KINDS = ("slow", "half", "doubled", "cut", "cut_after", "silent")


@dataclass(frozen=True)
class Check:
    """One result."""

    words: str
    holds: bool


def parsers(frames: int, rng: np.random.Generator) -> list[Check]:
    """Mutated answers to every parser: no exception but the documented."""
    checks: list[Check] = []
    for protocol, (answer, _) in PARSERS.items():
        begun, taken = time.monotonic(), 0
        for _ in range(frames):
            spoiled = mutated(answer, rng)
            taken += parse_all(protocol, spoiled) > 0
            frame_all(spoiled, 8 if protocol == "acutrol" else 0)
        passed = time.monotonic() - begun
        checks.append(Check(f"{protocol}: {frames} answers, {taken} taken, {passed:.0f} s", True))
    return checks


def streams(frames: int, rng: np.random.Generator) -> list[Check]:
    """Mutated streams: bounded buffers, and no more strange frames than a CRC of 16 bits lets pass."""
    checks: list[Check] = []
    for kind in ("framed", "ixcom"):
        found, right, held, strange, decoded = decoder(kind), right_stream(kind, FRAMES_A_STREAM), 0, 0, 0
        sent = {(k, -k, 2 * k, 3, 4, -5 * k) for k in range(FRAMES_A_STREAM)}
        for _ in range(frames // FRAMES_A_STREAM):
            part = found.feed(mutated(right, rng))
            held, decoded = max(held, found.held), decoded + len(part.counts)
            strange += sum(tuple(row) not in sent for row in part.counts.tolist())
        # Each place where a frame may begin passes a CRC of 16 bits by chance once in 65536; a mutation spoils a few
        # frames and the decoder looks at up to a frame's bytes for each: four standard deviations above that.
        likely = 4.0 * frames / FRAMES_A_STREAM / 65536.0
        bound = likely + 4.0 * np.sqrt(likely) + 1.0
        words = (
            f"{kind}: {frames} frames, {decoded} decoded, {strange} strange (at most {bound:.1f}), {held} bytes held"
        )
        checks.append(Check(words, strange <= bound and held < 2048))
    return checks


async def _move(rig, fault: Fault) -> str:
    await rig.port.read()
    rig.behind.plan(fault)
    before = len(rig.demands())
    found = await asyncio.gather(rig.port.move_to(TableAngles(3, 4, 5)), return_exceptions=True)
    sent = rig.demands()[before:]
    if len(sent) != len(set(sent)):
        return f"twice: {sent}"
    if found != [None] and not isinstance(found[0], Disconnected):
        return f"{type(found[0]).__name__}: {found[0]}"
    rig.behind.plan()
    await rig.port.make_safe()
    await rig.port.move_to(TableAngles(1, 2, 3))
    return ""


async def _command(rig, fault: Fault) -> str:
    await rig.port.read()
    rig.behind.plan(fault)
    found = await asyncio.gather(rig.port.command(40.0, 2.0), return_exceptions=True)
    sets = rig.sets()
    if len(sets) != len(set(sets)):
        return f"twice: {sets}"
    if found != [None] and not isinstance(found[0], Disconnected):
        return f"{type(found[0]).__name__}: {found[0]}"
    rig.behind.plan()
    await rig.port.make_safe()
    return ""


def faults_everywhere(folder: Path) -> list[Check]:
    """One fault at each answer of a move and of a command: nothing goes out twice, and the device can be used after."""
    wrong: list[str] = []
    runs = 0
    for kind in LINE_KINDS:
        for at in range(1, 41):
            with table("acutrol", folder, answer_s=0.3) as rig:
                if words := asyncio.run(_move(rig, Fault("turntable", kind, at=at, seconds=0.6))):
                    wrong.append(f"turntable, {kind} at {at}: {words}")
            runs += 1
        for name in ("simserv", "ascii2"):
            for at in range(1, 13):
                with chamber(name, folder, answer_s=0.3) as rig:
                    if words := asyncio.run(_command(rig, Fault("chamber", kind, at=at, seconds=0.6))):
                        wrong.append(f"{name}, {kind} at {at}: {words}")
                runs += 1
    return [Check(f"faults at every answer: {runs} runs, {len(wrong)} wrong {wrong[:5]}", not wrong)]


def main() -> int:
    """Run all parts; 1 if one did not hold."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    rng = np.random.Generator(np.random.PCG64(20261130))
    logging.disable(logging.WARNING)
    with tempfile.TemporaryDirectory() as folder:
        checks = parsers(frames, rng) + streams(frames, rng) + faults_everywhere(Path(folder))
    for check in checks:
        print(("held " if check.holds else "WRONG"), check.words)
    return int(not all(check.holds for check in checks))


if __name__ == "__main__":
    sys.exit(main())
