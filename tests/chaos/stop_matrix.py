"""``python -m tests.chaos.stop_matrix``: press stop while something is in its way, and measure until the bench is safe.

Each cell is a hindrance and a way to press. The unit is on and the table in mid-move at the press; the time is from the
client's send until the devices say that they are safe, in their register and in their journal. It must be within 2 s,
and within 5 s where the worker has to be killed first.
"""

import argparse
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from tests.chaos import stop_hindrances as hindrances
from tests.chaos import stop_hindrances_of_networks as networks
from tests.chaos.stop_bench import WAYS, Outcome, StopBench
from tests.chaos.stop_hindrances import NotHere

SOON_S, KILLED_S = 2.0, 5.0


@dataclass(frozen=True)
class Hindrance:
    """Hindrance of a stop, and how long a stop may take all the same [s]."""

    put: Callable[[Path], AbstractContextManager[StopBench] | Iterator[StopBench]]
    limit_s: float = SOON_S
    believes_clock: bool = True


MATRIX = {
    "nothing": Hindrance(hindrances.nothing),
    "full disk": Hindrance(hindrances.full_disk),
    "no inode": Hindrance(hindrances.no_inode),
    "locked SQLite": Hindrance(hindrances.locked_sqlite),
    "Postgres refuses": Hindrance(networks.postgres_refuses),
    "Postgres hangs": Hindrance(networks.postgres_hangs),
    "Postgres gone over TCP": Hindrance(networks.postgres_gone_over_tcp),
    "100 analyses": Hindrance(hindrances.analyses),
    "2000 idle sockets": Hindrance(hindrances.idle_sockets),
    "hostile import": Hindrance(hindrances.hostile_import),
    "worker stopped (SIGSTOP)": Hindrance(hindrances.stopped_worker, KILLED_S),
    "supervisor killed": Hindrance(hindrances.killed_supervisor),
    "log disk full": Hindrance(hindrances.full_log_disk),
    "clock jump": Hindrance(hindrances.clock_jump, believes_clock=False),
    "API on another host": Hindrance(networks.api_on_another_host),
}


def press(name: str, way: str, folder: Path) -> Outcome:
    """One run of one cell. Raises `NotHere`, and `AssertionError` where the bench did not come so far."""
    folder.mkdir(parents=True)
    cell = MATRIX[name]
    with cell.put(folder) as bench:  # type: ignore[union-attr]
        return bench.press(name, way, cell.limit_s, cell.believes_clock)


def main() -> int:
    """0 where every stop was in time."""
    parser = argparse.ArgumentParser(prog="python -m tests.chaos.stop_matrix", description=__doc__)
    parser.add_argument("--runs", type=int, default=5, help="of each cell")
    parser.add_argument("--only", action="append", help="a hindrance, by its name; may be repeated")
    parser.add_argument("--way", action="append", choices=WAYS, help="may be repeated")
    given = parser.parse_args()
    outcomes: list[Outcome] = []
    failed: list[str] = []
    for name in given.only or MATRIX:
        for way in given.way or WAYS:
            for _ in range(given.runs):
                try:
                    with tempfile.TemporaryDirectory(prefix="stop-", ignore_cleanup_errors=True) as temporary:
                        outcomes.append(press(name, way, Path(temporary) / "run"))
                    print(outcomes[-1], flush=True)
                except NotHere as why:
                    print(f"--   {name:28} {way:8} not shown here: {why}", flush=True)
                except Exception as error:
                    failed.append(f"{name} × {way}: {error}")
                    traceback.print_exc(limit=3)
    _summary(outcomes, failed)
    return 1 if failed or not all(outcome.kept for outcome in outcomes) else 0


def _summary(outcomes: list[Outcome], failed: list[str]) -> None:
    timed = [outcome for outcome in outcomes if outcome.safe_s is not None]
    print(
        f"{len(outcomes)} presses, {sum(outcome.kept for outcome in outcomes)} in time, {len(failed)} not carried out"
    )
    for name in dict.fromkeys(outcome.hindrance for outcome in timed):
        of_cell = {way: [o.safe_s or 0.0 for o in timed if (o.hindrance, o.way) == (name, way)] for way in WAYS}
        cells = (f"{way} {max(times):.2f} s of {len(times)}" for way, times in of_cell.items() if times)
        print(f"longest  {name:28} {', '.join(cells)}")
    for killed in (False, True):
        longest = max((o for o in timed if o.killed is killed), key=lambda o: o.safe_s or 0.0, default=None)
        if longest is not None:
            print(f"longest {'with the worker killed' if killed else 'without a kill'}: {longest}")
    print(*failed, sep="\n")


if __name__ == "__main__":
    sys.exit(main())
