"""`python -m tests.chaos.kills_over_wires`: kill the driving process in moves and ramps over wires.

A table in a move and at a constant rate, a chamber in a ramp: with SIGKILL, on SQLite and Postgres. Exit code 0 where
each bench was safe by its own readings within two seconds of the supervisor's notice, and the served world agrees.
"""

import argparse
import sys
import tempfile
from pathlib import Path

from tests.benchmarks.process import free_port
from tests.chaos.databases import database
from tests.chaos.journals import NOTICE_LIMIT_S
from tests.kit.killed_on_wires import DEMANDS, killed_in


def main() -> int:
    """Kill in each kind of motion, on each database, some times."""
    parser = argparse.ArgumentParser(prog="python -m tests.chaos.kills_over_wires", description=__doc__)
    parser.add_argument("--runs", type=int, default=1, help="of each kind on each database")
    parser.add_argument("--kind", choices=tuple(DEMANDS), action="append", help="all of them without this")
    parser.add_argument("--database", choices=("sqlite", "postgres", "both"), default="both")
    given = parser.parse_args()
    late: list[str] = []
    for store in ("sqlite", "postgres") if given.database == "both" else (given.database,):
        for kind in given.kind or tuple(DEMANDS):
            for _ in range(given.runs):
                with (
                    tempfile.TemporaryDirectory(prefix="kill-") as folder,
                    database(store, Path(folder)) as server,
                    killed_in(kind, server.url, Path(folder), free_port()) as found,
                ):
                    line = f"{kind} on {store}: {found}"
                print(line, flush=True)
                if not (found.world.safe and found.noticed_s < NOTICE_LIMIT_S):
                    late.append(line)
    print(*(f"NOT KEPT: {each}" for each in late) if late else ["every bench was safe in time"], sep="\n")
    return 1 if late else 0


if __name__ == "__main__":
    sys.exit(main())
